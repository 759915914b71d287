// Conservative boxes around leaves, and streams of rows with what boxes prove: `spaces.py`, `solid.py`
// and `stream.py` of `scenelang/graph` have the proofs. A box is [xmin, xmax, ymin, ymax, zmin, zmax].

import { IDENTITY, composedMap, mappedPoint, stretchesOf } from "./maps.js";
import { mapOfChain } from "./chain.js";

const BOX_ROUNDING = 1e-9;
const EVERYWHERE = [-Infinity, Infinity, -Infinity, Infinity, -Infinity, Infinity];
const FULL_TURN = 2 * Math.PI;
export const USUAL_BLEND = 0.15; // its width, unless said
const MOST_CUTS = 64;

function grown(box) {
  const more = BOX_ROUNDING * (1 + Math.max(...box.map(Math.abs)));
  const made = box.map((number, at) => (at % 2 ? number + more : number - more));
  return made.every((number) => Number.isFinite(number)) ? made : EVERYWHERE;
}

/** Points about the origin of the plane: radii near to far, angles first to last. */
function furthest({ near, far, first, last }, x, y) {
  const length = Math.hypot(x, y);
  if (length === 0) return 0;
  if (!(last - first < FULL_TURN)) return length * far;
  const ahead = (((Math.atan2(y, x) - first) % FULL_TURN) + FULL_TURN) % FULL_TURN;
  if (ahead <= last - first) return length * far;
  const c = Math.max(Math.cos(ahead), Math.cos(ahead - (last - first)));
  return length * c * (c >= 0 ? far : near);
}

function sectorTurned(sector, { twirl, x, y }) {
  const { near, far, first, last } = sector;
  if (!(last - first < FULL_TURN)) return sector;
  const [least, most] = [twirl * near, twirl * far].sort((a, b) => a - b);
  const bent = Math.hypot(x, y) * far;
  let [low, high] = [least - bent, most + bent];
  if (bent > 0) {
    const rough = { near, far, first: first + low, last: last + high };
    [low, high] = [least - furthest(rough, -x, -y), most + furthest(rough, x, y)];
  }
  return { near, far, first: first + low, last: last + high };
}

function sectorMapped({ near, far }, rows) {
  const [x, y] = [rows[3], rows[7]];
  const [smallest, largest] = stretchesOf(rows, 2);
  const [away, radius] = [Math.hypot(x, y), largest * far];
  if (away === 0) return { near: smallest * near, far: radius, first: 0, last: FULL_TURN };
  if (!(away > radius)) return { near: 0, far: away + radius, first: 0, last: FULL_TURN };
  const [middle, half] = [Math.atan2(y, x), Math.asin(radius / away)];
  return { near: away - radius, far: away + radius, first: middle - half, last: middle + half };
}

function flatBox({ steps, corners }, reach) {
  let sector = { near: 0, far: 1 + reach, first: -Math.PI, last: Math.PI };
  let pending = IDENTITY;
  const turns = steps.some((step) => !step.rows);
  for (const step of steps) {
    if (step.rows) {
      pending = composedMap(step.rows, pending);
      continue;
    }
    if (pending !== IDENTITY) sector = sectorMapped(sector, pending);
    pending = IDENTITY;
    sector = sectorTurned(sector, step);
  }
  const sides = [0, 4].flatMap((row) => {
    const [a, b, middle] = [pending[row], pending[row + 1], pending[row + 3]];
    if (turns) return [middle - furthest(sector, -a, -b), middle + furthest(sector, a, b)];
    const more = reach * Math.hypot(a, b);
    const ends = corners ? corners.map(([p, q]) => a * p + b * q) : [-Math.hypot(a, b), Math.hypot(a, b)];
    return [middle + Math.min(...ends) - more, middle + Math.max(...ends) + more];
  });
  return grown([...sides, 0, 0]);
}

function solidBox({ steps }, reach) {
  let [centre, radius, pending] = [[0, 0, 0], 1 + reach, IDENTITY];
  for (const step of steps) {
    if (step.amount !== undefined) {
      radius += Math.abs(step.amount);
    } else if (step.rows) {
      pending = composedMap(step.rows, pending);
    } else {
      const moved = mappedPoint(pending, centre);
      radius = radius * stretchesOf(pending, 3)[1] + Math.hypot(...moved);
      [centre, pending] = [[0, 0, 0], IDENTITY];
    }
  }
  const middle = mappedPoint(pending, centre);
  return grown(middle.flatMap((at, row) => {
    const half = radius * Math.hypot(...pending.slice(4 * row, 4 * row + 3));
    return [at - half, at + half];
  }));
}

