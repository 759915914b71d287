"""Params as the axes of a box to search in, and values of them as a scene's text has them.

A point holds a number for each axis: of a continuous one in [0, 1], of others the index of a choice. A vector
has an axis for each of its numbers.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.diagnostics.suggest import listing, nearest
from scenelang.evaluate.evaluation import Evaluation
from scenelang.evaluate.file_context import FileContext, Place
from scenelang.evaluate.prepare.expressions import prepare
from scenelang.evaluate.values.value import Angle, RangeValue, Time, Vec, unpack
from scenelang.fitting.mesh import FitError
from scenelang.records import Record
from scenelang.scene.text import hex_colour, number
from scenelang.syntax import nodes

Point = npt.NDArray[np.float64]
MOST_AXES: Final = 64
MOST_CHOICES: Final = 1000
_UNITS: Final = {"deg": 180 / math.pi, "rad": 1.0, "turn": 0.5 / math.pi, "s": 1.0, "ms": 1000.0}
_DIGITS: Final = 4  # of the range's width, decimal places that a value is written with


class Axis(Record):
    """One number, or one choice, that is searched.

    Args:
        label: what reports call it: ``k``, or ``ink.2`` of a vector.
        low, high: of a continuous one, in base units.
        choices: values there are, else; none where it is continuous.
        wraps: whether both ends mean the same, as those of a full turn do.
    """

    label: str
    low: float = 0.0
    high: float = 1.0
    choices: tuple[Any, ...] = ()
    wraps: bool = False


class Knob(Record):
    """A param that is searched.

    Args:
        stmt: its statement.
        value: its default.
        axes: one, or one for each number of a vector.
        inner: whether the value is a vector of the axes' numbers.
    """

    stmt: nodes.Param
    value: Any
    axes: tuple[Axis, ...]
    inner: bool

    @property
    def name(self) -> str:
        """As the scene has it."""
        return self.stmt.name.text


class Space:
    """The box of some params.

    Args:
        knobs: the params.

    Attributes:
        axes: of all of them, in their order.
        smooth: (n,) which of these are continuous.
    """

    def __init__(self, knobs: Sequence[Knob]) -> None:
        self.knobs = tuple(knobs)
        self.axes = tuple(axis for knob in knobs for axis in knob.axes)
        self.smooth = np.array([not axis.choices for axis in self.axes], bool)
        self.most = np.array([max(1, len(axis.choices) - 1) for axis in self.axes], np.float64)
        self.wraps = np.array([axis.wraps for axis in self.axes], bool)

    def inside(self, u: Point) -> Point:
        """The nearest point of the box; full turns are taken off."""
        return np.where(self.wraps, u % 1.0, np.clip(u, 0.0, self.most))

    def gap(self, u: Point, v: Point) -> Point:
        """How far apart two points are along each axis, in shares of its range."""
        gap = abs(u - v) / self.most
        return np.where(self.wraps, np.minimum(gap, 1.0 - gap), gap)

    def values(self, u: Point) -> dict[str, Any]:
        """Values of the params at a point, as the language has them."""
        found, rest = {}, iter(zip(self.axes, u.tolist(), strict=True))
        for knob in self.knobs:
            items = [_at(*next(rest), knob.value) for _ in knob.axes]
            found[knob.name] = Vec(tuple(items)) if knob.inner else items[0]
        return found

    @property
    def names(self) -> tuple[str, ...]:
        """Of the params."""
        return tuple(knob.name for knob in self.knobs)

    def literals(self, u: Point) -> dict[str, str]:
        """Values at a point, as text of the language."""
        values = self.values(u)
        return {knob.name: written(knob, values[knob.name]) for knob in self.knobs}

    def point(self, values: Mapping[str, Any]) -> Point:
        """The point of values."""
        found: list[float] = []
        for knob in self.knobs:
            value = values.get(knob.name, knob.value)
            items = value.items if knob.inner else (value,)
            found += [_where(axis, item) for axis, item in zip(knob.axes, items, strict=True)]
        return self.inside(np.array(found, np.float64))


def _at(axis: Axis, u: float, like: Any) -> Any:
    """The value at a place of an axis, of the kind that the default's numbers are of."""
    if axis.choices:
        return axis.choices[round(u)]
    if like.__class__ is Vec:
        like = like.items[0]
    x = axis.low + u * (axis.high - axis.low)
    return like.__class__(x) if like.__class__ in (Angle, Time) else x


def _where(axis: Axis, value: Any) -> float:
    if axis.choices:
        same = [_plain(choice) == _plain(value) for choice in axis.choices]
        return float(same.index(True)) if True in same else 0.0
    width = axis.high - axis.low
    return (unpack(value)[0] - axis.low) / width if width > 0 else 0.0


def _plain(value: Any) -> Any:
    if value.__class__ is Vec:
        return tuple(_plain(item) for item in value.items)
    return value if isinstance(value, bool | str) else round(unpack(value)[0], 9)


# ---------------------------------------------------------------- which params there are


def params_of(evaluation: Evaluation) -> dict[str, nodes.Param]:
    """The params of the file itself, by name; those of imports are other files'."""
    return {stmt.name.text: stmt for stmt in evaluation.file.statements if isinstance(stmt, nodes.Param)}


