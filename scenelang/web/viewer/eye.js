// Nothing is seen from inside something opaque: the exact fold at the eye; see `check_eye` of `scenelang/compiler/passes.py`.

import { refuse } from "./values.js";
import { BEGINS, ENDS, OPERATOR, SMOOTH, SUBTRACT } from "./groups.js";

const NOTHING_THERE = [Infinity, null]; // distance and row
const DISTANCES = {
  sphere: (x, y, z) => Math.hypot(x, y, z) - 1,
  torus: (x, y, z) => Math.hypot(Math.hypot(x, z) - 0.7, y) - 0.3,
};

/** A world point carried to a leaf of space by a row's steps. */
function carriedBack(steps, point) {
  let [x, y, z] = point;
  for (const [kind, a, b, c, d, ...more] of steps) {
    if (kind === "map") {
      const [e, f, g, h, i, j, k, l] = more;
      [x, y, z] = [a * x + b * y + c * z + d, e * x + f * y + g * z + h, i * x + j * y + k * z + l];
    } else if (kind === "twist") {
      const [cos, sin] = [Math.cos(a * y), Math.sin(a * y)];
      [x, z] = [cos * x + sin * z, cos * z - sin * x];
    } else {
      const angle = a * Math.hypot(x, y, z) + b * x;
      const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
      [x, y] = [cos * x + sin * y, cos * y - sin * x];
    }
  }
  return [x, y, z];
}

/** The distance of a blend, and the share of what joins. */
function blended(depth, distance, k) {
  if (Math.abs(depth) === Infinity || Math.abs(distance) === Infinity) {
    return [Math.min(depth, distance), Number(distance < depth)];
  }
  const h = Math.min(Math.max(0.5 + (0.5 * (depth - distance)) / k, 0), 1);
  return [(h === 1 ? distance : depth + h * (distance - depth)) - k * h * (1 - h), h];
}

/** A fold's distance and holder, [depth, holder], with something that joins. */
function foldedAt([depth, holder], operator, k, [distance, joins]) {
  if (operator > SMOOTH) {
    const cut = operator === SUBTRACT && joins !== null ? -distance : distance;
    return [k > 0 ? -blended(-depth, -cut, k)[0] : Math.max(depth, cut), holder];
  }
  if (operator === SMOOTH) {
    const [made, h] = blended(depth, distance, k);
    return [made, h > 0.5 ? joins : holder];
  }
  return [Math.min(depth, distance), distance < Math.max(depth, 0) ? joins : holder];
}

/** What a row has at the eye, as a fold of its own. */
function leafAt(row, distanceOf, eye) {
  if (distanceOf === undefined) return NOTHING_THERE;
  const [x, y, z] = carriedBack(row.steps, eye), f = row.frequency;
  const bump = row.amount * Math.sin(f * x) * Math.sin(f * y) * Math.sin(f * z);
  const [first, wall, last, late] = row.skin ?? [0, 0, 0, 0];
  const depth = distanceOf(x, y, z) + (1 - late) * bump - first;
  return [((wall > 0 ? Math.abs(depth) - wall : depth) - last + late * bump) * row.scale, row];
}

/** Throws NotLive where the eye is inside an opaque object; what has no formula counts as far away. */
export function checkEye({ rows, stage }, { geometries, media }) {
  const open = []; // the folds around a group, and how that will join
  let here = NOTHING_THERE;
  for (const row of rows) {
    let [operator, k] = [row.token & OPERATOR, row.blend];
    if (row.token & BEGINS) {
      open.push([here, operator, k]);
      [here, operator, k] = [NOTHING_THERE, 0, 0];
    }
    here = foldedAt(here, operator, k, leafAt(row, DISTANCES[geometries[row.shape]], stage.camera.eye));
    for (let ends = row.token >> ENDS; ends > 0; ends -= 1) {
      const [outer, joint, width] = open.pop();
      here = foldedAt(outer, joint, width, here);
    }
  }
  const [depth, holder] = here;
  if (depth < 0 && holder !== null && !media.includes(holder.material)) {
    refuse(`the camera is inside object ${holder.object}, a \`${geometries[holder.shape]}\``);
  }
}
