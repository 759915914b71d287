"""Values of expressions: their kinds, operators, functions and constants.

Numbers, booleans and strings are Python's, ``none`` is None, a colour is a vector. What meets `POISON`, a
value whose mistake has been reported, stays quiet. Only `Problem` is raised; results are finite.
"""

from __future__ import annotations

import colorsys
import math
import operator
import struct
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, Final, Literal

from scenelang.assets.records import Record
from scenelang.language.diagnostics import plural
from scenelang.language.nodes import Material
from scenelang.language.noise import noise

MAX_VECTOR: Final = 1_000_000  # numbers in one vector, nested ones counted
MAX_VECTOR_DEPTH: Final = 16
MAX_TEXT: Final = 10_000  # characters of what is joined, or set in letters
MAX_PLACES: Final = 15


class Problem(Exception):
    """Mistake in an operation; the caller knows the place.

    Args:
        message: the fact; made of ``expected`` and ``found`` where a kind of value was expected.
        operand: which operand or argument is to blame, from 0; None for all of it.
        fix: what a fix may make of that operand: ``angle`` or ``hue`` with a unit, a ``colour`` of a string,
            a ``text`` of a value.
        notes: words for further operands, by their numbers.
        letter: which character of that operand, a string.
        found: the kind that is odd about a value; problems that found the same may have one cause.
    """

    def __init__(
        self,
        code: str,
        message: str = "",
        help: str | None = None,
        operand: int | None = None,
        fix: str = "",
        notes: Mapping[int, str] = MappingProxyType({}),
        found: str = "",
        expected: str = "",
        letter: int | None = None,
    ) -> None:
        self.letter = letter
        self.code, self.help, self.operand, self.fix, self.notes = code, help, operand, fix, notes
        self.message = message or f"expected {expected}, found {found}"
        self.expected, self.found = expected, found
        super().__init__(self.message)


POISON: Final = object()
"""The one value of an expression that has a reported mistake."""


class _Quantity:
    """A number of some unit."""

    __slots__ = ("size",)

    def __init__(self, size: float) -> None:
        self.size = size

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.size!r})"


class Angle(_Quantity):
    """An angle in radians."""

    __slots__ = ()


class Time(_Quantity):
    """A time in seconds."""

    __slots__ = ()


class Vec:
    """A vector of values; raises Problem beyond `MAX_VECTOR` numbers or `MAX_VECTOR_DEPTH` levels."""

    __slots__ = ("count", "depth", "items")

    def __init__(self, items: tuple[Any, ...]) -> None:
        self.items = items
        self.count = self.depth = 0
        for item in items:
            if item.__class__ is Vec:
                self.count += item.count
                self.depth = max(self.depth, item.depth)
            else:
                self.count += 1
        self.depth += 1
        if self.count > MAX_VECTOR:
            raise Problem("E0323", f"a vector of more than {MAX_VECTOR:,} numbers")
        if self.depth > MAX_VECTOR_DEPTH:
            raise Problem("E0323", f"vectors nested deeper than {MAX_VECTOR_DEPTH}")

    def __repr__(self) -> str:
        return f"Vec({self.items!r})"


