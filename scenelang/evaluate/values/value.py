"""Values that expressions have: numbers, angles, times, vectors, ranges, materials and the rest.

Numbers are Python floats, booleans and strings Python's own, ``none`` is None. A colour is a vector of
three numbers. `POISON` stands for a value whose mistake has been reported; whatever meets it stays quiet.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, Final

from scenelang.diagnostics.suggest import plural
from scenelang.scene.schema import Material

MAX_VECTOR: Final = 1_000_000  # numbers in one vector, nested ones counted
MAX_VECTOR_DEPTH: Final = 16


class Problem(Exception):
    """What is wrong with an operation; the caller knows the place.

    Args:
        message: the fact; made of ``expected`` and ``found`` where a kind of value was expected.
        operand: which operand or argument is to blame, from 0; None for all of it.
        fix: what a fix may make of that operand: ``angle`` or ``hue`` with a unit, for which the help comes
            with the fix; a ``colour`` of a string; of three ``turns`` the last.
        notes: words for further operands, by their numbers.
        found: the kind that is odd about a value, whatever was going to be done with it. Problems that found
            the same may have one cause.
        expected: the kind that was expected.
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
    ) -> None:
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
    """A vector of values.

    Raises:
        Problem: more than `MAX_VECTOR` numbers, or nested deeper than `MAX_VECTOR_DEPTH`.
    """

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


class RangeValue:
    """Numbers, angles or times from ``start`` towards ``stop``, made one at a time.

    Args:
        start: first value, in base units.
        stop: bound, in base units.
        exclusive: whether ``stop`` itself is left out.
        step: distance of neighbours, not 0; None where none was written, which steps by 1.
        unit: ``number``, ``angle`` or ``time``.
    """

    __slots__ = ("exclusive", "start", "step", "stop", "unit")

    def __init__(self, start: float, stop: float, exclusive: bool, step: float | None, unit: str) -> None:
        self.start = start
        self.stop = stop
        self.exclusive = exclusive
        self.step = step
        self.unit = unit

    def count(self) -> int:
        """How many values there are; 0 when descending."""
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
        """Whether ``value`` lies between the bounds and, where a step was written, on it."""
        low, high = (self.start, self.stop) if (self.step or 1.0) > 0 else (self.stop, self.start)
        if not low <= value <= high or (self.exclusive and value == self.stop):
            return False
        if self.step is None:
            return True
        steps = (value - self.start) / self.step
        # Beyond 2^53 neighbours are whole numbers of steps apart, and so is what has no float64.
        return not math.isfinite(steps) or abs(steps - round(steps)) <= 1e-9


class MaterialValue:
    """A material that an expression made, with the node it stands for."""

    __slots__ = ("material",)

    def __init__(self, material: Material) -> None:
        self.material = material


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
    """What kind of value it is, for messages."""
    if value.__class__ is Vec:
        count = len(value.items)
        return f"a vector of {plural(count, 'item')}"
    return _KINDS.get(value.__class__, "another value")


def unexpected(
    expected: str, value: Any, help: str | None = None, operand: int | None = None, fix: str = ""
) -> Problem:
    """A value of another kind than is expected; arguments as of `Problem`."""
    return Problem("E0301", "", help, operand, fix, found=describe(value), expected=expected)


def show(number: float) -> str:
    """A number for messages: short, integers without a point."""
    if number.is_integer() and abs(number) < 1e15:
        return str(int(number))
    return f"{number:.6g}"
