// Materials: operations on colours, folded to one colour where there is no texture.

import { modulo, refuse } from "./values.js";
import { hsvToRgb } from "./functions.js";
import { IDENTITY, composedMap, flatMap, invertedMap, usableMap } from "./maps.js";

const LUMA_SHARES = [0.2126, 0.7152, 0.0722];
const MOST_OPERATIONS = 1000;

/** The linear numbers of a colour as written (IEC 61966-2-1). */
export function linearColour(srgb) {
  return srgb.map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
}

const shareOf = (v) => Math.min(Math.max(v, 0), 1);

function rgbToHsv([r, g, b]) {
  const [most, least] = [Math.max(r, g, b), Math.min(r, g, b)];
  if (most === least) return [0, 0, most];
  const [rc, gc, bc] = [r, g, b].map((v) => (most - v) / (most - least));
  const h = r === most ? bc - gc : g === most ? 2 + rc - bc : 4 + gc - rc;
  return [modulo(h / 6, 1), (most - least) / most, most];
}

function inkedColour(rgb, [kind, ...numbers]) {
  if (kind === "color") return rgb.map((v, at) => shareOf(v * numbers[at]));
  if (kind === "grayscale") {
    const y = rgb[0] * LUMA_SHARES[0] + rgb[1] * LUMA_SHARES[1] + rgb[2] * LUMA_SHARES[2];
    return rgb.map((v) => shareOf(v + numbers[0] * (y - v)));
  }
  const [h, s, v] = rgbToHsv(rgb);
  return hsvToRgb(modulo(h + numbers[0], 1), s, v).map(shareOf);
}

function inksJoined([kind, ...a], [, ...b]) {
  if (kind === "hue") return [kind, modulo(a[0] + b[0], 1)];
  if (kind === "grayscale") return [kind, a[0] + b[0] - a[0] * b[0]];
  return [kind, ...a.map((number, at) => number * b[at])];
}

const IDLE_NUMBERS = { color: 1, grayscale: 0, hue: 0 };

/** The same operations, fewer: neighbours of a kind join where nothing is clamped between them. */
function fewerInks(steps) {
  const found = [];
  for (let step of steps) {
    const last = found.at(-1);
    const [kind, ...numbers] = last ?? [];
    if (kind === step[0] && (kind === "hue" || numbers.every((number) => number >= 0 && number <= 1))) {
      step = inksJoined(found.pop(), step);
    } else if (step[0] === "hue") {
      step = inksJoined(["hue", 0], step);
    }
    if (!step.slice(1).every((number) => number === IDLE_NUMBERS[step[0]])) found.push(step);
  }
  return found;
}

/**
 * What a row says of a material.
 * @param {Wearing} worn - its `ops` are maps {rows}, colour steps and properties, of which the last one counts
 */
export function lookOf(worn, form) {
  let moved = IDENTITY;
  const sides = form.dimension === 3 ? "sheet" : 2;
  const steps = [], stops = [];
  let opacity = 1, glow, density;
  for (const op of worn.ops) {
    if (op[0] === "stop") {
      const rgb = op.slice(2).map(shareOf);
      stops.push([op[1], ...(form.dimension === 3 ? linearColour(rgb) : rgb)]);
      continue;
    }
    if (op[0] === "opacity") {
      opacity = op[1];
      continue;
    }
    if (op[0] === "glow") {
      glow = linearColour(op.slice(2)).map((v) => v * op[1]);
      continue;
    }
    if (op[0] === "density") {
      density = op[1];
      if (!form.media.includes(worn.lit)) refuse("a density of what is not volumetric");
      continue;
    }
    if (Array.isArray(op)) {
      steps.push(form.dimension === 3 && op[0] === "color" ? ["color", ...linearColour(op.slice(1))] : op);
      continue;
    }
    if (worn.paint >= 0 && form.spatial[worn.paint]) refuse("colours of space do not move");
    const rows = form.dimension === 3 ? op.rows : flatMap(op.rows);
    if (rows === null && worn.paint >= 0) refuse("a move of a texture leaves its plane");
    if (rows !== null && !usableMap(rows, sides)) refuse("a move of a texture is singular");
    if (rows !== null) moved = composedMap(rows, moved);
  }
  if (!usableMap(moved, sides)) refuse("the moves of a texture compose to a singular one");
  checkStops(stops, worn.paint >= 0 && form.graded[worn.paint]);
  if (opacity !== 1 && form.dimension === 3) refuse("in space nothing but mist is translucent");
  const look = { material: worn.lit, paint: worn.paint, colour: [1, 1, 1], opacity, glow, density };
  if (worn.paint < 0) return { ...look, colour: steps.reduce(inkedColour, [1, 1, 1]) };
  const paintSteps = fewerInks(steps);
  if (paintSteps.length > MOST_OPERATIONS) refuse("too many operations on the colours of a texture");
  const [a, b, p, x, c, d, q, y] = invertedMap(moved);
  const tilt = moved[2] || moved[6] ? [p, q] : undefined;
  return { ...look, place: [a, b, x, c, d, y], tilt, paintSteps, stops: stops.length ? stops : undefined };
}

function checkStops(stops, graded) {
  if (!graded && stops.length) refuse("stops in what is not a gradient");
  if (graded && !(stops.length >= 2 && stops.length <= 8)) refuse("a gradient has 2 to 8 stops");
  const rising = stops.every(([offset], at) => offset >= (at ? stops[at - 1][0] : 0) && offset <= 1);
  if (!rising) refuse("offsets of stops rise from 0 to 1");
}