/** A box around all points whose world distance to a leaf is below a level. */
function leafBox(leaf, level) {
  const { dimension } = leaf.form;
  const stretch = level > 0 ? stretchesOf(mapOfChain(leaf.steps), dimension)[0] : 1;
  if (stretch === 0) return EVERYWHERE;
  return (dimension === 2 ? flatBox : solidBox)(leaf, level / stretch);
}

const overlap = (a, b) =>
  a[0] <= b[1] && b[0] <= a[1] && a[2] <= b[3] && b[2] <= a[3] && a[4] <= b[5] && b[4] <= a[5];

/** Boxes, and one around all of them. */
class Boxes {
  constructor() {
    this.list = [];
    this.bounds = [Infinity, -Infinity, Infinity, -Infinity, Infinity, -Infinity];
  }

  add(box) {
    this.list.push(box);
    this.bounds = this.bounds.map((side, at) => (at % 2 ? Math.max(side, box[at]) : Math.min(side, box[at])));
  }

  /** Keep only what lies within a box. */
  clip(box) {
    const inner = (side, at) => (at % 2 ? Math.min(side, box[at]) : Math.max(side, box[at]));
    const shared = this.bounds.map(inner);
    const meets = this.list.length > 0 && overlap(this.bounds, box);
    this.list = meets ? [shared] : [];
    this.bounds = shared;
  }

  touches(box) {
    if (this.list.length === 0 || !overlap(this.bounds, box)) return false;
    return this.list.some((other) => overlap(other, box));
  }

  meets(other) {
    if (this.list.length === 0 || other.list.length === 0) return false;
    if (!overlap(this.bounds, other.bounds)) return false;
    const [few, many] = this.list.length <= other.list.length ? [this, other] : [other, this];
    return few.list.some((box) => many.touches(box));
  }
}

/** Rows {op, leaf, k} in order; the first one is a union. */
export class Stream {
  constructor() {
    Object.assign(this, { rows: [], cuts: [], smooths: 0, slack: 0, clipped: false, grids: new Map() });
  }

  push(op, leaf, k) {
    const row = { op: this.rows.length > 0 ? op : "union", leaf, k };
    this.rows.push(row);
    if (row.op === "subtract") this.cuts.push(leaf);
    if (row.op === "intersect") this.clipped = true;
    if (row.op === "smooth") {
      this.smooths += k;
      this.slack = Math.max(this.slack, k);
    }
    for (const [level, boxes] of this.grids) indexRow(boxes, level, row);
  }

  /** Boxes around all points where a joined leaf is nearer than a level. */
  grid(level) {
    if (!this.grids.has(level)) {
      const boxes = new Boxes();
      for (const row of this.rows) indexRow(boxes, level, row);
      this.grids.set(level, boxes);
    }
    return this.grids.get(level);
  }

  /** Join a composite by union, after this stream or before it; false where neither is proved. */
  attach(other) {
    if (this.rows.length > 0 && this.grid(this.slack).meets(other.grid(0))) return false;
    if (this.rows.length === 1 && this.swaps(other)) this.append(other, true);
    else if (this.rows.length === 0 || this.mayFollow(other)) this.append(other, false);
    else if (this.swaps(other)) this.append(other, true);
    else return false;
    return true;
  }

  mayFollow(other) {
    if (other.clipped) return false;
    const near = this.grid(this.slack);
    if (other.cuts.some((leaf) => near.touches(leafBox(leaf, 0)))) return false;
    if (other.smooths === 0) return true;
    let margin = USUAL_BLEND;
    while (margin < other.smooths) margin *= 2; // few levels, so that their boxes are shared
    return !this.grid(margin + this.slack).meets(other.grid(margin));
  }

  swaps(other) {
    if (this.smooths > 0 || other.smooths > 0 || this.clipped || this.cuts.length > MOST_CUTS) return false;
    return this.cuts.every((leaf) => !other.grid(0).touches(leafBox(leaf, 0)));
  }

  append(other, before) {
    for (const [level, boxes] of this.grids) {
      for (const box of other.grid(level).list) boxes.add(box);
    }
    if (before) this.rows.unshift(...other.rows);
    else for (const row of other.rows) this.rows.push(row);
    for (const leaf of other.cuts) this.cuts.push(leaf);
    this.smooths += other.smooths;
    this.slack = Math.max(this.slack, other.slack);
    this.clipped ||= other.clipped;
  }
}

function indexRow(boxes, level, { op, leaf }) {
  if (op === "intersect") boxes.clip(leafBox(leaf, level));
  else if (op !== "subtract") boxes.add(leafBox(leaf, level));
}