def space_of(evaluation: Evaluation, names: Iterable[str] = (), fixed: Iterable[str] = ()) -> Space:
    """The box of a scene's params.

    Args:
        evaluation: of the scene, after a run.
        names: the params; by default all that have a range.
        fixed: those that keep their value.

    Raises:
        FitError: there is no such param, or it has no values to search among.
    """
    known, wanted = params_of(evaluation), list(dict.fromkeys(names))
    for name in wanted:
        if name not in known:
            near = nearest(name, known)
            help = f"did you mean `{near}`?" if near else f"its params are {listing(known)}" if known else ""
            raise FitError(
                f"no param `{name}` in `{evaluation.file.span.source.name}`" + f"; {help}" * bool(help)
            )
    chosen = wanted or [name for name, stmt in known.items() if stmt.range is not None]
    space = Space([_knob(known[name], evaluation.context) for name in chosen if name not in set(fixed)])
    if not space.axes:
        raise FitError("no param to fit: give one a range, as in `param k = 0.5 in 0..1;`, or name some")
    if len(space.axes) > MOST_AXES:
        raise FitError(f"{len(space.axes)} numbers to fit, where at most {MOST_AXES} are")
    return space


def _knob(stmt: nodes.Param, file: FileContext) -> Knob:
    name, value = stmt.name.text, file.env[file.scope.names[stmt.name.text].slot]
    allowed: Any = None
    if stmt.range is not None:
        allowed = prepare(stmt.range, Place(file, file.scope, "file")).run(file.env)
    if allowed.__class__ is Vec:
        return Knob(stmt, value, (Axis(name, choices=_few(name, allowed.items)),), False)
    if value.__class__ is bool:
        return Knob(stmt, value, (Axis(name, choices=(False, True)),), False)
    if value.__class__ is Vec:
        if allowed is None and is_colour(stmt.default):
            allowed = RangeValue(0.0, 1.0, False, None, "number")
        if isinstance(allowed, RangeValue):
            axes = tuple(_axis(f"{name}.{at}", allowed) for at in range(1, len(value.items) + 1))
            return Knob(stmt, value, axes, True)
    if not isinstance(allowed, RangeValue):
        raise FitError(f"param `{name}` has no range; give it one, as in `param {name} = … in 0..1;`")
    return Knob(stmt, value, (_axis(name, allowed),), False)


def _axis(label: str, allowed: RangeValue) -> Axis:
    if allowed.step is not None:
        if allowed.count() > MOST_CHOICES:
            raise FitError(f"param `{label}` has more than {MOST_CHOICES:,} steps")
        return Axis(label, choices=_few(label, tuple(allowed)))
    low, high = allowed.start, allowed.stop
    if allowed.exclusive:
        high -= 1e-9 * (high - low)
    turn = allowed.unit == "angle" and math.isclose(high - low, 2 * math.pi, rel_tol=1e-6)
    return Axis(label, low, high, wraps=turn)


def _few(name: str, choices: tuple[Any, ...]) -> tuple[Any, ...]:
    if not 0 < len(choices) <= MOST_CHOICES:
        raise FitError(
            f"param `{name}` has {len(choices):,} choices, where 1 to {MOST_CHOICES:,} can be tried"
        )
    return choices


def is_colour(expr: nodes.Expr) -> bool:
    """Whether an expression is written as a colour."""
    return isinstance(expr, nodes.Color) or (
        isinstance(expr, nodes.CallExpr) and expr.name.text in ("rgb", "hsv")
    )


# ---------------------------------------------------------------- values as text


def written(knob: Knob, value: Any) -> str:
    """A value as its statement would have it: in the default's unit, with digits enough for its range."""
    if not knob.inner:
        return _literal(value, knob.axes[0], knob.stmt.default)
    if is_colour(knob.stmt.default):
        r, g, b = (min(255, max(0, round(255 * item))) / 255 for item in value.items)
        return hex_colour((r, g, b)) or ""
    items = zip(value.items, knob.axes, strict=True)
    return f"[{', '.join(_literal(item, axis, knob.stmt.default) for item, axis in items)}]"


def _literal(value: Any, axis: Axis, default: nodes.Expr) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if value.__class__ is Vec:
        colour = tuple(item for item in value.items if isinstance(item, float))
        if len(colour) == len(value.items) == 3 and (text := hex_colour(colour)):
            return text
        return f"[{', '.join(_literal(item, axis, default) for item in value.items)}]"
    x, kind = unpack(value)
    unit = ""
    if kind != "number":
        units = (node.unit for node in nodes.walk(default) if isinstance(node, nodes.Number))
        unit = next(filter(None, units), "deg" if kind == "angle" else "s")
    factor = _UNITS.get(unit, 1.0)
    if axis.choices:
        return number(round(x * factor, 9)) + unit
    width = (axis.high - axis.low) * factor
    places = max(0, _DIGITS - math.floor(math.log10(width))) if width > 0 else 9
    low, high, tick = axis.low * factor, axis.high * factor, 10.0**-places
    near = round(x * factor, places)  # rounding may not leave the range
    near = near - tick if near > high else near + tick if near < low else near
    return number(round(near, places) + 0.0) + unit


def literals_of(evaluation: Evaluation, names: Iterable[str]) -> dict[str, str]:
    """The values that params of the file had in the last run, as text of the language."""
    found, file = {}, evaluation.context
    for name, stmt in params_of(evaluation).items():
        if name in names:
            value = file.env[file.scope.names[name].slot]
            found[name] = written(Knob(stmt, value, (Axis(name, choices=(value,)),), False), value)
    return found


def rewritten(file: nodes.File, literals: Mapping[str, str]) -> str:
    """A scene's text with other defaults of its params, by name; all else stays as it was."""
    text = file.span.source.text
    for stmt in reversed(file.statements):
        if isinstance(stmt, nodes.Param) and stmt.name.text in literals:
            span = stmt.default.span
            text = text[: span.start] + literals[stmt.name.text] + text[span.end :]
    return text
