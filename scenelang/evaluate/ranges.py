"""Params as values to choose among, and values of them as a scene's text has them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any, Final

from scenelang.diagnostics.suggest import listing, nearest
from scenelang.evaluate.evaluation import Evaluation
from scenelang.evaluate.file_context import FileContext, Place
from scenelang.evaluate.prepare.expressions import prepare
from scenelang.evaluate.values.value import Angle, RangeValue, Time, Vec, unpack
from scenelang.records import Record
from scenelang.scene.text import hex_colour, number
from scenelang.syntax import nodes

MOST_CHOICES: Final = 1000
_UNITS: Final = {"deg": 180 / math.pi, "rad": 1.0, "turn": 0.5 / math.pi, "s": 1.0, "ms": 1000.0}
_DIGITS: Final = 4


class ParamError(ValueError):
    """No such param, or one without values to choose among."""


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


def params_of(evaluation: Evaluation) -> dict[str, nodes.Param]:
    """The params of the file itself, by name; those of imports are other files'."""
    return {stmt.name.text: stmt for stmt in evaluation.file.statements if isinstance(stmt, nodes.Param)}


def param_named(evaluation: Evaluation, name: str) -> nodes.Param:
    """A param of the file itself; raises `ParamError` without one."""
    known = params_of(evaluation)
    if name in known:
        return known[name]
    near = nearest(name, known)
    help = f"did you mean `{near}`?" if near else f"its params are {listing(known)}" if known else ""
    raise ParamError(f"no param `{name}` in `{evaluation.file.span.source.name}`" + f"; {help}" * bool(help))


def knob_of(stmt: nodes.Param, file: FileContext) -> Knob:
    """What a param may be set to, after a run; raises `ParamError` where nothing says so."""
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
        raise ParamError(f"param `{name}` has no range; give it one, as in `param {name} = … in 0..1;`")
    return Knob(stmt, value, (_axis(name, allowed),), False)


def check_width(name: str, low: float, high: float) -> None:
    """Raise `ParamError` for a range without values between its ends that can be computed and written."""
    if not math.isfinite((high - low) * max(_UNITS.values())):
        raise ParamError(f"the range of param `{name}` is too wide: from {low:.6g} to {high:.6g}")


def _axis(label: str, allowed: RangeValue) -> Axis:
    check_width(label, allowed.start, allowed.stop)
    if allowed.step is not None and math.isinf((allowed.stop - allowed.start) / allowed.step):
        raise ParamError(f"param `{label}` has more than {MOST_CHOICES:,} steps")
    if allowed.step is not None:
        if allowed.count() > MOST_CHOICES:
            raise ParamError(f"param `{label}` has more than {MOST_CHOICES:,} steps")
        return Axis(label, choices=_few(label, tuple(allowed)))
    low, high = allowed.start, allowed.stop
    if allowed.exclusive:
        high -= 1e-9 * (high - low)
    turn = allowed.unit == "angle" and math.isclose(high - low, 2 * math.pi, rel_tol=1e-6)
    return Axis(label, low, high, wraps=turn)


def _few(name: str, choices: tuple[Any, ...]) -> tuple[Any, ...]:
    if not 0 < len(choices) <= MOST_CHOICES:
        raise ParamError(
            f"param `{name}` has {len(choices):,} choices, where 1 to {MOST_CHOICES:,} can be tried"
        )
    return choices


def is_colour(expr: nodes.Expr) -> bool:
    """Whether an expression is written as a colour."""
    return isinstance(expr, nodes.Color) or (
        isinstance(expr, nodes.CallExpr) and expr.name.text in ("rgb", "hsv")
    )


def value_at(axis: Axis, u: float, like: Any) -> Any:
    """The value at a place of an axis, of the kind that the default's numbers are of."""
    if axis.choices:
        return axis.choices[round(u)]
    if like.__class__ is Vec:
        like = like.items[0]
    x = axis.low + u * (axis.high - axis.low)
    return like.__class__(x) if like.__class__ in (Angle, Time) else x


# ---------------------------------------------------------------- values as text


def written(knob: Knob, value: Any, digits: int = _DIGITS) -> str:
    """A value as its statement would have it: in the default's unit, with digits enough for its range.

    Args:
        digits: decimal places, of the range's width.
    """
    if not knob.inner:
        return _literal(value, knob.axes[0], knob.stmt.default, digits)
    if is_colour(knob.stmt.default):
        r, g, b = (min(255, max(0, round(255 * item))) / 255 for item in value.items)
        return hex_colour((r, g, b)) or ""
    items = zip(value.items, knob.axes, strict=True)
    return f"[{', '.join(_literal(item, axis, knob.stmt.default, digits) for item, axis in items)}]"


def _literal(value: Any, axis: Axis, default: nodes.Expr, digits: int) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if value.__class__ is Vec:
        colour = tuple(item for item in value.items if isinstance(item, float))
        if len(colour) == len(value.items) == 3 and (text := hex_colour(colour)):
            return text
        return f"[{', '.join(_literal(item, axis, default, digits) for item in value.items)}]"
    x, kind = unpack(value)
    unit = ""
    if kind != "number":
        units = (node.unit for node in nodes.walk(default) if isinstance(node, nodes.Number))
        unit = next(filter(None, units), "deg" if kind == "angle" else "s")
    factor = _UNITS.get(unit, 1.0)
    if axis.choices:
        return number(round(x * factor, 9)) + unit
    width = (axis.high - axis.low) * factor
    places = max(0, digits - math.floor(math.log10(width))) if width > 0 else 9
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
