// Where objects of the plane lie in the world: how far they reach, and in which tiles of a frame.
// Steps lead from the world to a leaf; balls are carried the other way, as in scenelang/drawing/neural/frames.py.

const MOST_PAIRS = 2 ** 22; // of an object and a tile

/** The inverse of a map of six numbers. */
function inverse([a, b, u, c, d, v]) {
  const det = a * d - b * c;
  const [p, q, r, s] = [d / det, -b / det, -c / det, a / det];
  return [p, q, -(p * u + q * v), r, s, -(r * u + s * v)];
}

/** How much farther apart a linear map [a, b, c, d] takes points at most. */
export function steepest(a, b, c, d) {
  return 0.5 * (Math.hypot(a + d, c - b) + Math.hypot(a - d, c + b));
}

/** How fast a turn's angle changes at most, per distance. */
export const rateOf = ([, twirl, x, y]) => Math.abs(twirl) + Math.hypot(x, y);

/** The world's box around a leaf's disc, by its centre and half its sides. */
function discInWorld(steps, radius) {
  let [a, b, u, c, d, v] = [radius, 0, 0, 0, radius, 0];
  for (const step of [...steps].reverse()) {
    if (step[0] === "map") {
      const [e, f, g, h, i, j] = inverse(step.slice(1));
      [a, b, u, c, d, v] = [
        e * a + f * c, e * b + f * d, e * u + f * v + g, h * a + i * c, h * b + i * d, h * u + i * v + j,
      ];
    } else { // a turn keeps the way to the origin, and no more is known
      const most = Math.hypot(u, v) + steepest(a, b, c, d);
      [a, b, u, c, d, v] = [most, 0, 0, 0, most, 0];
    }
  }
  return { centre: [u, v], half: [Math.hypot(a, b), Math.hypot(c, d)] };
}

/** Steps as numbers, eight each: of a map six, 0 and its steepness; of a turn three, then 1 and rate. */
function flattened(steps) {
  const numbers = new Float64Array(8 * steps.length);
  steps.forEach((step, i) => {
    numbers.set(step.slice(1), 8 * i);
    const turns = step[0] !== "map";
    numbers[8 * i + 6] = turns ? 1 : 0;
    numbers[8 * i + 7] = turns ? rateOf(step) : steepest(step[1], step[2], step[4], step[5]);
  });
  return numbers;
}

/** How far from a leaf's origin the points of a disc in the world are at least and at most, in leaf units. */
function extent(way, x, y, radius) {
  for (let i = 0; i < way.length; i += 8) {
    const [a, b, c] = [way[i], way[i + 1], way[i + 2]];
    if (way[i + 6] === 0) {
      const moved = a * x + b * y + c;
      y = way[i + 3] * x + way[i + 4] * y + way[i + 5];
      x = moved;
      radius *= way[i + 7];
    } else {
      const length = Math.sqrt(x * x + y * y);
      const angle = a * length + b * x + c * y;
      const cos = Math.cos(angle);
      const sin = Math.sin(angle);
      radius *= 1 + (length + radius) * way[i + 7];
      const moved = x * cos + y * sin;
      y = y * cos - x * sin;
      x = moved;
    }
  }
  const length = Math.sqrt(x * x + y * y);
  return [length - radius, length + radius];
}

/** Leaf units from each object's origin beyond which it makes no difference, Infinity where it always may. */
export function reaches(rows, joins, { slack, farther, farthest }) {
  return Float64Array.from(joins, ({ always, seen: { hidden, total, widest } }, i) => (
    always || hidden ? Infinity
      : 1 + slack + skinReach(rows[i]) + Math.min(farther * total, farthest * widest) / rows[i].scale
  ));
}

/** How much farther out than its leaf an object reaches, leaf units, but for a displacement. */
export const skinReach = ({ skin = [0, 0, 0] }) => skin[0] + skin[1] + skin[2];

/**
 * Which objects each tile of a frame meets, in stream order.
 * @param reach - of the rows, as `reaches` has them
 * @param inner - radii of discs of the rows' leaves in which they hide what was before, 0 for none
 * @param joins - of the rows, as `joinsOf` has them
 * @returns {{starts: Int32Array, objects: Int32Array, tile, across, down}} starts: (tiles + 1), tiles from
 *     the lower left corner; they are larger than `tile` where the lists would be too long
 */
export function tileLists(rows, joins, reach, inner, { width, height, tile, px }) {
  const [across, down] = [Math.ceil(width / tile), Math.ceil(height / tile)];
  const side = tile * px;
  const around = side * Math.SQRT1_2 * (1 + 1e-6);
  const [left, low] = [-0.5 * width * px, -0.5 * height * px];
  const drawn = new Uint8Array(across * down);
  const hidden = new Int32Array(across * down); // up to which pair all is hidden
  const [tiles, objects] = [[], []];
  const whole = 2 ** Math.ceil(Math.log2(Math.max(across, down)));
  for (let object = 0; object < rows.length; object++) {
    const { steps } = rows[object], { draws } = joins[object];
    let [x0, x1, y0, y1] = [0, across - 1, 0, down - 1];
    if (reach[object] < Infinity) {
      const { centre: [x, y], half: [w, h] } = discInWorld(steps, reach[object]);
      // what is not a number is everywhere
      [x0, x1] = [(x - w - left) / side, (x + w - left) / side].map(Math.floor);
      [y0, y1] = [(y - h - low) / side, (y + h - low) / side].map(Math.floor);
      [x0, y0] = [x0 > 0 ? x0 : 0, y0 > 0 ? y0 : 0];
      [x1, y1] = [x1 < across ? x1 : across - 1, y1 < down ? y1 : down - 1];
    }
    const way = flattened(steps);
    /** Squares of tiles that may be in reach are looked at in quarters. */
    const look = (i, j, size, hides) => {
      if (i > x1 || j > y1 || i + size <= x0 || j + size <= y0) return;
      const half = 0.5 * size;
      if (reach[object] < Infinity && !hides) {
        const [least, most] = extent(way, left + (i + half) * side, low + (j + half) * side, size * around);
        if (least > reach[object]) return;
        hides = most < inner[object];
      }
      if (size > 1) {
        for (let k = 0; k < 4; k++) look(i + half * (k & 1), j + half * (k >> 1), half, hides);
        return;
      }
      const at = j * across + i;
      if (!draws && !drawn[at]) return;
      if (hides) hidden[at] = tiles.length;
      drawn[at] = 1;
      tiles.push(at);
      objects.push(object);
    };
    look(0, 0, whole, false);
    if (tiles.length > MOST_PAIRS && whole > 1) {
      return tileLists(rows, joins, reach, inner, { width, height, tile: 2 * tile, px });
    }
  }
  const starts = new Int32Array(across * down + 1);
  tiles.forEach((at, pair) => { starts[at + 1] += pair >= hidden[at]; });
  for (let at = 0; at < across * down; at++) starts[at + 1] += starts[at];
  const next = starts.slice();
  const sorted = new Int32Array(starts[across * down]);
  tiles.forEach((at, pair) => { if (pair >= hidden[at]) sorted[next[at]++] = objects[pair]; });
  return { starts, objects: sorted, tile, across, down };
}
