"""Scenes as forms: their own program as JSON, for the evaluator that runs in a page.

A form is what is left of the syntax trees of a scene's files without places and what is never used, with
names resolved. An expression is a number, a boolean, or a list of a word and its operands; a statement is a
list likewise; a block is a list of statements. ``["g", slot]`` is a variable of a file, and ``["v", hops,
slot]`` one of the call so many definitions further out. ``web/evaluate.js`` has what each word means.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, Final

from scenelang.deep import deep_stack
from scenelang.elements.element import Element
from scenelang.evaluate.evaluation import Evaluation
from scenelang.evaluate.file_context import FileContext, Place
from scenelang.evaluate.prepare.expressions import prepare
from scenelang.evaluate.values.value import Angle, RangeValue, Time, Vec, unpack
from scenelang.models.manifest import Manifest
from scenelang.records import Record
from scenelang.syntax import nodes
from scenelang.viewer.names import Json, Scope
from scenelang.viewer.trees import Writer

_KINDS: Final = {float: "number", Angle: "angle", Time: "time", bool: "bool", str: "string"}
_WHY: Final = {
    "canvas": "the size of the canvas depends on it",
    "animate": "the length of the animation depends on it",
}
_LABEL: Final = re.compile(r"[ \t)]*;[ \t]*//[ \t]*([^\n]*)")


class Form(Record):
    """A scene's form and what belongs to it in a view.

    Args:
        data: JSON for ``evaluateForm``.
        params: JSON of params that matter to the picture: their values, in radians and seconds, and ranges.
        fixed: names of those that no page can change, and why.
        shapes, paints: elements that rows name by their places, shapes behind the model's geometries.
    """

    data: Json
    params: list[Json]
    fixed: list[Json]
    shapes: tuple[Element, ...]
    paints: tuple[Element, ...]


def form_of(evaluation: Evaluation, manifest: Manifest, elements: Iterable[Element] = ()) -> Form:
    """The form of a scene that was evaluated without errors.

    Args:
        evaluation: after a run, whose values params start from.
        manifest: the model that draws the page.
        elements: those of the Program of that run; they come first among shapes and paints, in their order.
    """
    writer, reasons = Writer(evaluation.context, manifest, elements), dict[str, str]()
    with deep_stack():
        lines = writer.file(evaluation.context, evaluation.file, Scope(), imported=False)
        needed = writer.reached(bound for line in lines if line.bound is None for bound in line.uses)
        for word, uses in writer.lengths.items():
            reached = writer.reached(uses)
            reasons |= {name: _WHY[word] for name, _, _, bound in writer.params if id(bound) in reached}
    data = {
        "model": manifest.name,
        "dimension": manifest.dimension,
        "body": [line.form for line in lines if line.bound is None or id(line.bound) in needed],
        "animates": evaluation.animates,
        "slots": writer.slots,
        "calls": writer.calls,
        "plain": 0,
        "media": [at for at, name in enumerate(manifest.materials) if name == "volumetric"],
        "geometries": manifest.geometries,
        "spatial": [int(paint.dimension == 3) for paint in writer.paints],
        "blends": manifest.any_blend,
        "turns": [manifest.limits.get("inner_warps", 0), manifest.limits.get("outer_warps", 0)],
    }
    shown = [one for one in writer.params if id(one[3]) in needed or one[0] in reasons]
    return Form(
        data,
        [param_data(name, stmt, file) for name, stmt, file, _ in shown],
        [{"name": name, "reason": reason} for name, reason in reasons.items()],
        tuple(writer.shapes),
        tuple(writer.paints),
    )


def param_data(name: str, stmt: nodes.Param, file: FileContext) -> dict[str, Any]:
    """What a page has to know of a param to offer it."""
    value = file.env[file.scope.names[stmt.name.text].slot]
    data: dict[str, Any] = {"name": name, "kind": _kind(value, stmt.default), "value": _json(value)}
    if stmt.range is not None:
        allowed = prepare(stmt.range, Place(file, file.scope, "file")).run(file.env)
        if isinstance(allowed, Vec):
            data["choices"] = _json(allowed)
        elif isinstance(allowed, RangeValue):
            data |= _bounds(allowed)
    if isinstance(value, Angle | Time):
        units = (node.unit for node in nodes.walk(stmt.default) if isinstance(node, nodes.Number))
        data["unit"] = next(filter(None, units), "deg" if isinstance(value, Angle) else "s")
    if label := _LABEL.match(stmt.span.source.text, (stmt.range or stmt.default).span.end):
        data["label"] = label[1].strip()
    return data


def _bounds(allowed: RangeValue) -> dict[str, Any]:
    """The least and the greatest value; a stepped range may go downwards, and need not reach its end."""
    if allowed.step is None:
        bounds = {"low": allowed.start, "high": allowed.stop}
        return {**bounds, "exclusive": True} if allowed.exclusive else bounds
    ends = sorted((allowed.start, allowed.at(max(0, allowed.count() - 1))))
    return {"low": ends[0], "high": ends[1], "step": abs(allowed.step)}


def _kind(value: Any, default: nodes.Expr) -> str:
    if not isinstance(value, Vec):
        return _KINDS[value.__class__]
    colours = isinstance(default, nodes.Color) or (
        isinstance(default, nodes.CallExpr) and default.name.text in ("rgb", "hsv")
    )
    return "color" if colours else "vector"


def _json(value: Any) -> Json:
    if isinstance(value, Vec):
        return [_json(item) for item in value.items]
    return value if isinstance(value, bool | str) else unpack(value)[0]
