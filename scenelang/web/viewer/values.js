// Values of the language and what its operators do with them. Numbers, booleans and strings are JavaScript's
// own, `none` is null. What would be a mistake in a scene throws NotLive.

/** The scene has no picture for these params and this frame; the message says why. */
export class NotLive extends Error {}

/** An angle in radians. */
export class Angle {
  constructor(size) {
    this.size = size;
  }
}

/** A time in seconds. */
export class Time {
  constructor(size) {
    this.size = size;
  }
}

const MOST_NUMBERS = 1e6;
const MOST_NESTED = 16;

/** A vector of values. */
export class Vec {
  constructor(items) {
    this.items = items;
    this.count = 0;
    this.depth = 1;
    for (const item of items) {
      this.count += item instanceof Vec ? item.count : 1;
      if (item instanceof Vec && item.depth >= this.depth) this.depth = item.depth + 1;
    }
    if (this.count > MOST_NUMBERS) refuse("a vector of more than 1,000,000 numbers");
    if (this.depth > MOST_NESTED) refuse(`vectors nested deeper than ${MOST_NESTED}`);
  }
}

/** A material as a value: how it is lit and its colours, by places in the view, and what is done to them. */
export class Wearing {
  constructor(lit, paint, ops) {
    Object.assign(this, { lit, paint, ops });
  }
}

/** Numbers, angles or times from `start` to `stop` in base units; a `step` of undefined is one of 1. */
export class Progression {
  constructor(start, stop, exclusive, step, unit) {
    Object.assign(this, { start, stop, exclusive, step, unit });
  }

  count() {
    const quotient = (this.stop - this.start) / (this.step ?? 1);
    if (!Number.isFinite(quotient)) refuse("the range has too many steps to count");
    const count = this.exclusive ? Math.ceil(quotient - 1e-9) : Math.floor(quotient + 1e-9) + 1;
    return Math.max(0, count);
  }

  item(index) {
    const step = this.step ?? 1;
    const value = this.start + index * step;
    return quantity(step > 0 ? Math.min(value, this.stop) : Math.max(value, this.stop), this.unit);
  }

  holds(value) {
    const [low, high] = (this.step ?? 1) > 0 ? [this.start, this.stop] : [this.stop, this.start];
    if (!(low <= value && value <= high) || (this.exclusive && value === this.stop)) return false;
    if (this.step === undefined) return true;
    const steps = (value - this.start) / this.step;
    return !Number.isFinite(steps) || Math.abs(steps - Math.round(steps)) <= 1e-9;
  }
}

/** Throws NotLive. */
export function refuse(message) {
  throw new NotLive(message);
}

const NUMBER = 0;
const ANGLE = 1;
const TIME = 2;
const NO_UNIT = -1;

/** The unit of a scalar; NO_UNIT for other values. */
export function unitOf(value) {
  if (typeof value === "number") return NUMBER;
  if (value instanceof Angle) return ANGLE;
  return value instanceof Time ? TIME : NO_UNIT;
}

/** A scalar in its base unit. */
export function sizeOf(value) {
  return typeof value === "number" ? value : value.size;
}

/** The scalar of a size in a unit. */
export function quantity(size, unit) {
  return unit === NUMBER ? size : unit === ANGLE ? new Angle(size) : new Time(size);
}

/** What kind of value it is, for messages. */
export function kindOf(value) {
  const unit = unitOf(value);
  if (unit !== NO_UNIT) return ["a number", "an angle", "a time"][unit];
  if (value === null) return "none";
  if (value instanceof Vec) return "a vector";
  if (value instanceof Wearing) return "a material";
  return value instanceof Progression ? "a range" : `a ${typeof value}`;
}

/** The number, if it is finite. */
export function finite(number) {
  return number - number === 0 ? number : refuse("the result is not a finite number");
}

/** A bare number. */
export function bare(value) {
  return typeof value === "number" ? value : refuse(`expected a number, found ${kindOf(value)}`);
}

/** An angle in radians; 0 needs no unit. */
export function radians(value) {
  if (value instanceof Angle) return value.size;
  return value === 0 ? 0 : refuse(`expected an angle, found ${kindOf(value)}`);
}

/** The numbers of a vector of so many. */
export function numbersOf(value, length) {
  if (value instanceof Vec && value.items.length === length) return value.items.map(bare);
  return refuse(`expected a vector of ${length} numbers, found ${kindOf(value)}`);
}

/** A boolean. */
export function truth(value) {
  return typeof value === "boolean" ? value : refuse(`expected a boolean, found ${kindOf(value)}`);
}

/** The remainder with the sign of b. */
export function modulo(a, b) {
  const rest = a % b;
  if (rest === 0) return b < 0 ? -0 : 0;
  return rest < 0 === b < 0 ? rest : rest + b;
}

