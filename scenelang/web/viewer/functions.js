// The functions of the language, by their names; each takes its arguments' values in order.

import { Angle, Progression, Vec } from "./values.js";
import { arithmetic, bare, finite, kindOf, modulo, quantity, radians, refuse } from "./values.js";
import { sameUnit, sizeOf, unitOf } from "./values.js";

function eachItem(change, value) {
  return value instanceof Vec ? new Vec(value.items.map((item) => eachItem(change, item))) : change(value);
}

const ofAngle = (change) => (value) => eachItem((x) => finite(change(radians(x))), value);
const ofNumber = (change) => (value) => eachItem((x) => finite(change(bare(x))), value);
const toAngle = (change) => (value) => eachItem((x) => new Angle(finite(change(bare(x)))), value);

function scalarOf(value) {
  const unit = unitOf(value);
  return unit < 0 ? refuse(`expected a number, found ${kindOf(value)}`) : [sizeOf(value), unit];
}

/** Of two scalars the first if it is better, else the other; componentwise where one is a vector. */
function picked(a, b, better) {
  if (a instanceof Vec || b instanceof Vec) {
    const length = (a instanceof Vec ? a : b).items.length;
    if (b instanceof Vec && b.items.length !== length) refuse("vectors of different lengths do not combine");
    const item = (value, at) => (value instanceof Vec ? value.items[at] : value);
    return new Vec(Array.from({ length }, (_, at) => picked(item(a, at), item(b, at), better)));
  }
  const [[x, unitA], [y, unitB]] = [scalarOf(a), scalarOf(b)];
  const unit = sameUnit(x, unitA, y, unitB);
  return quantity(better(x, y) ? x : y, unit);
}

const least = (x, y) => x <= y;
const greatest = (x, y) => x >= y;

const best = (better) => (...values) => {
  const among = values.length === 1 && values[0] instanceof Vec ? values[0].items : values;
  if (among.length === 0) refuse("expected at least one number, found an empty vector");
  if (among.length === 1) scalarOf(among[0]);
  return among.reduce((a, b) => picked(a, b, better));
};

function clamped(x, low, high) {
  if (unitOf(low) >= 0 && unitOf(high) >= 0) {
    sameUnit(sizeOf(low), unitOf(low), sizeOf(high), unitOf(high));
    if (sizeOf(low) > sizeOf(high)) refuse("clamp from a number down to another");
  }
  return picked(picked(x, low, greatest), high, least);
}

function rounded(x) {
  const whole = Math.floor(Math.abs(x));
  const size = whole + (Math.abs(x) - whole >= 0.5 ? 1 : 0);
  return x < 0 || Object.is(x, -0) ? -size : size;
}

function mixed(a, b, share) {
  if (!(share instanceof Vec)) bare(share);
  return arithmetic("+", arithmetic("*", a, arithmetic("-", 1, share)), arithmetic("*", b, share));
}

function smoothed(low, high, x) {
  return eachItem((item) => {
    const [[edge0, unit0], [edge1, unit1], [v, unit]] = [scalarOf(low), scalarOf(high), scalarOf(item)];
    sameUnit(edge0, unit0, edge1, unit1);
    sameUnit(edge0, unit0, v, unit);
    const share = Math.min(Math.max(finite((v - edge0) / finite(edge1 - edge0)), 0), 1);
    return share * share * (3 - 2 * share);
  }, x);
}

function lengthOf(value) {
  if (value instanceof Vec) return value.items.length;
  if (value instanceof Progression) return value.count();
  return typeof value === "string" ? [...value].length : refuse(`${kindOf(value)} has no length`);
}

const MOST_PLACES = 15;

/** A number, a boolean or a string as text, as `values.text_of` in scenelang/language writes it. */
function textOf(value, digits) {
  if (digits !== undefined) return rounding(bare(value), bare(digits));
  if (typeof value === "string" || typeof value === "boolean") return String(value);
  const size = Math.abs(bare(value));
  return size > 0 && (size < 1e-4 || size >= 1e16) ? value.toExponential().replace("e+", "e") : String(value);
}

function rounding(x, places) {
  if (!Number.isInteger(places) || places < 0 || places > MOST_PLACES) refuse(`${places} digits of a number`);
  const size = Math.abs(x);
  const zeros = places > 0 ? `.${"0".repeat(places)}` : "";
  const text = size < 1e21 ? size.toFixed(places) : BigInt(size) + zeros; // from there on toFixed has exponents
  return x < 0 && /[1-9]/.test(text) ? `-${text}` : text;
}

const MASK_64 = (1n << 64n) - 1n;
const BITS_OF_SEED = new DataView(new ArrayBuffer(8));

