// Chains of steps from a leaf into the world, nearest the leaf first, and their normal form: deformations as
// near to the leaf, and as few steps, as may be. A step is {rows} of a map, {twirl, x, y} of a turn about z
// by twirl |p| + x p.x + y p.y, {twist} of one about y by twist p.y, {amount, frequency} of a displacement, {grow} and
// {shell} of these.

import { refuse } from "./values.js";
import { IDENTITY, composedMap, idleMap, invertedMap, mild, stretchesOf, usableMap } from "./maps.js";

const ALIKE = 1e-12;
const isWarp = (step) => step.twirl !== undefined;
const isTurn = (step) => isWarp(step) || step.twist !== undefined;

function idleStep(step) {
  if (step.rows) return idleMap(step.rows);
  if (isWarp(step)) return step.twirl === 0 && step.x === 0 && step.y === 0;
  if (step.grow !== undefined || step.shell !== undefined) return (step.grow ?? step.shell) === 0;
  return step.twist === undefined ? step.amount === 0 || step.frequency === 0 : step.twist === 0;
}

/** Whether a map of the plane is a similarity about the origin: its scale, and -1 for a reflection. */
function similarity(rows) {
  const [a, b, , x, c, d, , y] = rows;
  const s = Math.sqrt(Math.abs(a * d - b * c));
  const near = ALIKE * s;
  if (Math.abs(x) > near || Math.abs(y) > near) return null;
  if (Math.abs(a - d) <= near && Math.abs(b + c) <= near) return [s, 1];
  return Math.abs(a + d) <= near && Math.abs(b - c) <= near ? [s, -1] : null;
}

function flatBefore(rows, turn) {
  const alike = similarity(rows);
  if (alike === null) return null;
  const [scale, sign] = alike;
  return {
    twirl: sign * scale * turn.twirl,
    x: sign * (rows[0] * turn.x + rows[4] * turn.y),
    y: sign * (rows[1] * turn.x + rows[5] * turn.y),
  };
}

/** `scenelang/compiler/spaces.py` has the proof. */
function solidBefore(rows, turn) {
  const [j, k] = isWarp(turn) ? [1, 2] : [2, 1];
  const [a, b, c, d, along] = [rows[0], rows[j], rows[4 * j], rows[5 * j], rows[5 * k]];
  const scale = Math.sqrt(Math.abs(a * d - b * c));
  const near = ALIKE * scale;
  const sign = a * d > b * c ? 1 : -1;
  const alike = [a - sign * d, b + sign * c];
  const apart = [rows[3], rows[4 * j + 3], rows[k], rows[4 * k], rows[4 * j + k], rows[4 * k + j]];
  if ([...alike, ...apart].some((number) => Math.abs(number) > near)) return null;
  const shift = Math.abs(rows[4 * k + 3]) > near;
  if (!isWarp(turn)) return shift ? null : { twist: sign * along * turn.twist };
  if (turn.twirl !== 0 && (shift || Math.abs(Math.abs(along) - scale) > near)) return null;
  if ((turn.x !== 0 && Math.abs(b) > near) || turn.y !== 0) return null;
  return { twirl: sign * scale * turn.twirl, x: sign * a * turn.x, y: 0 };
}

/** The turn that does before a map what a turn does after it; null where none does. */
function turnBefore(rows, turn, dimension) {
  return dimension === 2 ? flatBefore(rows, turn) : solidBefore(rows, turn);
}

/** Two turns as one, null where they are two. */
function turnsJoined(inner, outer) {
  if (inner.twist !== undefined && outer.twist !== undefined) return { twist: inner.twist + outer.twist };
  if (!isWarp(inner) || !isWarp(outer) || inner.x !== 0 || inner.y !== 0) return null;
  return { twirl: inner.twirl + outer.twirl, x: outer.x, y: outer.y };
}

function appendMap(out, rows) {
  const made = out.at(-1)?.rows ? composedMap(rows, out.pop().rows) : rows;
  if (!idleMap(made)) out.push({ rows: made });
}

