// A scene's form, prepared once and run for any params and any frame. `scenelang/web/form.py` makes forms;
// what a statement means is in `scenelang/language/statements.py`.

import { Time, Angle, Vec, Wearing } from "./values.js";
import { bare, equal, kindOf, numbersOf, radians } from "./values.js";
import { refuse, sameUnit, sizeOf, truth, unitOf } from "./values.js";
import { entering, looping, prepared } from "./expressions.js";
import { lineOf } from "./letters.js";
import { outlineOf } from "./outlines.js";
import { MAPS } from "./maps.js";
import { MOST_OBJECTS, USUAL_BLEND, rowsOf } from "./graph.js";
import { isOwn } from "./chain.js";
import { sharesOf, stageFrom } from "./stage.js";
import { checkEye } from "./eye.js";

const MOST_WORK = 5e6; // passes of loops, calls, objects, transforms and numbers of vectors
const LETTERS_AS_NUMBER = 16;
const MOST_CALLS = 200; // within each other
const MOST_FRAMES = 1e6;

const preparedForms = new WeakMap();

/**
 * What is drawn of a scene.
 * @param form - of a view
 * @param {{params?: Object, frame?: number}} inputs - values of params by name: numbers, radians, seconds,
 *   booleans, strings, arrays; those left out have their defaults
 * @returns {{rows: Object[], samples: number, stage: ?Object, background: ?number[]}} as docs/architecture.md
 *   has them
 * @throws {NotLive} there is no picture of these; the message says why
 */
export function evaluateForm(form, inputs = {}) {
  try {
    if (!preparedForms.has(form)) preparedForms.set(form, new SceneRun(form));
    return preparedForms.get(form).picture(inputs);
  } catch (error) {
    if (error instanceof RangeError) refuse("the scene is nested too deep");
    throw error;
  }
}

/** A form's closures, and the state of the run that goes on. */
class SceneRun {
  constructor(form) {
    this.form = form;
    this.globals = [];
    this.definitions = [];
    this.body = form.body.map((stmt) => actionOf(stmt, this));
  }

  picture({ params = {}, frame = 0 }) {
    this.globals.fill(undefined);
    this.globals.length = this.form.slots;
    Object.assign(this, { params, frame, work: 0, calls: 0, objects: 0, settings: {}, lights: [] });
    this.animated = this.form.animates ? [] : [0, 0, 0, 1];
    const out = new Block();
    for (const act of this.body) act(undefined, out);
    const rows = rowsOf(out.links, this.form);
    const samples = samplesFrom(this.settings.samples);
    const made = { rows, samples, ...stageFrom(this.settings, this.lights, this.form) };
    if (made.stage !== null) checkEye(made, this.form);
    return made;
  }

  /** A fn or module by its place, prepared when it is first asked for. */
  definition(at) {
    if (this.definitions[at] === undefined) {
      const [size, defaults, body] = this.form.calls[at];
      const made = (this.definitions[at] = { size });
      made.defaults = defaults.map((value) => (value === null ? null : prepared(value, this)));
      // a module's body is a list of statements, each of which is a list
      const block = Array.isArray(body) && (body.length === 0 || Array.isArray(body[0]));
      made.body = block ? actionsOf(body, this) : prepared(body, this);
    }
    return this.definitions[at];
  }

  /** The operations of a material's block. */
  operations(block) {
    const act = actionsOf(block, this);
    return (slots) => {
      const out = new Block();
      act(slots, out);
      for (const word of PROPERTIES) {
        if (out.steps.filter((step) => step[0] === word).length > 1) refuse(`\`${word}\` is given twice`);
      }
      return out.steps;
    };
  }

  spend(work) {
    this.work += work;
    if (this.work > MOST_WORK) refuse("the scene takes too long for a page");
  }

  weigh(values) {
    for (const value of values) {
      if (value instanceof Vec) this.spend(value.count);
      if (typeof value === "string") this.spend(value.length / LETTERS_AS_NUMBER);
    }
  }