class RangeValue(Record):
    """Numbers, angles or times from ``start`` towards ``stop``, in base units, made one at a time."""

    start: float
    stop: float
    exclusive: bool  # whether ``stop`` itself is left out
    step: float | None  # not 0; None where none was written, which steps by 1
    unit: str  # ``number``, ``angle`` or ``time``

    def count(self) -> int:
        """Number of values; 0 when descending."""
        step = 1.0 if self.step is None else self.step
        quotient = (self.stop - self.start) / step
        if not math.isfinite(quotient):
            raise Problem("E0306", "the range has too many steps to count")
        # The tolerance lets 0..0.3 step 0.1 reach 0.3, which 0.3 / 0.1 < 3 would cut off.
        count = math.ceil(quotient - 1e-9) if self.exclusive else math.floor(quotient + 1e-9) + 1
        return max(0, count)

    def at(self, index: int) -> float:
        """The value number ``index`` in base units; never past ``stop``."""
        step = 1.0 if self.step is None else self.step
        value = self.start + index * step
        return min(value, self.stop) if step > 0 else max(value, self.stop)

    def item(self, index: int) -> Any:
        """The value number ``index``."""
        return pack(self.at(index), self.unit)

    def __iter__(self) -> Iterator[Any]:
        return map(self.item, range(self.count()))

    def contains(self, value: float) -> bool:
        """Test whether ``value`` lies between the bounds and, where a step was written, on it."""
        low, high = (self.start, self.stop) if (self.step or 1.0) > 0 else (self.stop, self.start)
        if not low <= value <= high or (self.exclusive and value == self.stop):
            return False
        if self.step is None:
            return True
        steps = (value - self.start) / self.step
        # Beyond 2^53 neighbours are whole numbers of steps apart, and so is what has no float64.
        return not math.isfinite(steps) or abs(steps - round(steps)) <= 1e-9


class MaterialValue(Record):
    """A material that an expression made, with the node it stands for."""

    material: Material


COMPONENTS: Final = {"x": 0, "y": 1, "z": 2, "r": 0, "g": 1, "b": 2}
UNITS: Final[dict[type, str]] = {float: "number", Angle: "angle", Time: "time"}
_OF_UNIT: Final[dict[str, Callable[[float], Any]]] = {"number": float, "angle": Angle, "time": Time}
NAMED: Final = {"number": "a number", "angle": "an angle", "time": "a time"}
_KINDS: Final[dict[type, str]] = {
    **{cls: NAMED[unit] for cls, unit in UNITS.items()},
    bool: "a boolean",
    str: "a string",
    RangeValue: "a range",
    MaterialValue: "a material",
    type(None): "none",
}


def unpack(value: Any) -> tuple[float, str]:
    """A scalar as a number in base units (radians, seconds) and its unit's name."""
    cls = value.__class__
    return (value, "number") if cls is float else (value.size, UNITS[cls])


def pack(number: float, unit: str) -> Any:
    """The inverse of `unpack`."""
    return number if unit == "number" else _OF_UNIT[unit](number)


def describe(value: Any) -> str:
    """Kind of a value, for messages."""
    if value.__class__ is Vec:
        return f"a vector of {plural(len(value.items), 'item')}"
    return _KINDS.get(value.__class__, "another value")


def unexpected(
    expected: str, value: Any, help: str | None = None, operand: int | None = None, fix: str = ""
) -> Problem:
    """A value of another kind than is expected; arguments as of `Problem`."""
    return Problem("E0301", "", help, operand, fix, found=describe(value), expected=expected)


def show(number: float) -> str:
    """A number for messages: short, integers without a point."""
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else f"{number:.6g}"


_VERBS: Final = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide", "%": "divide", "^": "raise"}
_PREPOSITIONS: Final = {"+": "and", "-": "and", "*": "and", "/": "by", "%": "by", "^": "to"}


def finite(value: float) -> float:
    """``value``, if it is finite; raises Problem otherwise."""
    if value - value == 0.0:
        return value
    raise Problem("E0306", "the result is too large for a number")


def divide(a: float, b: float) -> float:
    if b == 0.0:
        raise Problem("E0304", "division by zero", operand=1)
    return a / b


def modulo(a: float, b: float) -> float:
    """The remainder with the sign of ``b``."""
    if b == 0.0:
        raise Problem("E0304", "division by zero", operand=1)
    return a % b


def power(a: float, b: float) -> float:
    try:
        return math.pow(a, b)
    except OverflowError:
        raise Problem("E0306", "the result is too large for a number") from None
    except ValueError:
        if a == 0.0:
            raise Problem("E0304", "division by zero: 0 to a negative power") from None
        raise Problem("E0305", "a negative number to a power that is not an integer") from None