function appendTurn(out, given, dimension) {
  const before = out.at(-1)?.rows ? turnBefore(out.at(-1).rows, given, dimension) : null;
  const held = before === null ? null : out.pop();
  let turn = before ?? given;
  const both = out.length > 0 ? turnsJoined(out.at(-1), turn) : null;
  if (both !== null) {
    out.pop();
    turn = both;
  }
  if (!idleStep(turn)) out.push(turn);
  if (held !== null) appendMap(out, held.rows);
}

/** The same chain with neighbouring maps composed and without what does nothing. */
export function mergedChain(steps) {
  const out = [];
  for (const step of steps) {
    if (step.rows) appendMap(out, step.rows);
    else if (!idleStep(step)) out.push(step);
  }
  return out;
}

/** The chain in its normal form. */
export function normalChain(steps, dimension) {
  if (!steps.some(isTurn)) return steps;
  const out = [];
  for (const step of steps) {
    if (step.rows) appendMap(out, step.rows);
    else if (isTurn(step)) appendTurn(out, step, dimension);
    else out.push(step);
  }
  return out;
}

/** All maps of a chain composedMap, deformations left out. */
function mapOfChain(steps) {
  const maps = steps.filter((step) => step.rows);
  return maps.length === 0 ? IDENTITY : maps.reduce((inner, step) => composedMap(step.rows, inner), IDENTITY);
}

/** Whether a step changes the leaf's own distance. */
export const isOwn = (step) => ["amount", "grow", "shell"].some((name) => step[name] !== undefined);

/** What a chain makes of its leaf's distance d: [first, wall, last, late], as `Skins` in frames.py has them. */
export function skinOfChain(steps) {
  const shell = steps.findIndex((step) => step.shell !== undefined);
  const grow = steps.findIndex((step) => step.grow !== undefined);
  const bump = steps.findIndex((step) => step.amount !== undefined);
  const r = grow < 0 ? 0 : steps[grow].grow, behind = shell >= 0 && grow > shell;
  const wall = shell < 0 ? 0 : steps[shell].shell / 2;
  return [behind ? 0 : r, wall, behind ? r : 0, Number(shell >= 0 && bump > shell)];
}

/** How many places of a model's vector a run of turns takes. */
function taken(turns, dimension) {
  if (dimension === 2) return turns.length;
  let count = 0;
  let open = false; // whether the last place holds a twist alone, which the warp after it may join
  for (const turn of turns) {
    if (isWarp(turn) && open) {
      open = false;
    } else {
      count += 1;
      open = !isWarp(turn);
    }
  }
  return count;
}

/** Throws NotLive where a model's vector has no room for a chain in its normal form, or no map an inverse. */
export function checkChain(steps, form) {
  const { dimension, turns: [inner, outer] } = form;
  const runs = [[]];
  const maps = [];
  for (const step of steps) {
    if (isTurn(step)) runs.at(-1).push(step);
    if (step.rows) {
      maps.push(step.rows);
      runs.push([]);
    }
  }
  const roomy = !steps.some(isTurn) || fits(runs, maps, inner, outer, dimension);
  if (!roomy) refuse("more deformations than the model holds");
  if (maps.length > 1) maps.push(mapOfChain(steps));
  if (!maps.every((rows) => usableMap(rows, dimension))) refuse("transforms that compose to a singular one");
  const tame = steps.every((step) => step.rows || mild(...Object.values(step)));
  if (!tame) refuse("deformations beyond float32");
}

function fits([first, second, third], maps, inner, outer, dimension) {
  if (maps.length === 0 || (maps.length === 1 && second.length === 0)) {
    return taken(first, dimension) <= inner + outer;
  }
  if (maps.length > 2 || (maps.length === 2 && third.length > 0)) return false;
  const [before, after] = [[...first], [...second]];
  while (taken(before, dimension) > inner) {
    const turn = turnBefore(invertedMap(maps[0]), before.at(-1), dimension);
    if (turn === null) return false;
    after.unshift(turn);
    before.pop();
  }
  return taken(after, dimension) <= outer;
}

/** World distance per leaf distance. */
export function scaleOfChain(steps, dimension) {
  return stretchesOf(mapOfChain(steps), dimension)[0];
}
