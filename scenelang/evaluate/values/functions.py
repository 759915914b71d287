"""The functions and constants that every file can use."""

from __future__ import annotations

import colorsys
import math
import operator
import struct
from collections.abc import Callable
from typing import Any, Final, Literal

from scenelang.evaluate.values.operators import binary, finite, same_unit
from scenelang.evaluate.values.value import (
    UNITS,
    Angle,
    Problem,
    RangeValue,
    Vec,
    describe,
    pack,
    show,
    unexpected,
    unpack,
)

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


def _atan2(y: Any, x: Any) -> Angle:
    return Angle(math.atan2(number(y, 0), number(x, 1)))


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
    unit = same_unit(x, ua, y, ub)
    return pack(x if better(x, y) else y, unit)


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


def _rgb(*components: Any) -> Vec:
    return Vec(tuple([number(c, i) for i, c in enumerate(components)]))


def _hsv(h: Any, s: Any, v: Any) -> Vec:
    turns = h.size / math.tau if h.__class__ is Angle else number(h, 0)
    return Vec(colorsys.hsv_to_rgb(turns % 1.0, number(s, 1), number(v, 2)))


def doubt_hue(h: Any, s: Any, v: Any) -> Problem | None:
    """A warning about the arguments of ``hsv``; its operand is to blame."""
    if h.__class__ is not float or abs(h) <= 2.0:
        return None
    help = f"a bare hue is in turns: write {show(h)}deg, multiply what is computed by 1deg, or take % 1"
    return Problem("W0302", f"a hue of {show(h)} turns", help, operand=0)


FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "sin": _of_angle(math.sin),
    "cos": _of_angle(math.cos),
    "tan": _of_angle(math.tan),
    "asin": _to_angle(math.asin),
    "acos": _to_angle(math.acos),
    "atan2": _atan2,
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
    "rand": rand,
    "rgb": _rgb,
    "hsv": _hsv,
}
"""What each function means; raises Problem."""
CONSTANTS: Final[dict[str, Any]] = {
    "PI": math.pi,
    "TAU": math.tau,
    "X": Vec((1.0, 0.0, 0.0)),
    "Y": Vec((0.0, 1.0, 0.0)),
    "Z": Vec((0.0, 0.0, 1.0)),
    "none": None,
}