ARITHMETIC: Final[dict[str, Callable[[float, float], float]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": divide,
    "%": modulo,
    "^": power,
}
COMPARE: Final[dict[str, Callable[[float, float], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def same_unit(a: float, ua: str, b: float, ub: str) -> str:
    """The common unit of two scalars for sums and comparisons; raises Problem where there is none.

    A bare number beside a time is seconds; 0 goes with any angle.
    """
    if ua == ub:
        return ua
    if "angle" not in (ua, ub):
        return "number"
    bare = 0 if ua == "number" else 1 if ub == "number" else None
    if bare is None:
        raise Problem("E0303", "an angle and a time do not combine")
    if (a, b)[bare] == 0.0:
        return "angle"
    notes = {1 - bare: "an angle"}
    raise Problem("E0302", "a bare number beside an angle", None, bare, "angle", notes, "an angle")


def _unit_of(op: str, a: float, ua: str, b: float, ub: str) -> str:
    """The unit of ``a op b``; raises Problem where units do not combine."""
    if ua == "number" and ub == "number":
        return "number"
    if op in "+-%":
        return same_unit(a, ua, b, ub)
    if op == "*":
        if "number" in (ua, ub):
            return ub if ua == "number" else ua
        if ua != ub:
            return "angle"  # a rate times seconds
    elif op == "/":
        if ua == ub:
            return "number"
        if ub == "number" or (ua == "angle" and ub == "time"):
            return ua
        if ua == "number" and ub == "time":
            return "number"
    help = "divide an angle by 1rad, or a time by 1s, for a bare number"
    raise Problem("E0303", f"cannot {_VERBS[op]} {NAMED[ua]} {_PREPOSITIONS[op]} {NAMED[ub]}", help)


def _unfit(message: str, a: Any, b: Any, operand: int, shared: bool = True) -> Problem:
    """Two values that an operator does not take; ``shared`` where the odd kind of one is the cause."""
    odd = {describe(a), describe(b)} - {"a number"}
    kind = odd.pop() if shared and len(odd) == 1 else ""
    notes = {1 - operand: describe((a, b)[1 - operand])}
    return Problem("E0303", message, operand=operand, notes=notes, found=kind)


def binary(op: str, a: Any, b: Any) -> Any:
    """``a op b`` for the arithmetic operators, componentwise on vectors."""
    ca, cb = a.__class__, b.__class__
    if ca in UNITS and cb in UNITS:
        x, ua = unpack(a)
        y, ub = unpack(b)
        return pack(finite(ARITHMETIC[op](x, y)), _unit_of(op, x, ua, y, ub))
    if ca is Vec and cb is Vec:
        if len(a.items) != len(b.items):
            lengths = [f"{len(v.items)} items" for v in (a, b)]
            message = f"vectors of {len(a.items)} and {len(b.items)} items do not combine"
            raise Problem("E0307", message, notes=dict(enumerate(lengths)))
        return Vec(tuple([binary(op, x, y) for x, y in zip(a.items, b.items, strict=True)]))
    if ca is Vec and cb in UNITS:
        return Vec(tuple([binary(op, x, b) for x in a.items]))
    if ca in UNITS and cb is Vec:
        return Vec(tuple([binary(op, a, y) for y in b.items]))
    message = f"cannot {_VERBS[op]} {describe(a)} {_PREPOSITIONS[op]} {describe(b)}"
    problem = _unfit(message, a, b, int(ca in UNITS or ca is Vec), op in "+-*")
    if op == "+" and (ca is str) != (cb is str):
        other = int(ca is str)
        problem.operand, problem.notes = other, {1 - other: "a string"}
        problem.help = "only a string joins a string: write str(…) of a number or a boolean"
        problem.fix = "text" if (a, b)[other].__class__ in (float, bool) else ""
    raise problem


def add(a: Any, b: Any) -> Any:
    """``a + b``, which also joins two strings."""
    if a.__class__ is not str or b.__class__ is not str:
        return binary("+", a, b)
    if len(a) + len(b) > MAX_TEXT:
        raise Problem("E0323", f"a text of more than {MAX_TEXT:,} characters")
    return a + b


def negate(value: Any) -> Any:
    """``-value``."""
    cls = value.__class__
    if cls in UNITS:
        x, unit = unpack(value)
        return pack(-x, unit)
    if cls is Vec:
        return Vec(tuple([negate(item) for item in value.items]))
    raise Problem("E0303", f"{describe(value)} has no negative", operand=0)


def plus(value: Any) -> Any:
    """``+value``: the value itself, if it is a quantity."""
    if value.__class__ in UNITS or value.__class__ is Vec:
        return value
    raise Problem("E0303", f"{describe(value)} takes no sign", operand=0)


def compare(op: str, a: Any, b: Any) -> bool:
    """``a op b`` for ``< <= > >=``."""
    if a.__class__ not in UNITS or b.__class__ not in UNITS:
        raise _unfit(f"cannot order {describe(a)} and {describe(b)}", a, b, int(a.__class__ in UNITS))
    x, ua = unpack(a)
    y, ub = unpack(b)
    same_unit(x, ua, y, ub)
    return COMPARE[op](x, y)


def equal(a: Any, b: Any) -> bool:
    """``a == b``; values of different types do not compare, ``none`` compares with all."""
    ca, cb = a.__class__, b.__class__
    if ca in UNITS and cb in UNITS:
        x, ua = unpack(a)
        y, ub = unpack(b)
        same_unit(x, ua, y, ub)
        return x == y
    if a is None or b is None:
        return a is b
    if ca is not cb:
        raise _unfit(f"cannot compare {describe(a)} with {describe(b)}", a, b, 1, shared=False)
    if ca is Vec:
        return len(a.items) == len(b.items) and all(map(equal, a.items, b.items))
    return bool(a == b)


_MASK = (1 << 64) - 1


def number(value: Any, operand: int = 0) -> float:
    """A bare number; raises Problem for anything else."""
    if value.__class__ is float:
        return value
    unit = {"an angle": "1deg", "a time": "1s"}.get(describe(value))
    help = f"divide by {unit} for a bare number" if unit else None
    raise unexpected("a number", value, help, operand)


def angle(value: Any, operand: int = 0, fix: Literal["angle", "hue"] = "angle") -> float:
    """An angle in radians; 0 needs no unit."""
    if value.__class__ is Angle:
        return float(value.size)
    if value.__class__ is float:
        if value == 0.0:
            return 0.0
        raise Problem("E0302", operand=operand, fix=fix, found="a bare number", expected="an angle")
    raise unexpected("an angle", value, None, operand)


def _each(function: Callable[[Any], Any], value: Any) -> Any:
    """``function`` of a scalar, or of each item of a vector."""
    if value.__class__ is Vec:
        return Vec(tuple([_each(function, item) for item in value.items]))
    return function(value)


def _of_angle(function: Callable[[float], float]) -> Callable[[Any], Any]:
    return lambda value: _each(lambda x: finite(function(angle(x))), value)


def _of_number(function: Callable[[float], float], domain: str) -> Callable[[Any], Any]:
    def one(value: Any) -> float:
        try:
            return finite(function(number(value)))
        except OverflowError:
            raise Problem("E0306", "the result is too large for a number") from None
        except ValueError:
            raise Problem("E0305", f"expected a number {domain}, found {value:.6g}", operand=0) from None

    return lambda value: _each(one, value)


def _to_angle(function: Callable[[float], float]) -> Callable[[Any], Any]:
    inner = _of_number(function, "in -1..1")
    return lambda value: _each(Angle, inner(value))


def _scalar(value: Any, operand: int = 0) -> tuple[float, str]:
    if value.__class__ in UNITS:
        return unpack(value)
    raise unexpected("a number", value, None, operand)


def _abs(value: Any) -> Any:
    def one(item: Any) -> Any:
        x, unit = _scalar(item)
        return pack(abs(x), unit)

    return _each(one, value)


def _pick(a: Any, b: Any, better: Callable[[float, float], bool]) -> Any:
    """The better of two scalars, componentwise where one is a vector."""
    if a.__class__ is Vec or b.__class__ is Vec:
        length = len(a.items) if a.__class__ is Vec else len(b.items)
        left = a.items if a.__class__ is Vec else (a,) * length
        right = b.items if b.__class__ is Vec else (b,) * length
        if len(left) != len(right):
            raise Problem("E0307", f"vectors of {len(left)} and {len(right)} items do not combine")
        return Vec(tuple([_pick(x, y, better) for x, y in zip(left, right, strict=True)]))
    x, ua = _scalar(a, 0)
    y, ub = _scalar(b, 1)
    return pack(x if better(x, y) else y, same_unit(x, ua, y, ub))


def _whole(function: Callable[..., Any]) -> Callable[..., Any]:
    """``function`` with its problems blamed on the call, where steps inside know no argument."""

    def run(*values: Any) -> Any:
        try:
            return function(*values)
        except Problem as problem:
            problem.operand = None
            raise

    return run


def _best(better: Callable[[float, float], bool]) -> Callable[..., Any]:
    def run(*values: Any) -> Any:
        if len(values) == 1 and values[0].__class__ is Vec:
            values = values[0].items
            if not values:
                raise Problem("E0305", "expected at least one number, found an empty vector", operand=0)
        best = values[0]
        if len(values) == 1:
            _scalar(best)
        for value in values[1:]:
            best = _pick(best, value, better)
        return best

    return run


def _clamp(x: Any, low: Any, high: Any) -> Any:
    if low.__class__ in UNITS and high.__class__ in UNITS:
        (bottom, ua), (top, ub) = unpack(low), unpack(high)
        same_unit(bottom, ua, top, ub)
        if bottom > top:
            raise Problem("E0305", f"clamp from {bottom:.6g} down to {top:.6g}", operand=1)
    return _pick(_pick(x, low, operator.ge), high, operator.le)


def round_half_away(x: float) -> float:
    """The nearest integer, halves away from zero, as C and OpenSCAD round."""
    whole = math.floor(abs(x))
    return math.copysign(whole + (abs(x) - whole >= 0.5), x)


def _mix(a: Any, b: Any, t: Any) -> Any:
    if t.__class__ is not Vec:
        number(t, 2)
    return binary("+", binary("*", a, binary("-", 1.0, t)), binary("*", b, t))


def _smoothstep(low: Any, high: Any, x: Any) -> Any:
    def one(item: Any) -> float:
        (e0, u0), (e1, u1), (v, u) = _scalar(low, 0), _scalar(high, 1), _scalar(item, 2)
        same_unit(e0, u0, e1, u1)
        same_unit(e0, u0, v, u)
        if e0 == e1:
            raise Problem("E0304", "division by zero: the edges of smoothstep are equal", operand=1)
        t = min(max(finite((v - e0) / finite(e1 - e0)), 0.0), 1.0)
        return t * t * (3.0 - 2.0 * t)

    return _each(one, x)


def _len(value: Any) -> float:
    if value.__class__ is Vec:
        return float(len(value.items))
    if value.__class__ is RangeValue:
        return float(value.count())
    if value.__class__ is str:
        return float(len(value))
    raise unexpected("a vector, a range or a string", value, operand=0)


def text_of(value: Any, digits: Any = None) -> str:
    """A number, a boolean or a string as text: the shortest that reads back, or with so many digits."""
    if digits is not None:
        return _rounded(number(value), number(digits, 1))
    if value.__class__ is str:
        return str(value)
    if value.__class__ is bool:
        return "true" if value else "false"
    if value.__class__ not in UNITS:
        raise unexpected("a number, a boolean or a string", value, operand=0)
    shown, e, exponent = repr(number(value) + 0.0).partition("e")  # + 0.0 makes -0 a 0
    return shown.removesuffix(".0") + (f"e{int(exponent)}" if e else "")


def _rounded(x: float, places: float) -> str:
    """A number with ``places`` digits behind the point, its exact value rounded, halves away from zero."""
    if not (places.is_integer() and 0 <= places <= MAX_PLACES):
        found = f"expected a whole number from 0 to {MAX_PLACES}, found {show(places)}"
        raise Problem("E0305", found, operand=1)
    (top, bottom), count = abs(x).as_integer_ratio(), int(places)
    whole = (2 * top * 10**count + bottom) // (2 * bottom)
    text = f"{whole:0{count + 1}d}"
    text = f"{text[:-count]}.{text[-count:]}" if count else text
    return f"-{text}" if x < 0 and whole else text


def _splitmix64(state: int) -> int:
    """One output of SplitMix64 (Steele, Lea, Flood 2014)."""
    state = (state + 0x9E3779B97F4A7C15) & _MASK
    state = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    state = ((state ^ (state >> 27)) * 0x94D049BB133111EB) & _MASK
    return state ^ (state >> 31)


def rand(seed: Any) -> float:
    """A number in [0, 1): the top 53 bits of SplitMix64 over the seed's IEEE 754 bits, folded if a vector."""
    state = 0
    for item in seed.items if seed.__class__ is Vec else (seed,):
        bits = struct.unpack("<Q", struct.pack("<d", number(item) + 0.0))[0]  # + 0.0 makes -0 a 0
        state = _splitmix64(state ^ bits)
    return (state >> 11) / (1 << 53)


def _noise(v: Any, seed: Any = 0.0) -> float:
    point = v.items if v.__class__ is Vec else (v,)
    if not 0 < len(point) <= 3:
        raise unexpected("a number or a vector of 1 to 3", v, operand=0)
    whole = number(seed, 1)
    if not whole.is_integer():
        raise Problem("E0305", f"expected a whole number, found {show(whole)}", operand=1)
    x, y, z = (*map(number, point), 0.0, 0.0)[:3]
    return noise(x, y, z, int(whole))


def _hsv(h: Any, s: Any, v: Any) -> Vec:
    turns = h.size / math.tau if h.__class__ is Angle else number(h, 0)
    return Vec(colorsys.hsv_to_rgb(turns % 1.0, number(s, 1), number(v, 2)))


FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "sin": _of_angle(math.sin),
    "cos": _of_angle(math.cos),
    "tan": _of_angle(math.tan),
    "asin": _to_angle(math.asin),
    "acos": _to_angle(math.acos),
    "atan2": lambda y, x: Angle(math.atan2(number(y, 0), number(x, 1))),
    "abs": _abs,
    "min": _whole(_best(operator.le)),
    "max": _whole(_best(operator.ge)),
    "clamp": _whole(_clamp),
    "floor": _of_number(lambda x: float(math.floor(x)), ""),
    "ceil": _of_number(lambda x: float(math.ceil(x)), ""),
    "round": _of_number(round_half_away, ""),
    "sqrt": _of_number(math.sqrt, "of at least 0"),
    "exp": _of_number(math.exp, ""),
    "log": _of_number(math.log, "above 0"),
    "mix": _whole(_mix),
    "smoothstep": _whole(_smoothstep),
    "len": _len,
    "str": text_of,
    "rand": rand,
    "noise": _noise,
    "rgb": lambda *components: Vec(tuple([number(c, i) for i, c in enumerate(components)])),
    "hsv": _hsv,
}
"""Implementation of each function; raises Problem."""
CONSTANTS: Final[dict[str, Any]] = {
    "PI": math.pi,
    "TAU": math.tau,
    "X": Vec((1.0, 0.0, 0.0)),
    "Y": Vec((0.0, 1.0, 0.0)),
    "Z": Vec((0.0, 0.0, 1.0)),
    "none": None,
}
