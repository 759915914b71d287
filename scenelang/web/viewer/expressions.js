// Expressions of a form, prepared into closures from a call's slots to a value.

import { Progression, Time, Angle, Vec, Wearing } from "./values.js";
import { ARITHMETIC, ORDER, added, arithmetic, bare, equal, finite, kindOf, negative, ordered } from "./values.js";
import { positive, refuse, sameUnit, sizeOf, truth, unitOf } from "./values.js";
import { FUNCTIONS } from "./functions.js";
import { lineOf } from "./letters.js";

const UNITS_WRITTEN = {
  deg: (size) => new Angle(size * (Math.PI / 180)),
  rad: (size) => new Angle(size),
  turn: (size) => new Angle(size * 2 * Math.PI),
  s: (size) => new Time(size),
  ms: (size) => new Time(size / 1000),
};

const NOT_YET = "a name is used before its line has run";

/**
 * The closure of an expression.
 * @param run - state of the scene's run; see `evaluate.js`
 * @returns {(slots: Array) => any}
 */
export function prepared(expr, run) {
  if (!Array.isArray(expr)) return () => expr;
  const [word, ...rest] = expr;
  if (word in UNITS_WRITTEN) return constantly(UNITS_WRITTEN[word](rest[0]));
  if (word in WORDS_OF_VALUES) return WORDS_OF_VALUES[word](rest, run);
  if (word in ARITHMETIC) return operation(ARITHMETIC[word], word, rest, run);
  if (word in ORDER) return comparison(ORDER[word], word, rest, run);
  const parts = rest.map((part) => prepared(part, run));
  const meaning = FUNCTIONS[word];
  return (slots) => {
    const values = parts.map((part) => part(slots));
    run.weigh(values);
    return meaning(...values);
  };
}

const constantly = (value) => () => value;

function operation(plain, word, [left, right], run) {
  const [first, second] = [prepared(left, run), prepared(right, run)];
  return (slots) => {
    const [a, b] = [first(slots), second(slots)];
    if (typeof a === "number" && typeof b === "number") return finite(plain(a, b));
    run.weigh([a, b]);
    return word === "+" ? added(a, b) : arithmetic(word, a, b);
  };
}

function comparison(plain, word, [left, right], run) {
  const [first, second] = [prepared(left, run), prepared(right, run)];
  return (slots) => {
    const [a, b] = [first(slots), second(slots)];
    return typeof a === "number" && typeof b === "number" ? plain(a, b) : ordered(word, a, b);
  };
}

/** A unary or binary operation on values. */
const onValues = (meaning) => (parts, run) => {
  const [first, second] = parts.map((part) => prepared(part, run));
  return (slots) => {
    const values = second === undefined ? [first(slots)] : [first(slots), second(slots)];
    run.weigh(values);
    return meaning(...values);
  };
};

const logic = (decides) => (parts, run) => {
  const [first, second] = parts.map((part) => prepared(part, run));
  return (slots) => (truth(first(slots)) === decides ? decides : truth(second(slots)));
};

function itemOf(value, index) {
  const at = bare(index);
  const numbered = value instanceof Vec || value instanceof Progression;
  const length = FUNCTIONS.len(numbered ? value : refuse(`${kindOf(value)} has no items`));
  if (!Number.isInteger(at) || at < 0 || at >= length) refuse(`index ${at} is not one of ${length} items`);
  return value instanceof Vec ? value.items[at] : value.item(at);
}

function memberOf(value, at) {
  const has = value instanceof Vec && at < value.items.length;
  return has ? value.items[at] : refuse(`${kindOf(value)} has no such part`);
}

function progression(exclusive, start, stop, step) {
  for (const value of [start, stop, step ?? 1]) {
    if (unitOf(value) < 0) refuse(`expected a number, found ${kindOf(value)}`);
  }
  const [a, b] = [sizeOf(start), sizeOf(stop)];
  const unit = sameUnit(a, unitOf(start), b, unitOf(stop));
  if (step === undefined) return new Progression(a, b, exclusive, undefined, unit);
  const size = sizeOf(step);
  if (size === 0) refuse("a range with a step of 0");
  if (unitOf(new Angle(0)) === unit && unitOf(step) !== unit) refuse("a bare number as the step of angles");
  return new Progression(a, b, exclusive, size, sameUnit(b, unit, size, unitOf(step)));
}

/** What a loop runs over: a range, or the items of a vector. */
export function itemsOf(value) {
  if (value instanceof Vec) return value.items;
  if (!(value instanceof Progression)) refuse(`expected a range or a vector, found ${kindOf(value)}`);
  if (value.unit !== 0 && value.step === undefined) refuse("a range of angles or times without a step");
  return value;
}