  enter() {
    this.spend(1);
    this.calls += 1;
    if (this.calls > MOST_CALLS) refuse(`calls nested deeper than ${MOST_CALLS}`);
  }

  leave() {
    this.calls -= 1;
  }
}

/**
 * What the statements of a block put into their node; `op` and `k` join the next child, `free` is that of a
 * polygon or a spline.
 */
class Block {
  constructor(op = "union", k = 0, free = false) {
    Object.assign(this, { op, k, free, links: [], steps: [], worn: null, moved: false });
  }

  add(node) {
    if (this.moved) refuse("a child after a transform");
    this.links.push({ op: this.op, k: this.k, node });
  }

  wear(worn) {
    if (this.worn !== null) refuse("a second material in one block");
    this.worn = worn;
  }
}

function actionOf([word, ...rest], run) {
  return STATEMENTS_OF_FORMS[word](rest, run);
}

/** A block of statements as one action. */
function actionsOf(block, run) {
  const acts = block.map((stmt) => actionOf(stmt, run));
  return (slots, out) => {
    for (const act of acts) act(slots, out);
  };
}

/** What may be left out: undefined then. */
function optionalValue(expr, run) {
  return expr === null || expr === undefined ? () => undefined : prepared(expr, run);
}

/** The width of a joint's blend, 0 for a sharp edge. */
function widthOf(op, expr, run) {
  if (expr === null) return () => (op === "smooth" ? USUAL_BLEND : 0);
  const get = prepared(expr, run);
  return (slots) => {
    const k = bare(get(slots));
    return k > 0 ? k : refuse("a blend whose width is not above 0");
  };
}

/** Hand what a call has made to the block it stands in, moved as the call's own block says. */
function placeCalled(inside, own, out) {
  const steps = [...inside.steps, ...own.steps];
  const worn = inside.worn ?? own.worn;
  if (inside.links.length !== 1) {
    out.add({ links: inside.links, steps, worn });
    return;
  }
  const { node } = inside.links[0];
  out.add({ ...node, steps: [...node.steps, ...steps], worn: node.worn ?? worn });
}

/** A param's value from outside as one of the language, of the kind of its default. */
function fromOutside(given, like) {
  if (like instanceof Angle) return new Angle(given);
  if (like instanceof Time) return new Time(given);
  if (!(like instanceof Vec)) {
    return typeof given === typeof like ? given : refuse(`expected ${kindOf(like)}`);
  }
  return new Vec(Array.from(given, (item, at) => fromOutside(item, like.items[at] ?? like.items[0])));
}

function allowedBy(value, allowed) {
  if (allowed instanceof Vec) return allowed.items.some((choice) => equal(value, choice));
  if (value instanceof Vec) return value.items.every((item) => allowedBy(item, allowed));
  sameUnit(sizeOf(value), unitOf(value), allowed.start || allowed.stop, allowed.unit);
  return allowed.holds(sizeOf(value));
}

/** A transform of objects as its step. */
function stepOf(name, values, free = false) {
  if (name in MAPS) return { rows: MAPS[name](values) };
  const [a, b] = values.map(bare);
  if (name === "twirl") return { twirl: a, x: 0, y: 0 };
  if (name === "bend") return { twirl: 0, x: a, y: 0 };
  if (name === "grow") return free || (a >= -0.5 && a <= 1) ? { grow: a } : refuse(`a growth of ${a}`);
  if (name === "shell") return a > 0 && (free || a <= 1) ? { shell: a } : refuse(`a wall of ${a}`);
  return name === "twist" ? { twist: a } : { amount: a, frequency: b };
}

