// From a scene's tree to rows: transforms go to the leaves, empty nodes vanish, booleans become one stream.
//
// A leaf of the tree is {shape, steps, worn}, a fold {links: [{op, k, node}], steps, worn}; steps are nearest
// the leaf first, and k is the width of a blend, 0 for none. See `scenelang/compiler/lower.py` and
// `scenelang/compiler/rewrites.py`.

import { Wearing, refuse } from "./values.js";
import { flatMap, invertedMap, usableMap } from "./maps.js";
import { checkChain, isOwn, mergedChain, normalChain, scaleOfChain, skinOfChain } from "./chain.js";
import { lookOf } from "./looks.js";
import { BEGINS, ENDS } from "./groups.js";

export const MOST_OBJECTS = 20000;
export const USUAL_BLEND = 0.15; // the width of a `smooth`, unless said
const MOST_OPEN = 15; // groups within each other
const MOST_ROW_STEPS = 24; // of a row
const TOKENS = ["union", "smooth", "subtract", "intersect"];

/** Rows of a scene's top-level links. */
export function rowsOf(links, form) {
  const state = { form, objects: 0, looks: new Map(), plain: new Wearing(form.plain, -1, []) };
  const root = lowered({ links, steps: [], worn: null }, [], null, state);
  const rows = [];
  if (root !== null) putRows(root.links ? flatLinks(root.links) : [{ op: "union", k: 0, node: root }], 0, rows);
  return rows.map((row) => rowData(row, form));
}

/** A node with all its steps in the world, and looks; null where it is empty. */
function lowered(node, outward, around, state) {
  const steps = mergedChain([...ownSteps(node, state.form), ...outward]);
  const worn = node.worn ?? around;
  if (!node.links) return loweredLeaf(node, steps, worn, state);
  const links = [];
  node.links.forEach((link, at) => {
    const usual = link.k === (link.op === "smooth" ? USUAL_BLEND : 0);
    if (at > 0 && !usual && !state.form.blends) refuse("the model has one width of a blend");
    const child = lowered(link.node, steps, worn, state);
    if (child === null) {
      if (link.op === "intersect" && at > 0) links.length = 0;
    } else if (links.length > 0) {
      links.push({ op: link.op, k: link.k, node: child });
    } else if (at === 0 || link.op === "union" || link.op === "smooth") {
      links.push({ op: "union", k: 0, node: child });
    }
  });
  if (links.length === 0) return null;
  return links.length === 1 ? links[0].node : { links };
}

/** The steps of a node's own transforms, maps as its space has them. */
function ownSteps(node, { dimension }) {
  const own = new Set();
  return node.steps.map((step, at) => {
    if (isOwn(step)) {
      const name = Object.keys(step)[0];
      const late = own.has(name) || own.size < at || node.links;
      if (late) refuse("`grow`, `shell` or `displace` does not stand first in the block of an object");
      own.add(name);
    }
    if (!step.rows) return step;
    const rows = dimension === 2 ? flatMap(step.rows) : step.rows;
    if (rows === null) refuse("a transform leaves the plane");
    return usableMap(rows, dimension) ? { rows } : refuse("a transform flattens what it moves");
  });
}

function loweredLeaf(node, steps, worn, state) {
  const { form, looks } = state;
  state.objects += 1;
  if (state.objects > MOST_OBJECTS) refuse(`more than ${MOST_OBJECTS} objects`);
  let wears = worn ?? state.plain;
  if (node.there && wears.paint >= 0) { // in whose own units textures are
    wears = new Wearing(wears.lit, wears.paint, [...wears.ops, { rows: invertedMap(node.there) }]);
  }
  if (!looks.has(wears)) looks.set(wears, lookOf(wears, form));
  return {
    leaf: true,
    shape: node.shape,
    steps,
    look: looks.get(wears),
    number: state.objects,
    form,
  };
}

/** A leaf that no empty node has swallowed, with its steps in the normal form. */
function finishedLeaf(leaf) {
  leaf.steps = normalChain(leaf.steps, leaf.form.dimension);
  checkChain(leaf.steps, leaf.form);
  return leaf;
}

// ---------------------------------------------------------------- the boolean rule

/** The links of a fold with composite operands taken apart where that changes nothing. */
function flatLinks(links) {
  const flat = [];
  for (const { op, k, node } of links) {
    const inner = node.links ? flatLinks(node.links) : [];
    if (inner.length > 0 && flat.length === 0) {
      for (const link of inner) flat.push(link);
      continue;
    }
    const core = coreOf(op, k, inner);
    flat.push({ op, k, node: core > 1 ? { links: inner.slice(0, core) } : inner[0]?.node ?? node });
    for (const after of inner.slice(core)) {
      flat.push({ op: op === "intersect" ? after.op : op, k: 0, node: after.node });
    }
  }
  return flat;
}

/** How many of the first links of a composite operand have to stay together; 1: none. */
function coreOf(op, k, links) {
  if (k > 0) return links.length;
  const apart = op === "intersect" ? ["intersect", "subtract"] : ["union"];
  for (let at = links.length - 1; at > 0; at -= 1) {
    if (!apart.includes(links[at].op) || links[at].k > 0) return at + 1;
  }
  return 1;
}

/** Add the leaves of flat links to rows; `first` is how the group joins that the first of them begins. */
function putRows(links, depth, rows, first = null) {
  if (depth > MOST_OPEN) refuse(`operands of several objects in each other deeper than ${MOST_OPEN}`);
  links.forEach((link, at) => {
    if (link.node.links) return putRows(link.node.links, depth + 1, rows, link);
    const { op, k } = (at === 0 && first) || link;
    const token = TOKENS.indexOf(op) + (at === 0 && first ? BEGINS : 0);
    return rows.push({ token, k, leaf: finishedLeaf(link.node) });
  });
  if (first) rows.at(-1).token += 1 << ENDS;
}

// ---------------------------------------------------------------- rows

function rowData({ token, leaf, k }, { dimension }) {
  const { look, shape, number } = leaf;
  const skin = skinOfChain(leaf.steps);
  const bump = leaf.steps.find((step) => step.amount !== undefined);
  const steps = wayBack(leaf.steps, dimension);
  if (steps.length > MOST_ROW_STEPS) refuse(`more than ${MOST_ROW_STEPS} steps from the world to an object`);
  return {
    token,
    shape,
    material: look.material,
    steps,
    scale: scaleOfChain(leaf.steps, dimension),
    colour: look.colour,
    opacity: look.opacity,
    glow: look.glow?.some(Boolean) ? look.glow : undefined,
    density: look.density,
    paint: look.paint,
    place: look.place,
    tilt: look.tilt,
    paintSteps: look.paintSteps,
    stops: look.stops,
    amount: bump?.amount ?? 0,
    frequency: bump?.frequency ?? 0,
    skin,
    blend: k,
    object: number,
  };
}

/** Steps from the world to the leaf, outermost first. */
function wayBack(steps, dimension) {
  const found = [];
  for (const step of steps.slice().reverse()) {
    if (step.rows) {
      const [a, b, c, x, d, e, f, y, ...more] = invertedMap(step.rows);
      found.push(dimension === 2 ? ["map", a, b, x, d, e, y] : ["map", a, b, c, x, d, e, f, y, ...more]);
    } else if (step.twist !== undefined) {
      found.push(["twist", step.twist]);
    } else if (step.twirl !== undefined) {
      found.push(dimension === 2 ? ["turn", step.twirl, step.x, step.y] : ["turn", step.twirl, step.x]);
    }
  }
  return found;
}
