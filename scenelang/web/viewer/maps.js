// Affine maps as the upper three rows of a 4 x 4 matrix, row by row, for column vectors; those of the plane
// leave z alone. And the transforms of the language: what each makes of its arguments.

import { Vec } from "./values.js";
import { bare, kindOf, numbersOf, radians, refuse } from "./values.js";

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
const SINGULAR = 1e-12; // smallest to largest stretch
const REACH = 1e30; // of numbers whose inverses float32 keeps

/** The map that applies `inner` first, then `outer`. */
export function composedMap(outer, inner) {
  const [a, b, c, d, e, f, g, h, i, j, k, m] = outer;
  const [p, q, r, s, t, u, v, w, x, y, z, o] = inner;
  return [
    a * p + b * t + c * x, a * q + b * u + c * y, a * r + b * v + c * z, a * s + b * w + c * o + d,
    e * p + f * t + g * x, e * q + f * u + g * y, e * r + f * v + g * z, e * s + f * w + g * o + h,
    i * p + j * t + k * x, i * q + j * u + k * y, i * r + j * v + k * z, i * s + j * w + k * o + m,
  ];
}

/** The inverse of a map that has one. */
export function invertedMap(rows) {
  const [a, b, c, x, d, e, f, y, g, h, i, z] = rows;
  let [p, q, r] = [e * i - f * h, f * g - d * i, d * h - e * g];
  const det = a * p + b * q + c * r;
  [p, q, r] = [p / det, q / det, r / det];
  const [s, t, u] = [(c * h - b * i) / det, (a * i - c * g) / det, (b * g - a * h) / det];
  const [v, w, o] = [(b * f - c * e) / det, (c * d - a * f) / det, (a * e - b * d) / det];
  return [
    p, s, v, -(p * x + s * y + v * z),
    q, t, w, -(q * x + t * y + w * z),
    r, u, o, -(r * x + u * y + o * z),
  ];
}

/** Whether a map leaves everything as it is. */
export function idleMap(rows) {
  return rows.every((number, at) => number === IDENTITY[at]);
}

/** The smallest and largest singular value of a map of the plane. */
function flatStretches([a, b, , , c, d]) {
  const largest = 0.5 * (Math.hypot(a + d, c - b) + Math.hypot(a - d, c + b));
  return [largest > 0 ? Math.abs(a * d - b * c) / largest : 0, largest];
}

/** The same in space, by Jacobi rotations of the square of its linear part. */
function solidStretches([a, b, c, , d, e, f, , g, h, i]) {
  const m = [
    [a * a + d * d + g * g, a * b + d * e + g * h, a * c + d * f + g * i],
    [a * b + d * e + g * h, b * b + e * e + h * h, b * c + e * f + h * i],
    [a * c + d * f + g * i, b * c + e * f + h * i, c * c + f * f + i * i],
  ];
  for (let sweep = 0; sweep < 8; sweep += 1) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (m[p][q] === 0) continue;
      const theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
      const t = (theta >= 0 ? 1 : -1) / (Math.abs(theta) + Math.hypot(theta, 1));
      const co = 1 / Math.hypot(t, 1);
      const si = t * co;
      for (const row of m) [row[p], row[q]] = [co * row[p] - si * row[q], si * row[p] + co * row[q]];
      for (let r = 0; r < 3; r += 1) {
        [m[p][r], m[q][r]] = [co * m[p][r] - si * m[q][r], si * m[p][r] + co * m[q][r]];
      }
    }
  }
  const values = [0, 1, 2].map((r) => Math.sqrt(Math.max(m[r][r], 0))).sort((x, y) => x - y);
  const det = Math.abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g));
  const area = values[2] * values[1];
  return [Math.min(area > 0 ? det / area : 0, values[1]), values[2]];
}

/** The same by what is left of points that a map carries back: x and y. */
function sheetStretches(rows) {
  const [a, b, c, , d, e, f] = invertedMap(rows);
  const p = a * a + b * b + c * c, q = a * d + b * e + c * f, r = d * d + e * e + f * f;
  const largest = Math.sqrt((p + r) / 2 + Math.hypot((p - r) / 2, q));
  const area = Math.hypot(a * e - b * d, b * f - c * e, c * d - a * f);
  return largest > 0 && area > 0 ? [1 / largest, largest / area] : [0, 1];
}

