// Distances of elements: pyramids of grids, unfolded as scenelang/assets/pyramid.py does.

/** Shares of four neighbours, of which the second and third lie around a place. */
const [BEGIN, MIDDLE, END] = [[5, 15, -5, 1], [-1, 9, 9, -1], [1, -5, 15, 5]];

/** Values between nodes along one of the axes, by the cubic through four: (outer, n, inner) to 2 n - 1. */
function betweenAlong(grid, n, inner) {
  const outer = grid.length / (n * inner);
  const found = new Float32Array(outer * (2 * n - 1) * inner);
  for (let o = 0; o < outer; o++) {
    const [from, to] = [o * n * inner, o * (2 * n - 1) * inner];
    for (let k = 0; k < n; k++) {
      found.set(grid.subarray(from + k * inner, from + (k + 1) * inner), to + 2 * k * inner);
    }
    for (let k = 0; k < n - 1; k++) {
      const [p, q, r, s] = n < 4 ? [0, 8, 8, 0] : k === 0 ? BEGIN : k === n - 2 ? END : MIDDLE;
      const a = from + (n < 4 ? k - 1 : Math.min(Math.max(k - 1, 0), n - 4)) * inner;
      const [b, c, d] = n < 4 ? [a + inner, a + 2 * inner, a + inner] : [1, 2, 3].map((i) => a + i * inner);
      const at = to + (2 * k + 1) * inner;
      const first = n < 4 ? b : a; // so that nothing outside is read
      for (let i = 0; i < inner; i++) {
        found[at + i] = (p * grid[first + i] + q * grid[b + i] + r * grid[c + i] + s * grid[d + i]) / 16;
      }
    }
  }
  return found;
}

function between(grid, n, dimension) {
  let found = grid;
  for (let axis = dimension - 1; axis >= 0; axis--) {
    found = betweenAlong(found, n, (2 * n - 1) ** (dimension - 1 - axis));
  }
  return found;
}

/**
 * The finest grid of a shape of kind "grid": distances at `finest` nodes along each axis of [-1, 1]^d, the
 * last axis first to change, a Float32Array.
 */
export function distances({ dimension, sides, finest, steps, codec }) {
  let [grid, from] = [null, 0];
  for (const side of sides) {
    const count = side ** dimension;
    grid = grid ? between(grid, (side + 1) / 2, dimension) : new Float32Array(count);
    const near = Math.fround(2 / (side - 1) / codec.fine);
    const far = Math.fround(codec.far + codec.first / side);
    const last = side === sides[sides.length - 1]; // whose steps beside the surface are finer
    const band = last ? Math.fround((2 * codec.near) / (side - 1)) : 0;
    const finer = Math.fround(2 / (side - 1) / codec.finer);
    for (let at = 0; at < count; at++) {
      const away = Math.abs(grid[at]);
      const found = grid[at] + steps[from + at] * (away < band ? finer : Math.max(near, away / far));
      grid[at] = Math.min(Math.max(found, -codec.farthest), codec.farthest);
    }
    from += count;
  }
  const last = sides[sides.length - 1];
  return finest > last ? between(grid, last, dimension) : grid;
}

/** Values linearly between nodes along one of the axes: (outer, n, inner) to 2 n - 1. */
function halfway(grid, n, inner) {
  const wide = 2 * n - 1, found = new Float32Array((grid.length / n) * wide);
  for (let at = 0; at < found.length; at++) {
    const [o, k] = [Math.floor(at / inner / wide), Math.floor(at / inner) % wide];
    const from = (o * n + (k >> 1)) * inner + (at % inner);
    found[at] = k & 1 ? (grid[from] + grid[from + inner]) / 2 : grid[from];
  }
  return found;
}

/**
 * The colours of a paint of kind "colours", as in scenelang/assets/pyramid.py: linear, whole numbers up to `unit`,
 * at n^3 nodes, z first to change, a Uint16Array of three a node.
 */
export function spaceColours({ sides, steps, fineness }, unit) {
  let [grid, from] = [null, 0];
  for (const side of sides) {
    const count = side ** 3;
    if (grid) for (let axis = 2; axis >= 0; axis--) grid = halfway(grid, (side + 1) / 2, side ** (2 - axis));
    grid ??= new Float32Array(3 * count);
    for (let at = 0; at < 3 * count; at++) grid[at] += (steps[from + at] * (at < count ? 1 : 2)) / fineness;
    from += 3 * count;
  }
  const count = grid.length / 3, found = new Uint16Array(grid.length);
  const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  for (let at = 0; at < count; at++) { // from YCoCg
    const y = grid[at], orange = grid[count + at], green = grid[2 * count + at], rest = y - green / 2;
    [rest + orange / 2, y + green / 2, rest - orange / 2].forEach((v, i) => {
      found[3 * at + i] = Math.round(unit * linear(Math.min(1, Math.max(0, v))));
    });
  }
  return found;
}
