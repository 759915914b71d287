"""Warnings where a scene lies outside what its model was trained or measured in."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import hypot
from operator import itemgetter

from scenelang.graph import affine
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.space import Space
from scenelang.graph.steps import Warp
from scenelang.passes.context import Context
from scenelang.words import Combine

Measures = list[tuple[str, float]]

_CODES = {
    "objects": "W0501",
    "twirl": "W0502",
    "bend": "W0503",
    "scale": "W0504",
    "smooth": "W0505",
    "thin": "W0506",
    "blend": "W0507",
}
_SUBJECTS = {
    "twirl": "a `twirl` of {value} on {name}",
    "bend": "a `bend` of {value} on {name}",
    "scale": "a scale of {value} of {name}",
    "thin": "{name}, {value} times as long as wide,",
}
"""What is said of an object, in the order of the warnings."""
_TOLERANCE = 1e-9


def check_trained(graph: Graph, context: Context) -> Graph:
    """Warn once for each quantity outside its trained or measured range, at the object furthest out.

    Deformations are measured in the normal form, per unit length of the space they act in; the scale of an
    object is each of the two stretches of its affine maps, and how thin it is their ratio.

    Before: STREAM. After: unchanged.
    """
    rows, trained = graph.rows(), context.manifest.trained
    measures = partial(_measures, space=graph.space)
    outside: dict[str, list[tuple[float, float, Leaf]]] = {}  # (by how much, value, object)
    for _, leaf in rows:
        for quantity, value in leaf.noted("measures", measures):
            if quantity in trained:
                low, high = trained[quantity]
                excess = max(low - value, value - high) / ((high - low) or 1.0)
                if excess > _TOLERANCE:
                    outside.setdefault(quantity, []).append((excess, value, leaf))
    for quantity, subject in _SUBJECTS.items():
        if found := outside.get(quantity):
            _, value, leaf = max(found, key=itemgetter(0))
            more = len({id(leaf) for *_, leaf in found}) - 1
            said = subject.format(name=f"`{leaf.geometry}`", value=f"{value:.3g}")
            others = f", as {more:,} more are" if more else ""
            _warn(context, quantity, f"{said} is outside the measured range {{}}{others}", leaf)
    smooth = [leaf for op, leaf in rows if op == "smooth"]
    if "smooth" in trained and len(smooth) > trained["smooth"][1]:
        fact = f"{len(smooth):,} smooth unions are outside the measured range {{}}"
        _warn(context, "smooth", fact, smooth[-1])
    if smooth and "blend" in trained:
        _check_blends(rows, measures, context)
    if "objects" in trained and len(rows) > trained["objects"][1]:
        fact = f"{len(rows):,} objects are outside the measured range {{}}"
        _warn(context, "objects", fact, rows[-1][1])
    return graph


def _check_blends(
    rows: list[tuple[Combine, Leaf]], measures: Callable[[Leaf], Measures], context: Context
) -> None:
    """Warn at the `smooth` whose colours lie furthest apart for its size.

    Where a blend's distances are off, by a share of the objects' scale, its colour is off by that share of
    what the colours differ by: the product of both tells the error.
    """
    low, high, largest = [1.0] * 3, [0.0] * 3, 0.0
    worst: tuple[float, float, float, Leaf] | None = None
    for op, leaf in rows:
        if op not in ("union", "smooth"):
            continue
        largest = max(largest, leaf.noted("measures", measures)[0][1])
        rgb = leaf.look.colour()
        low, high = list(map(min, low, rgb)), list(map(max, high, rgb))
        if op == "smooth":
            contrast = max(max(c - a, b - c) for a, b, c in zip(low, high, rgb, strict=True))
            if worst is None or contrast * largest > worst[0]:
                worst = contrast * largest, contrast, largest, leaf
    if worst is not None and worst[0] > context.manifest.trained["blend"][1]:
        product, contrast, scale, leaf = worst
        said = f"a `smooth` of colours {contrast:.2g} apart at a scale of {scale:.3g}"
        _warn(context, "blend", f"{said}: the product {product:.3g} is outside the measured range {{}}", leaf)


def _measures(leaf: Leaf, space: Space) -> Measures:
    smallest, largest = space.stretches(affine.composed(leaf.steps))
    found = [("scale", smallest), ("scale", largest)]
    if smallest > 0:
        found.append(("thin", largest / smallest))
    for move in leaf.moves:
        if isinstance(move.step, Warp):
            if move.step.twirl:
                found.append(("twirl", move.step.twirl))
            if move.step.bend != (0.0, 0.0):
                found.append(("bend", hypot(*move.step.bend)))
    return found


def _warn(context: Context, quantity: str, message: str, leaf: Leaf) -> None:
    low, high = context.manifest.trained[quantity]
    figures = context.manifest.measured.get("stability", {}).get(quantity)
    context.diagnostics.add(
        _CODES[quantity],
        message.format(f"{low:g} to {high:g} of model `{context.manifest.name}`"),
        leaf.span,
        help=f"measured there: {figures}"
        if figures
        else "the picture may be less exact than the model's figures",
    )
