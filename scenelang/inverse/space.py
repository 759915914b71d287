"""Params as the axes of a box to search in, and values of them as a scene's text has them.

A point holds a number for each axis: of a continuous one in [0, 1], of others the index of a choice. A vector
has an axis for each of its numbers.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.evaluate.evaluation import Evaluation
from scenelang.evaluate.ranges import (
    Axis,
    Knob,
    ParamError,
    knob_of,
    param_named,
    params_of,
    value_at,
    written,
)
from scenelang.evaluate.values.value import Vec, unpack
from scenelang.fitting.mesh import FitError

Point = npt.NDArray[np.float64]
MOST_AXES: Final = 64


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

    def beside(self, axis: Axis) -> Space:
        """The same box with a continuous axis that belongs to no param, behind the others."""
        wide = copy.copy(self)
        wide.axes = (*self.axes, axis)
        wide.smooth, wide.most = np.append(self.smooth, True), np.append(self.most, 1.0)
        wide.wraps = np.append(self.wraps, axis.wraps)
        return wide

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
            items = [value_at(*next(rest), knob.value) for _ in knob.axes]
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


def space_of(evaluation: Evaluation, names: Iterable[str] = (), fixed: Iterable[str] = ()) -> Space:
    """The box of a scene's params.

    Args:
        evaluation: of the scene, after a run.
        names: the params; by default all that have a range.
        fixed: those that keep their value.

    Raises:
        FitError: there is no such param, or it has no values to search among.
    """
    try:
        named = [param_named(evaluation, name) for name in dict.fromkeys(names)]
        chosen = named or [stmt for stmt in params_of(evaluation).values() if stmt.range is not None]
        kept = set(fixed)
        space = Space([knob_of(stmt, evaluation.context) for stmt in chosen if stmt.name.text not in kept])
    except ParamError as error:
        raise FitError(str(error)) from None
    if not space.axes:
        raise FitError("no param to fit: give one a range, as in `param k = 0.5 in 0..1;`, or name some")
    if len(space.axes) > MOST_AXES:
        raise FitError(f"{len(space.axes)} numbers to fit, where at most {MOST_AXES} are")
    return space
