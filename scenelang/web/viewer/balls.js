// Where solids may be met: a ball around each row, and of directions from a point which balls lie there.

import { IDENTITY, invertedMap, stretchesOf } from "./maps.js";
import { skinReach } from "./ways.js";

const SMALL_SIDE = 1.7; // of a leaf's box that is worth the asking
const FREE_BOX = [[-1e30, -1e30, -1e30], [1e30, 1e30, 1e30]];

/** How much longer a map makes a step at most. */
const longest = (map) => stretchesOf(map, 3)[1];

/** How much longer a turn makes a small step at most, in the ball of a radius about the origin. */
function stretched([kind, ...strengths], radius) {
  const m = radius * strengths.reduce((sum, strength) => sum + Math.abs(strength), 0);
  const c = kind === "turn" ? radius * Math.abs(strengths[1]) : 0;
  return (m + Math.sqrt(m * m + 4 + 4 * c)) / 2;
}

/**
 * Of each row where rays may meet it: `outer`, the map into the space in which it lies in a ball about the
 * origin; `rest`, the steps behind that; its `radius` in leaf units and the `ball`'s there; the `rate` at
 * which its world distance changes at most per step of 1 there; a ball (`centre`, `extent`) of the world around it,
 * and a `box` [low, high] behind `outer`.
 * @param {object[]} rows
 * @param {object[]} joins - of `joinsOf`
 * @param {{slack: number}} network - of a view
 * @param {(row: object) => number[][]} boxOf - the box of a row's leaf
 */
export function solidBalls(rows, joins, network, boxOf) {
  const more = (row) => Math.abs(row.amount) + skinReach(row); // how much farther out than its leaf it reaches
  const deepest = rows.reduce((most, row) => Math.max(most, row.scale * (1 + Math.max(more(row), 0))), 0);
  return rows.map((row, i) => {
    const { widest, count, hidden } = joins[i].seen;
    const blends = widest * (1 + count / 4) + (hidden ? deepest : 0);
    const loose = network.slack + network.loose * Math.abs(skinReach(row));
    const radius = 1 + loose + more(row) + blends / row.scale;
    const mapped = row.steps.length > 0 && row.steps[0][0] === "map";
    const outer = mapped ? row.steps[0].slice(1) : IDENTITY, rest = row.steps.slice(mapped ? 1 : 0);
    let ball = radius, growth = 1 + Math.abs(row.amount * row.frequency);
    for (const step of rest.slice().reverse()) {
      if (step[0] === "map") {
        const map = step.slice(1), back = invertedMap(map);
        growth *= longest(map);
        ball = longest(back) * ball + Math.hypot(back[3], back[7], back[11]);
      } else growth *= stretched(step, ball);
    }
    const back = invertedMap(outer), centre = [back[3], back[7], back[11]], extent = longest(back) * ball;
    const [low, high] = boxOf(row), slim = high.some((side, i) => side - low[i] <= SMALL_SIDE);
    const wider = [low.map((v) => v - Math.max(radius - 1, 0)), high.map((v) => v + Math.max(radius - 1, 0))];
    const box = slim && !rest.length ? wider : FREE_BOX;
    return { outer, rest, radius, ball, rate: row.scale * growth, centre, extent, box };
  });
}

/** Between which values of across / ahead directions to a ball lie, of those ahead; null where none does. */
function bearings(across, ahead, radius) {
  const far = Math.hypot(across, ahead);
  if (far <= radius) return [-Infinity, Infinity];
  const middle = Math.atan2(across, ahead), half = Math.asin(radius / far) + 1e-6;
  const [low, high] = [middle - half, middle + half], side = Math.PI / 2 - 1e-6;
  if (low >= side || high <= -side) return null;
  return [low <= -side ? -Infinity : Math.tan(low), high >= side ? Infinity : Math.tan(high)];
}

const inner = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/**
 * Cells of directions from a point, as a picture sees them.
 * @param {number[]} from - the point
 * @param {number[][]} axes - unit vectors forward, right and up
 * @param {number[]} scale, middle - a direction's cell is right / forward * scale + middle, and likewise up
 * @param {number[]} counts - cells across and up
 * @param {number} more - by which balls are larger
 */
export function cellsOf(from, axes, scale, middle, counts, more = 0) {
  return {
    count: counts[0] * counts[1],
    /** Calls of the numbers of all cells where a ball may be seen. */
    of(centre, extent, call) {
      const to = centre.map((v, i) => v - from[i]), ahead = inner(to, axes[0]), ranges = [];
      for (const i of [0, 1]) {
        const range = bearings(inner(to, axes[1 + i]), ahead, (extent + more) * (1 + 1e-5));
        if (!range) return;
        const [low, high] = range.map((v) => Math.floor(v * scale[i] + middle[i]));
        ranges.push([Math.max(low, 0), Math.min(high, counts[i] - 1)]);
      }
      const [[left, right], [down, up]] = ranges;
      for (let y = down; y <= up; y++) for (let x = left; x <= right; x++) call(y * counts[0] + x);
    },
  };
}

/** The six sides of a cube around a lamp, each of side x side cells, two for each axis. */
export function cubeOf(from, side, radius) {
  const unit = (i) => [0, 1, 2].map((j) => Number(i % 3 === j));
  return [0, 1, 2, 3, 4, 5].map((face) => {
    const axis = face >> 1, forward = unit(axis).map((v) => (face & 1 ? -v : v));
    const half = side / 2;
    return cellsOf(from, [forward, unit(axis + 1), unit(axis + 2)], [half, half], [half, half], [side, side], radius);
  });
}

/**
 * Lists of the rows whose balls may be met in each cell, the last row first: of each cell where its list
 * begins and how long it is, then the lists. The first cell has all rows.
 * @param {object[]} joins - of the rows, of `joinsOf`
 * @param {object[]} balls - of `solidBalls`
 * @param {object[]} groups - of cells
 * @returns {{data: Int32Array, longest: number}} and how long the longest list but the first is
 */
export function listsOf(joins, balls, groups) {
  const count = 1 + groups.reduce((sum, group) => sum + group.count, 0);
  const lists = Array.from({ length: count }, () => []), closed = new Uint8Array(count);
  let holding = []; // rows in groups that have to be where a row is, as it ends outside of them
  for (let i = joins.length - 1; i >= 0; i--) {
    const { always, around } = joins[i], held = always && !around ? new Uint8Array(count) : null;
    lists[0].push(i);
    holding = holding.filter(({ from }) => from <= i);
    if (always && around) {
      holding.push({ at: i, from: (joins[i].first ? around.around?.from : around.from) ?? 0 });
      continue;
    }
    let first = 1;
    for (const group of groups) {
      group.of(balls[i].centre, balls[i].extent, (at) => {
        const list = lists[first + at];
        if (!closed[first + at]) {
          for (const { at: row } of holding) if (!(list.at(-1) <= row)) list.push(row);
          list.push(i);
        }
        if (held) held[first + at] = 1;
      });
      first += group.count;
    }
    // outside its ball an intersection leaves nothing of what came before
    if (held) for (let at = 1; at < count; at++) if (!held[at]) closed[at] = 1;
  }
  const data = new Int32Array(2 * count + lists.reduce((sum, list) => sum + list.length, 0));
  let begin = 2 * count, longestList = 0;
  lists.forEach((list, at) => {
    data.set([begin, list.length], 2 * at);
    data.set(list, begin);
    begin += list.length;
    if (at) longestList = Math.max(longestList, list.length);
  });
  return { data, longest: longestList };
}
