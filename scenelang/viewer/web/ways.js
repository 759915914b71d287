// Where objects of the plane lie in the world: how far they reach, and in which tiles of a frame.
// Steps lead from the world to a leaf; balls are carried the other way, as renderers/frames.py does.

/** The inverse of a map of six numbers. */
function inverse([a, b, u, c, d, v]) {
  const det = a * d - b * c;
  const [p, q, r, s] = [d / det, -b / det, -c / det, a / det];
  return [p, q, -(p * u + q * v), r, s, -(r * u + s * v)];
}

/** How much farther apart a linear map [a, b, c, d] takes points at most. */
function steepest(a, b, c, d) {
  return 0.5 * (Math.hypot(a + d, c - b) + Math.hypot(a - d, c + b));
}

const rateOf = ([, twirl, x, y]) => Math.abs(twirl) + Math.hypot(x, y);

/**
 * The world's box around a leaf's disc, by its centre and half its sides, and how much faster a distance
 * can change than one world unit per world unit.
 */
export function discInWorld(steps, radius) {
  let [a, b, u, c, d, v] = [radius, 0, 0, 0, radius, 0];
  let stretch = 1;
  for (const step of [...steps].reverse()) {
    if (step[0] === "map") {
      const [e, f, g, h, i, j] = inverse(step.slice(1));
      [a, b, u, c, d, v] = [
        e * a + f * c, e * b + f * d, e * u + f * v + g, h * a + i * c, h * b + i * d, h * u + i * v + j,
      ];
    } else { // a turn keeps the way to the origin, and no more is known
      const most = Math.hypot(u, v) + steepest(a, b, c, d);
      stretch *= 1 + most * rateOf(step);
      [a, b, u, c, d, v] = [most, 0, 0, 0, most, 0];
    }
  }
  return { centre: [u, v], half: [Math.hypot(a, b), Math.hypot(c, d)], stretch };
}

/** Leaf coordinates of the centre of a disc in the world, and the radius of one in which those of it lie. */
export function discInLeaf(steps, x, y, radius) {
  for (const step of steps) {
    if (step[0] === "map") {
      const [, a, b, u, c, d, v] = step;
      [x, y, radius] = [a * x + b * y + u, c * x + d * y + v, radius * steepest(a, b, c, d)];
    } else {
      const length = Math.hypot(x, y);
      const angle = step[1] * length + step[2] * x + step[3] * y;
      const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
      radius *= 1 + (length + radius) * rateOf(step);
      [x, y] = [x * cos + y * sin, y * cos - x * sin];
    }
  }
  return { x, y, radius };
}

/**
 * Leaf units from each object's origin beyond which it makes no difference to the picture, Infinity where it
 * concerns every point; and the widest blend, world units.
 */
export function reaches(rows, { tokens, blend, slack, farther, farthest }) {
  const reach = new Float64Array(rows.length);
  let [after, total] = [0, 0]; // of the smooth unions from a row on, the widest and the sum
  for (let i = rows.length - 1; i >= 0; i--) {
    const { token, scale } = rows[i];
    if (token === tokens.smooth) [after, total] = [Math.max(after, rows[i].blend), total + rows[i].blend];
    const every = token === tokens.intersect || (token === tokens.subtract && after > 0);
    reach[i] = every ? Infinity : 1 + slack + Math.min(farther * total, farthest * after) / scale;
  }
  return { reach, widest: Math.max(blend, after) };
}

/**
 * Which objects each tile of a frame meets, in stream order.
 * @param reach - of the rows, as `reaches` has them
 * @param draws - of a token, whether it draws something where nothing is
 * @returns {{starts: Int32Array, objects: Int32Array}} starts: (tiles + 1), tiles from the lower left corner
 */
export function tileLists(rows, reach, { width, height, tile, px }, draws) {
  const [across, down] = [Math.ceil(width / tile), Math.ceil(height / tile)];
  const side = tile * px;
  const around = side * Math.SQRT1_2 * (1 + 1e-6);
  const [left, low] = [-0.5 * width * px, -0.5 * height * px];
  const drawn = new Uint8Array(across * down);
  const [tiles, objects] = [[], []];
  rows.forEach(({ steps, token }, object) => {
    let [x0, x1, y0, y1] = [0, across - 1, 0, down - 1];
    if (reach[object] < Infinity) {
      const { centre: [x, y], half: [w, h] } = discInWorld(steps, reach[object]);
      // what is not a number is everywhere
      [x0, x1] = [(x - w - left) / side, (x + w - left) / side].map(Math.floor);
      [y0, y1] = [(y - h - low) / side, (y + h - low) / side].map(Math.floor);
      [x0, y0] = [x0 > 0 ? x0 : 0, y0 > 0 ? y0 : 0];
      [x1, y1] = [x1 < across ? x1 : across - 1, y1 < down ? y1 : down - 1];
    }
    for (let j = y0; j <= y1; j++) {
      for (let i = x0; i <= x1; i++) {
        const at = j * across + i;
        if (!draws[token] && !drawn[at]) continue;
        const q = discInLeaf(steps, left + (i + 0.5) * side, low + (j + 0.5) * side, around);
        if (Math.hypot(q.x, q.y) - q.radius > reach[object]) continue;
        drawn[at] = 1;
        tiles.push(at);
        objects.push(object);
      }
    }
  });
  const starts = new Int32Array(across * down + 1);
  for (const at of tiles) starts[at + 1]++;
  for (let at = 0; at < across * down; at++) starts[at + 1] += starts[at];
  const next = starts.slice();
  const sorted = new Int32Array(objects.length);
  tiles.forEach((at, pair) => { sorted[next[at]++] = objects[pair]; });
  return { starts, objects: sorted };
}