/** One output of SplitMix64 (Steele, Lea, Flood 2014). */
function splitMix64(state) {
  let z = (state + 0x9e3779b97f4a7c15n) & MASK_64;
  z = ((z ^ (z >> 30n)) * 0xbf58476d1ce4e5b9n) & MASK_64;
  z = ((z ^ (z >> 27n)) * 0x94d049bb133111ebn) & MASK_64;
  return z ^ (z >> 31n);
}

/** A number in [0, 1): the top 53 bits of SplitMix64 over the bits of the seed, folded if it is a vector. */
function randomOf(seed) {
  let state = 0n;
  for (const item of seed instanceof Vec ? seed.items : [seed]) {
    BITS_OF_SEED.setFloat64(0, bare(item) + 0); // + 0 makes -0 a 0
    state = splitMix64(state ^ BITS_OF_SEED.getBigUint64(0));
  }
  return Number(state >> 11n) / 2 ** 53;
}

const NOISE_FACTORS = [0x8da6b343, 0xd8163841, 0xcb1ab31f, 0x9e3779b9];
const NOISE_ROUNDS = [[16, 0x21f0aaad], [15, 0x735a2d97], [15, 1]];

/** The gradient of a lattice point times (x, y, z), as scenelang/language/noise.py has it. */
function slopeAt(i, j, k, seed, x, y, z) {
  let h = [i, j, k, seed].reduce((sum, whole, at) => sum ^ Math.imul(whole, NOISE_FACTORS[at]), 0);
  for (const [shift, factor] of NOISE_ROUNDS) h = Math.imul(h ^ (h >>> shift), factor);
  const index = (h >>> 0) % 12;
  const [a, b] = [[x, y], [x, z], [y, z]][index >> 2];
  return (index & 2 ? -a : a) + (index & 1 ? -b : b);
}

const easing = (t) => t * t * t * (t * (6 * t - 15) + 10);
const mixture = (a, b, share) => a + share * (b - a);

function noiseOf(v, seed = 0) {
  const point = v instanceof Vec ? v.items.map(bare) : [bare(v)];
  if (point.length === 0 || point.length > 3) refuse(`expected a vector of 1 to 3, found ${kindOf(v)}`);
  if (!Number.isInteger(bare(seed))) refuse(`a seed of ${seed}`);
  const [i, j, k] = [0, 1, 2].map((at) => Math.floor(point[at] ?? 0));
  const [x, y, z] = [i, j, k].map((whole, at) => (point[at] ?? 0) - whole);
  const at = (dx, dy, dz) => slopeAt(i + dx, j + dy, k + dz, seed, x - dx, y - dy, z - dz);
  const row = (dy, dz) => mixture(at(0, dy, dz), at(1, dy, dz), easing(x));
  const layer = (dz) => mixture(row(0, dz), row(1, dz), easing(y));
  return mixture(layer(0), layer(1), easing(z));
}

/** Red, green and blue of a hue in turns, a saturation and a value. */
export function hsvToRgb(h, s, v) {
  if (s === 0) return [v, v, v];
  const sector = Math.trunc(h * 6);
  const f = h * 6 - sector;
  const [p, q, w] = [v * (1 - s), v * (1 - s * f), v * (1 - s * (1 - f))];
  return [[v, w, p], [q, v, p], [p, v, w], [p, q, v], [w, p, v], [v, p, q]][sector % 6];
}

function hsvColour(h, s, v) {
  const turns = h instanceof Angle ? h.size / (2 * Math.PI) : bare(h);
  return new Vec(hsvToRgb(modulo(turns, 1), bare(s), bare(v)));
}

export const FUNCTIONS = {
  sin: ofAngle(Math.sin),
  cos: ofAngle(Math.cos),
  tan: ofAngle(Math.tan),
  asin: toAngle(Math.asin),
  acos: toAngle(Math.acos),
  atan2: (y, x) => new Angle(Math.atan2(bare(y), bare(x))),
  abs: (value) => eachItem((item) => quantity(Math.abs(scalarOf(item)[0]), unitOf(item)), value),
  min: best(least),
  max: best(greatest),
  clamp: clamped,
  floor: ofNumber((x) => Math.floor(x) + 0),
  ceil: ofNumber((x) => Math.ceil(x) + 0),
  round: ofNumber(rounded),
  sqrt: ofNumber(Math.sqrt),
  exp: ofNumber(Math.exp),
  log: ofNumber(Math.log),
  mix: mixed,
  smoothstep: smoothed,
  len: lengthOf,
  str: textOf,
  rand: randomOf,
  noise: noiseOf,
  rgb: (...parts) => new Vec(parts.map(bare)),
  hsv: hsvColour,
};
