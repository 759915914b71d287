// Nothing is seen from inside something opaque: the exact fold at the eye; see `passes/check_eye.py`.

import { refuse } from "./values.js";

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

/** Throws NotLive where the eye is inside an opaque object; what has no formula counts as far away. */
export function checkEye({ rows, stage }, { geometries, media }) {
  let [depth, holder] = [Infinity, null];
  for (const row of rows) {
    const distanceOf = DISTANCES[geometries[row.shape]];
    if (distanceOf === undefined) {
      if (row.token >= 2) depth = Infinity;
      continue;
    }
    const [x, y, z] = carriedBack(row.steps, stage.eye);
    const f = row.frequency;
    const bump = row.amount * Math.sin(f * x) * Math.sin(f * y) * Math.sin(f * z);
    const distance = (distanceOf(x, y, z) + bump) * row.scale;
    if (row.token === 2) depth = Math.max(depth, -distance);
    else if (row.token === 3) depth = Math.max(depth, distance);
    else if (row.token === 1) {
      const h = Math.min(Math.max(0.5 + (0.5 * (depth - distance)) / row.blend, 0), 1);
      depth = (h === 1 ? distance : depth + h * (distance - depth)) - row.blend * h * (1 - h);
      holder = h > 0.5 ? row : holder;
    } else {
      holder = distance < Math.max(depth, 0) ? row : holder;
      depth = Math.min(depth, distance);
    }
  }
  if (depth < 0 && holder !== null && !media.includes(holder.material)) {
    refuse(`the camera is inside object ${holder.object}, a \`${geometries[holder.shape]}\``);
  }
}
