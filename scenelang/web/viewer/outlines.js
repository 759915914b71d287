// Polygons and splines, where they lie and which shape of the view they are, as assets/element.py makes them. A
// form has those of its scene as `outlines`: kind, shape, and the points in the unit disc.

import { bare, kindOf, refuse, Vec } from "./values.js";

const FEWEST = 3, MOST = 1000;

function pointsOf(given) {
  const items = given instanceof Vec ? given.items : refuse(`expected a vector of points, found ${kindOf(given)}`);
  const points = items.map((item) => {
    if (!(item instanceof Vec) || item.items.length !== 2) refuse(`expected a point [x, y], found ${kindOf(item)}`);
    return item.items.map(bare);
  });
  const different = new Set(points.map(String)).size;
  if (different < FEWEST || points.length > MOST) refuse(`${points.length} points of a polygon or a spline`);
  return points.filter(([x, y], at) => {
    const [p, q] = points.at(at - 1);
    return x !== p || y !== q;
  });
}

/** Points, and of a spline the control points of its curves too. */
function hullOf(kind, points) {
  if (kind === "polygon") return points;
  const count = points.length;
  return points.flatMap(([x, y], at) => {
    const [[a, b], [p, q], [u, v]] = [-1, 1, 2].map((step) => points[(at + step + count) % count]);
    return [[x, y], [x + (p - a) / 6, y + (q - b) / 6], [p - (u - x) / 6, q - (v - y) / 6]];
  });
}

const keyOf = (kind, numbers) => `${kind} ${numbers.map((number) => Math.round(number * 1e6) + 0)}`;
const known = new WeakMap(); // shapes by their keys, of forms

/** The shape of points, and the radius and the map of where it lies. */
export function outlineOf(kind, given, form) {
  if (!known.has(form)) {
    known.set(form, new Map(form.outlines.map(([each, shape, points]) => [keyOf(each, points), shape])));
  }
  const points = pointsOf(given), hull = hullOf(kind, points);
  const middle = [0, 1].map((axis) => {
    const along = hull.map((point) => point[axis]);
    return Math.min(...along) / 2 + Math.max(...along) / 2;
  });
  const reach = ([x, y]) => Math.max(...hull.map(([p, q]) => Math.hypot(p - x, q - y)));
  const about = reach([0, 0]), central = about <= 1.25 * reach(middle);
  const [x, y] = central ? [0, 0] : middle;
  const radius = central ? about : reach(middle);
  const shape = known.get(form).get(keyOf(kind, points.flatMap(([p, q]) => [(p - x) / radius, (q - y) / radius])));
  if (shape === undefined) refuse(`a page draws the points of a ${kind} as they were when it was made`);
  return { shape, radius, there: [radius, 0, 0, x, 0, radius, 0, y, 0, 0, 1, 0] };
}
