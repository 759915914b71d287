// From a scene's tree to rows: transforms go to the leaves, empty nodes vanish, booleans become one stream.
//
// A leaf of the tree is {shape, steps, worn}, a fold {links: [{op, k, node}], steps, worn}; steps are nearest
// the leaf first. See `scenelang/graph/lower.py`, `passes/drop.py`, `leaves.py` and `linearise.py`.

import { Wearing, refuse } from "./values.js";
import { flatMap, invertedMap, usableMap } from "./maps.js";
import { checkChain, mergedChain, normalChain, scaleOfChain } from "./chain.js";
import { lookOf } from "./looks.js";
import { Stream, USUAL_BLEND } from "./bounds.js";

export const MOST_OBJECTS = 20000;
const MOST_ROW_STEPS = 24; // of a row
const TOKENS = ["union", "smooth", "subtract", "intersect"];

/** Rows of a scene's top-level links. */
export function rowsOf(links, form) {
  const state = { form, objects: 0, looks: new Map(), plain: new Wearing(form.plain, -1, []) };
  const root = lowered({ links, steps: [], worn: null }, [], null, state);
  const stream = new Stream();
  if (root?.leaf) stream.push("union", finishedLeaf(root), USUAL_BLEND);
  else if (root !== null) takeLinks(root.links, stream);
  return stream.rows.map((row, at) => rowData(row, at, form));
}

/** A node with all its steps in the world, and looks; null where it is empty. */
function lowered(node, outward, around, state) {
  const steps = mergedChain([...ownSteps(node, state.form), ...outward]);
  const worn = node.worn ?? around;
  if (!node.links) return loweredLeaf(node, steps, worn, state);
  const links = [];
  node.links.forEach((link, at) => {
    if (at > 0 && link.k !== USUAL_BLEND && !state.form.blends) refuse("the model has one width of a blend");
    const child = lowered(link.node, steps, worn, state);
    if (child === null) {
      if (link.op === "intersect" && at > 0) links.length = 0;
    } else if (links.length > 0) {
      links.push({ op: link.op, k: link.k, node: child });
    } else if (at === 0 || link.op === "union" || link.op === "smooth") {
      links.push({ op: "union", k: USUAL_BLEND, node: child });
    }
  });
  if (links.length === 0) return null;
  return links.length === 1 ? links[0].node : { links };
}

/** The steps of a node's own transforms, maps as its space has them. */
function ownSteps(node, { dimension }) {
  return node.steps.map((step, at) => {
    const late = step.amount !== undefined && (at > 0 || node.links);
    if (late) refuse("`displace` does not stand first in the block of an object");
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
  const wears = worn ?? state.plain;
  if (!looks.has(wears)) looks.set(wears, lookOf(wears, form));
  return {
    leaf: true,
    shape: node.shape,
    steps,
    look: looks.get(wears),
    number: state.objects,
    form,
    corners: form.corners[node.shape],
  };
}

/** A leaf that no empty node has swallowed, with its steps in the normal form. */
function finishedLeaf(leaf) {
  leaf.steps = normalChain(leaf.steps, leaf.form.dimension);
  checkChain(leaf.steps, leaf.form);
  return leaf;
}

// ---------------------------------------------------------------- the boolean rule

/** Stream links one after the other; those of composites take part where the rule takes them apart. */
function takeLinks(links, stream) {
  const todo = [...links].reverse();
  let smooths = links.filter((link) => link.op === "smooth").length;
  const put = (more) => {
    for (let at = more.length - 1; at >= 0; at -= 1) todo.push(more[at]);
    smooths += more.filter((link) => link.op === "smooth").length;
  };
  while (todo.length > 0) {
    const { op, k, node } = todo.pop();
    if (op === "smooth") smooths -= 1;
    if (node.leaf) {
      stream.push(op, finishedLeaf(node), k);
    } else if (stream.rows.length === 0) {
      put(node.links);
    } else {
      const core = coreOf(op, node.links);
      const tail = node.links.slice(core);
      put(op === "intersect" ? tail : tail.map((link) => ({ op, k: USUAL_BLEND, node: link.node })));
      if (core === 1) put([{ op, k: USUAL_BLEND, node: node.links[0].node }]);
      else attachComposite(op, node.links.slice(0, core), stream, smooths);
    }
  }
}

/** How many of the first links of a composite operand have to stay together; 1: none. */
function coreOf(op, links) {
  if (op === "smooth") return links.length;
  const apart = op === "intersect" ? ["intersect", "subtract"] : ["union"];
  for (let at = links.length - 1; at > 0; at -= 1) {
    if (!apart.includes(links[at].op)) return at + 1;
  }
  return 1;
}

function attachComposite(op, links, stream, smooths) {
  if (op !== "union" || smooths > 0) refuse(`several objects as one operand of \`${op}\``);
  const inner = new Stream();
  takeLinks(links, inner);
  if (inner.rows.length === 1) stream.push("union", inner.rows[0].leaf, USUAL_BLEND);
  else if (!stream.attach(inner)) refuse("several objects in a union that may overlap those before them");
}

// ---------------------------------------------------------------- rows

function rowData({ op, leaf, k }, at, { dimension }) {
  const { look, shape, number } = leaf;
  const bump = leaf.steps.find((step) => step.amount !== undefined);
  const steps = wayBack(leaf.steps, dimension);
  if (steps.length > MOST_ROW_STEPS) refuse(`more than ${MOST_ROW_STEPS} steps from the world to an object`);
  return {
    token: at === 0 ? 0 : TOKENS.indexOf(op),
    shape,
    material: look.material,
    steps,
    scale: scaleOfChain(leaf.steps, dimension),
    colour: look.colour,
    paint: look.paint,
    place: look.place,
    paintSteps: look.paintSteps,
    amount: bump?.amount ?? 0,
    frequency: bump?.frequency ?? 0,
    blend: op === "smooth" ? k : USUAL_BLEND,
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