const INKS = {
  color: ([rgb]) => ["color", ...numbersOf(rgb, 3)],
  grayscale: ([amount]) => ["grayscale", bare(amount)],
  hue: ([angle]) => ["hue", radians(angle) / (2 * Math.PI)],
  stop: ([offset, rgb]) => ["stop", bare(offset), ...numbersOf(rgb, 3)],
  opacity: ([share]) => ["opacity", opacityFrom(bare(share))],
  glow: ([rgb, power = 1]) => ["glow", powerFrom(bare(power)), ...sharesOf(rgb)],
  density: ([density]) => ["density", densityFrom(bare(density))],
};
const PROPERTIES = ["opacity", "glow", "density"];
const MOST_DENSE = 1e6;

function powerFrom(power) {
  return power >= 0 && power <= 1e12 ? power : refuse(`a power of ${power}`);
}

function densityFrom(density) {
  return density > 0 && density <= MOST_DENSE ? density : refuse(`a density of ${density}`);
}

function opacityFrom(share) {
  return share >= 0 && share <= 1 ? share : refuse(`an opacity of ${share} is outside 0..1`);
}

/** How many samples a pixel is the mean of. */
function samplesFrom([count] = [4]) {
  return [4, 16].includes(bare(count)) ? count : refuse(`${count} samples a pixel`);
}