/**
 * The turns of a loop.
 * @param {Array} head - "g" or "v" and the slot of its variable, and what it runs over
 * @returns {(slots: Array, turn: () => void) => void}
 */
export function looping([where, slot, expr], weight, run) {
  const get = prepared(expr, run);
  return (slots, turn) => {
    const target = where === "g" ? run.globals : slots;
    const items = itemsOf(get(slots));
    const count = items instanceof Progression ? items.count() : items.length;
    for (let at = 0; at < count; at += 1) {
      target[slot] = items instanceof Progression ? items.item(at) : items[at];
      run.spend(weight);
      turn();
    }
  };
}

/** How an item of a vector adds its values to those of the vector. */
function filling(item, run) {
  const word = Array.isArray(item) ? item[0] : "";
  if (word !== "for" && word !== "if") {
    const get = prepared(item, run);
    return (slots, out) => {
      const value = get(slots);
      out.push(value instanceof Progression ? refuse("a range inside a vector") : value);
    };
  }
  const fill = filling(item.at(-1), run);
  if (word === "for") {
    const loop = looping(item.slice(1, 4), 2, run);
    return (slots, out) => loop(slots, () => fill(slots, out));
  }
  const test = prepared(item[1], run);
  return (slots, out) => (truth(test(slots)) ? fill(slots, out) : null);
}

/** The slots of the call so many definitions further out. */
export function outerSlots(slots, hops) {
  let found = slots;
  for (let hop = 0; hop < hops; hop += 1) found = found[0];
  return found;
}

/** How to make the slots of a call, with its arguments in them; `run.leave()` when it is over. */
export function entering([at, hops, args], run) {
  const definition = run.definition(at);
  const given = args.map((arg) => (arg === null ? null : prepared(arg, run)));
  return (slots) => {
    run.enter();
    const frame = new Array(definition.size);
    if (hops >= 0) frame[0] = outerSlots(slots, hops);
    for (let place = 0; place < given.length; place += 1) {
      frame[place + 1] = given[place] === null ? definition.defaults[place](frame) : given[place](slots);
    }
    return frame;
  };
}

/** What the words of expressions mean, besides units, operators on numbers, and functions. */
const WORDS_OF_VALUES = {
  none: () => constantly(null),
  no: ([why]) => () => refuse(why),
  "'": ([text]) => constantly(text),
  "#": (bytes) => constantly(new Vec(bytes.map((byte) => byte / 255))),
  "[": (items, run) => {
    const fills = items.map((item) => filling(item, run));
    return (slots) => {
      const values = [];
      for (const fill of fills) fill(slots, values);
      return new Vec(values);
    };
  },
  "..": ([exclusive, ...ends], run) => {
    const parts = ends.map((end) => prepared(end, run));
    return (slots) => progression(exclusive === 1, ...parts.map((part) => part(slots)));
  },
  g: ([slot], { globals }) => () => globals[slot] ?? knownValue(globals[slot]),
  v: ([hops, slot]) => {
    if (hops === 0) return (slots) => slots[slot] ?? knownValue(slots[slot]);
    return (slots) => knownValue(outerSlots(slots, hops)[slot]);
  },
  t: ([which], run) => () => run.animated[which] ?? refuse(NOT_YET),
  width: ([font, ...args], run) => {
    const [text, size] = args.map((arg) => (arg === null ? undefined : prepared(arg, run)));
    return (slots) => lineOf(run.form.fonts[font], text(slots), size?.(slots)).width;
  },
  "+1": onValues(positive),
  "-1": onValues(negative),
  "!1": ([part], run) => {
    const inner = prepared(part, run);
    return (slots) => !truth(inner(slots));
  },
  "==": onValues(equal),
  "!=": onValues((a, b) => !equal(a, b)),
  "&&": logic(false),
  "||": logic(true),
  "?": (parts, run) => {
    const [test, then, otherwise] = parts.map((part) => prepared(part, run));
    return (slots) => (truth(test(slots)) ? then(slots) : otherwise(slots));
  },
  "@": onValues(itemOf),
  ".": ([part, at], run) => {
    const inner = prepared(part, run);
    return (slots) => memberOf(inner(slots), at);
  },
  call: (call, run) => {
    const enter = entering(call, run);
    const definition = run.definition(call[0]);
    return (slots) => {
      const value = definition.body(enter(slots));
      run.leave();
      return value;
    };
  },
  material: ([lit, paint, block], run) => {
    if (block.length === 0) return () => new Wearing(lit, paint, []);
    const ops = run.operations(block);
    return (slots) => new Wearing(lit, paint, ops(slots));
  },
};

function knownValue(value) {
  return value === undefined ? refuse(NOT_YET) : value;
}