/** The smallest and largest singular value of a map's linear part, in a dimension or a "sheet" of space. */
export function stretchesOf(rows, dimension) {
  if (dimension === "sheet") return sheetStretches(rows);
  return dimension === 2 ? flatStretches(rows) : solidStretches(rows);
}

/** Whether a map can be invertedMap, and the inverse kept in float32. */
export function usableMap(rows, dimension) {
  const [smallest, largest] = stretchesOf(rows, dimension);
  const offset = Math.max(Math.abs(rows[3]), Math.abs(rows[7]), Math.abs(rows[11]), 1);
  return smallest > SINGULAR * largest && offset < REACH * smallest && largest < REACH;
}

/** Whether deformations are ones that float32 keeps. */
export function mild(...numbers) {
  return numbers.every((number) => Math.abs(number) < REACH);
}

/** The map of the plane that a map of space is there, or null where it leaves the plane. */
export function flatMap(rows) {
  if (rows[2] || rows[6] || rows[8] || rows[9] || rows[11]) return null;
  return [rows[0], rows[1], 0, rows[3], rows[4], rows[5], 0, rows[7], 0, 0, 1, 0];
}

/** Arguments in full: the items of one vector, or the values as they are. */
function spread(values, required, most) {
  if (values.slice(1).some((value) => value !== undefined)) return values;
  const items = values[0] instanceof Vec ? values[0].items : [];
  if (items.length >= required && items.length <= most) return items;
  return refuse(`expected a vector of ${required} or ${most} numbers, found ${kindOf(values[0])}`);
}

function scaling(x, y, z) {
  if (x === 0 || y === 0 || z === 0) refuse("a scale by 0 flattens what it moves");
  return [x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0];
}

function scaled(values) {
  const [x, y, z] = spread(values, 2, 3);
  return scaling(bare(x), bare(y), z === undefined ? 1 : bare(z));
}

/** Rodrigues' rotation formula. */
function turned(angle, axis) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  let [x, y, z] = axis;
  if (x === 0 && y === 0) {
    if (z === 0) refuse("an axis of length 0");
    const sine = z > 0 ? s : -s;
    return [c, -sine, 0, 0, sine, c, 0, 0, 0, 0, 1, 0];
  }
  const n = Math.hypot(x, y, z);
  [x, y, z] = [x / n, y / n, z / n];
  const v = 1 - c;
  return [
    c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0,
    y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0,
    z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0,
  ];
}

/** Whether three rows have a determinant that is 0, as far as float64 can tell. */
function flattens(rows) {
  const lengths = rows.map(([x, y, z]) => Math.hypot(x, y, z));
  if (!lengths.every((length) => length > 0 && length < Infinity)) return true;
  const [[a, b, c], [d, e, f], [g, h, i]] = rows.map((row, at) => row.map((number) => number / lengths[at]));
  return Math.abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)) < 1e-14;
}

const SHEARS = [1, 2, 4, 6, 8, 9]; // places of xy, xz, yx, yz, zx and zy

/** Maps by the words of the language; each takes values, undefined where an argument is left out. */
export const MAPS = {
  translate(values) {
    const [x, y, z] = spread(values, 2, 3);
    return [1, 0, 0, bare(x), 0, 1, 0, bare(y), 0, 0, 1, z === undefined ? 0 : bare(z)];
  },
  rotate([angle, axis]) {
    const about = axis === undefined ? [0, 0, 1] : numbersOf(axis, 3);
    return turned(radians(angle), about);
  },
  scale: scaled,
  even([factor]) {
    if (factor instanceof Vec) return scaled([factor]);
    const s = bare(factor);
    return scaling(s, s, s);
  },
  shear(values) {
    const given = SHEARS.flatMap((place, at) => (values[at] === undefined ? [] : [[place, values[at]]]));
    if (given.length !== 1) refuse(`shear takes one term, found ${given.length}`);
    const rows = [...IDENTITY];
    rows[given[0][0]] = bare(given[0][1]);
    return rows;
  },
  matrix([rows]) {
    if (!(rows instanceof Vec) || rows.items.length !== 4) refuse("expected 4 rows of 4 numbers");
    const numbers = rows.items.map((row) => numbersOf(row, 4));
    if (numbers[3].join() !== "0,0,0,1") refuse("the last row of a matrix is not 0, 0, 0, 1");
    if (flattens(numbers.slice(0, 3))) refuse("a singular matrix flattens what it moves");
    return [...numbers[0], ...numbers[1], ...numbers[2]];
  },
  flip: () => [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0],
};