export const ARITHMETIC = {
  "+": (a, b) => a + b,
  "-": (a, b) => a - b,
  "*": (a, b) => a * b,
  "/": (a, b) => a / b,
  "%": modulo,
  "^": Math.pow,
};

export const ORDER = {
  "<": (a, b) => a < b,
  "<=": (a, b) => a <= b,
  ">": (a, b) => a > b,
  ">=": (a, b) => a >= b,
};

/** The unit of scalars in sums and comparisons: a number beside a time is seconds, 0 goes with any angle. */
export function sameUnit(a, unitA, b, unitB) {
  if (unitA === unitB) return unitA;
  if (unitA !== ANGLE && unitB !== ANGLE) return NUMBER;
  const other = unitA === NUMBER ? a : unitB === NUMBER ? b : NaN;
  return other === 0 ? ANGLE : refuse("an angle beside a number or a time");
}

function unitOfResult(op, a, unitA, b, unitB) {
  if (op === "+" || op === "-" || op === "%") return sameUnit(a, unitA, b, unitB);
  if (op === "*") {
    if (unitA === NUMBER || unitB === NUMBER) return unitA + unitB;
    if (unitA !== unitB) return ANGLE;
  } else if (op === "/") {
    if (unitA === unitB) return NUMBER;
    if (unitB === NUMBER || (unitA === ANGLE && unitB === TIME)) return unitA;
    if (unitA === NUMBER && unitB === TIME) return NUMBER;
  } else if (unitA === NUMBER && unitB === NUMBER) {
    return NUMBER;
  }
  return refuse("an operation that these units do not have");
}

/** `a op b` for the arithmetic operators, componentwise on vectors. */
export function arithmetic(op, a, b) {
  const unitA = unitOf(a);
  const unitB = unitOf(b);
  if (unitA !== NO_UNIT && unitB !== NO_UNIT) {
    const [x, y] = [sizeOf(a), sizeOf(b)];
    return quantity(finite(ARITHMETIC[op](x, y)), unitOfResult(op, x, unitA, y, unitB));
  }
  if (a instanceof Vec && b instanceof Vec) {
    if (a.items.length !== b.items.length) refuse("vectors of different lengths do not combine");
    return new Vec(a.items.map((item, at) => arithmetic(op, item, b.items[at])));
  }
  if (a instanceof Vec && unitB !== NO_UNIT) return new Vec(a.items.map((item) => arithmetic(op, item, b)));
  if (b instanceof Vec && unitA !== NO_UNIT) return new Vec(b.items.map((item) => arithmetic(op, a, item)));
  return refuse(`${kindOf(a)} ${op} ${kindOf(b)} means nothing`);
}

const MOST_LETTERS = 10_000;

/** `a + b`, which also joins two strings. */
export function added(a, b) {
  if (typeof a !== "string" || typeof b !== "string") return arithmetic("+", a, b);
  const text = a + b;
  const long = text.length > MOST_LETTERS && [...text].length > MOST_LETTERS;
  return long ? refuse("a text of more than 10,000 characters") : text;
}

/** `-value`. */
export function negative(value) {
  if (value instanceof Vec) return new Vec(value.items.map(negative));
  const unit = unitOf(value);
  return unit === NO_UNIT ? refuse(`${kindOf(value)} has no negative`) : quantity(-sizeOf(value), unit);
}

/** `+value`. */
export function positive(value) {
  if (value instanceof Vec || unitOf(value) !== NO_UNIT) return value;
  return refuse(`${kindOf(value)} takes no sign`);
}

/** `a op b` for `< <= > >=`. */
export function ordered(op, a, b) {
  const [unitA, unitB] = [unitOf(a), unitOf(b)];
  if (unitA === NO_UNIT || unitB === NO_UNIT) refuse(`cannot order ${kindOf(a)} and ${kindOf(b)}`);
  sameUnit(sizeOf(a), unitA, sizeOf(b), unitB);
  return ORDER[op](sizeOf(a), sizeOf(b));
}

/** `a == b`; values of different types do not compare, `none` compares with all. */
export function equal(a, b) {
  const [unitA, unitB] = [unitOf(a), unitOf(b)];
  if (unitA !== NO_UNIT && unitB !== NO_UNIT) {
    sameUnit(sizeOf(a), unitA, sizeOf(b), unitB);
    return sizeOf(a) === sizeOf(b);
  }
  if (a === null || b === null) return a === b;
  if (kindOf(a) !== kindOf(b)) refuse(`cannot compare ${kindOf(a)} with ${kindOf(b)}`);
  if (a instanceof Vec) {
    return a.items.length === b.items.length && a.items.every((item, at) => equal(item, b.items[at]));
  }
  if (typeof a === "object") return JSON.stringify(a) === JSON.stringify(b);
  return a === b;
}