const STATEMENTS_OF_FORMS = {
  no: ([why]) => () => refuse(why),
  g: ([slot, expr], run) => {
    const get = prepared(expr, run);
    return () => {
      run.globals[slot] = get();
    };
  },
  v: ([slot, expr], run) => {
    const get = prepared(expr, run);
    return (slots) => {
      slots[slot] = get(slots);
    };
  },
  param: ([slot, name, expr, range], run) => {
    const [get, bounds] = [prepared(expr, run), optionalValue(range, run)];
    return () => {
      const like = get();
      const given = Object.hasOwn(run.params, name) ? run.params[name] : undefined;
      const value = given === undefined ? like : fromOutside(given, like);
      const allowed = bounds();
      if (allowed !== undefined && !allowedBy(value, allowed)) refuse(`\`${name}\` is outside its range`);
      run.globals[slot] = value;
    };
  },
  for: ([where, slot, expr, block], run) => {
    const [loop, act] = [looping([where, slot, expr], 1 + block.length, run), actionsOf(block, run)];
    return (slots, out) => loop(slots, () => act(slots, out));
  },
  if: ([test, then, otherwise], run) => {
    const [decide, first, second] = [prepared(test, run), actionsOf(then, run), actionsOf(otherwise, run)];
    return (slots, out) => (truth(decide(slots)) ? first : second)(slots, out);
  },
  object: ([shape, block], run) => {
    const act = actionsOf(block, run);
    return (slots, out) => {
      const inside = new Block();
      act(slots, inside);
      run.objects += 1;
      if (run.objects > MOST_OBJECTS) refuse(`more than ${MOST_OBJECTS} objects`);
      out.add({ shape, steps: inside.steps, worn: inside.worn });
    };
  },
  outline: ([kind, expr, block], run) => {
    const [get, act] = [prepared(expr, run), actionsOf(block, run)];
    return (slots, out) => {
      const inside = new Block("union", 0, true), points = get(slots);
      run.weigh([points]);
      act(slots, inside);
      run.objects += 1;
      if (run.objects > MOST_OBJECTS) refuse(`more than ${MOST_OBJECTS} objects`);
      const { shape, radius, there } = outlineOf(kind, points, run.form), { steps, worn } = inside;
      const own = steps.findIndex((step) => !isOwn(step)), first = own < 0 ? steps.length : own;
      const sized = steps.slice(0, first).map((step) => {
        return step.grow === undefined ? { shell: step.shell / radius } : { grow: step.grow / radius };
      });
      out.add({ shape, there, worn, steps: [...sized, { rows: there }, ...steps.slice(first)] });
    };
  },
  node: ([kind, k, block], run) => {
    const op = kind === "group" || kind === "chain" ? "union" : kind;
    const [width, act] = [widthOf(op, k, run), actionsOf(block, run)];
    return (slots, out) => {
      const inside = new Block(op, width(slots));
      act(slots, inside);
      out.add({ links: inside.links, steps: inside.steps, worn: inside.worn });
    };
  },
  join: ([op, k, child], run) => {
    const [width, act] = [widthOf(op, k, run), actionOf(child, run)];
    return (slots, out) => {
      if (out.links.length > 0) Object.assign(out, { op, k: width(slots) });
      else if (op === "subtract" || op === "intersect") refuse(`\`${op}\` with nothing before it`);
      act(slots, out);
      Object.assign(out, { op: "union", k: 0 });
    };
  },
  module: ([at, hops, args, block], run) => {
    const [enter, act] = [entering([at, hops, args], run), actionsOf(block, run)];
    const definition = run.definition(at);
    return (slots, out) => {
      const [inside, own] = [new Block(), new Block()];
      definition.body(enter(slots), inside);
      run.leave();
      act(slots, own);
      placeCalled(inside, own, out);
    };
  },
  parts: ([objects, block], run) => {
    const [make, act] = [actionsOf(objects, run), actionsOf(block, run)];
    return (slots, out) => {
      const [inside, own] = [new Block(), new Block()];
      make(slots, inside);
      act(slots, own);
      placeCalled(inside, own, out);
    };
  },
  text: ([font, args, block], run) => {
    const [parts, act] = [args.map((arg) => optionalValue(arg, run)), actionsOf(block, run)];
    return (slots, out) => {
      const [inside, own] = [new Block(), new Block()];
      const { line } = lineOf(run.form.fonts[font], ...parts.map((part) => part(slots)));
      run.spend(line.length);
      run.objects += line.length;
      if (run.objects > MOST_OBJECTS) refuse(`more than ${MOST_OBJECTS} objects`);
      for (const { shape, x, y, radius } of line) {
        const steps = [stepOf("even", [radius]), stepOf("translate", [x, y])];
        inside.add({ shape, steps, worn: null });
      }
      act(slots, own);
      placeCalled(inside, own, out);
    };
  },
  use: ([expr, block], run) => {
    const get = prepared(expr, run);
    const more = block === undefined ? null : run.operations(block);
    return (slots, out) => {
      const worn = get(slots);
      if (!(worn instanceof Wearing)) refuse(`expected a material, found ${kindOf(worn)}`);
      out.wear(more === null ? worn : new Wearing(worn.lit, worn.paint, [...worn.ops, ...more(slots)]));
    };
  },
  move: ([name, ...args], run) => {
    const parts = args.map((arg) => optionalValue(arg, run));
    return (slots, out) => {
      run.spend(1);
      out.moved = true;
      const values = parts.map((part) => part(slots));
      out.steps.push(name in INKS ? INKS[name](values) : stepOf(name, values, out.free));
    };
  },
  animate: (args, run) => {
    const parts = args.map((arg) => optionalValue(arg, run));
    return (slots) => {
      const [length, rate, loop] = parts.map((part) => part(slots));
      const [seconds, fps] = [length instanceof Time ? length.size : bare(length), bare(rate)];
      if (!(seconds > 0 && fps > 0 && seconds * fps <= MOST_FRAMES)) refuse("an animation of this length");
      const frames = Math.max(1, roundedEven(seconds * fps));
      if (!(run.frame >= 0 && run.frame < frames)) refuse(`frame ${run.frame} is outside 0..${frames - 1}`);
      const u = loop ?? true ? run.frame / frames : run.frame / Math.max(1, frames - 1);
      run.animated = [run.frame / fps, u, run.frame, frames];
    };
  },
  set: ([name, ...args], run) => {
    const parts = args.map((arg) => optionalValue(arg, run));
    return (slots) => {
      const values = parts.map((part) => part(slots));
      if (name === "light") run.lights.push(values);
      else run.settings[name] = values;
    };
  },
};

/** The nearest whole number, of two the even one. */
function roundedEven(x) {
  const low = Math.floor(x);
  if (x - low === 0.5) return low + (low % 2);
  return Math.round(x);
}
