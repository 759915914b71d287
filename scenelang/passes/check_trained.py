"""Warnings where a scene lies outside what its model was trained or measured in."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from scenelang.graph import affine
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.space import Space
from scenelang.graph.steps import Warp
from scenelang.graph.walk import leaves
from scenelang.models.manifest import Manifest
from scenelang.passes.context import Context

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


@dataclass(slots=True)
class _Worst:
    """The object furthest outside one range, and how many there are."""

    value: float
    excess: float
    leaf: Leaf
    count: int = 0


def check_trained(graph: Graph, context: Context) -> Graph:
    """Warn once for each quantity outside its trained or measured range, at the object furthest out.

    Deformations are measured in the normal form, per unit length of the space they act in; the scale of an
    object is each of the two stretches of its affine maps, and how thin it is their ratio.

    Before: STREAM. After: unchanged.
    """
    manifest, worst, count = context.manifest, dict[str, _Worst](), 0
    for leaf in leaves(graph.root):
        count += 1
        for quantity, value in _noted(leaf, graph.space):
            _note(worst, quantity, value, leaf, manifest)
    for quantity, subject in _SUBJECTS.items():
        if (found := worst.get(quantity)) is not None:
            said = subject.format(name=f"`{found.leaf.geometry}`", value=f"{found.value:.3g}")
            others = f", as {found.count - 1:,} more are" if found.count > 1 else ""
            _warn(context, quantity, f"{said} is outside the measured range {{}}{others}", found.leaf)
    smooth = [link.node for link in graph.root.links if link.op == "smooth"]
    if "smooth" in manifest.trained and len(smooth) > manifest.trained["smooth"][1]:
        last = next((node for node in reversed(smooth) if isinstance(node, Leaf)), None)
        _warn(context, "smooth", f"{len(smooth):,} smooth unions are outside the measured range {{}}", last)
    if smooth and "blend" in manifest.trained:
        _check_blends(graph, context)
    limits = manifest.trained.get("objects")
    if limits is not None and count > limits[1]:
        last = next((link.node for link in reversed(graph.root.links) if isinstance(link.node, Leaf)), None)
        _warn(context, "objects", f"{count:,} objects are outside the measured range {{}}", last)
    return graph


def _check_blends(graph: Graph, context: Context) -> None:
    """Warn at the `smooth` whose colours lie furthest apart for its size.

    Where a blend's distances are off, by a share of the objects' scale, its colour is off by that share of
    what the colours differ by: the product of both tells the error.
    """
    low, high, largest = [1.0] * 3, [0.0] * 3, 0.0
    worst: tuple[float, float, float, Leaf] | None = None
    for link in graph.root.links:
        leaf = link.node
        if not isinstance(leaf, Leaf) or link.op not in ("union", "smooth"):
            continue
        largest = max(largest, _noted(leaf, graph.space)[0][1])
        rgb = leaf.look.colour()
        low, high = list(map(min, low, rgb)), list(map(max, high, rgb))
        if link.op == "smooth":
            contrast = max(max(c - a, b - c) for a, b, c in zip(low, high, rgb, strict=True))
            if worst is None or contrast * largest > worst[0]:
                worst = contrast * largest, contrast, largest, leaf
    if worst is not None and worst[0] > context.manifest.trained["blend"][1]:
        product, contrast, scale, leaf = worst
        said = f"a `smooth` of colours {contrast:.2g} apart at a scale of {scale:.3g}"
        _warn(context, "blend", f"{said}: the product {product:.3g} is outside the measured range {{}}", leaf)


def _noted(leaf: Leaf, space: Space) -> list[tuple[str, float]]:
    if leaf.notes is None:
        return _measures(leaf, space)
    found: list[tuple[str, float]] | None = leaf.notes.get("measures")
    if found is None:
        found = leaf.notes["measures"] = _measures(leaf, space)
    return found


def _measures(leaf: Leaf, space: Space) -> list[tuple[str, float]]:
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


def _note(worst: dict[str, _Worst], quantity: str, value: float, leaf: Leaf, manifest: Manifest) -> None:
    limits = manifest.trained.get(quantity)
    if limits is None:
        return
    low, high = limits
    excess = max(low - value, value - high) / ((high - low) or 1.0)
    if excess <= _TOLERANCE:
        return
    seen = worst.get(quantity)
    if seen is None:
        worst[quantity] = _Worst(value, excess, leaf, 1)
        return
    if leaf is not seen.leaf:
        seen.count += 1
    if excess > seen.excess:
        seen.value, seen.excess, seen.leaf = value, excess, leaf


def _warn(context: Context, quantity: str, message: str, leaf: Leaf | None) -> None:
    low, high = context.manifest.trained[quantity]
    figures = context.manifest.measured.get("stability", {}).get(quantity)
    context.diagnostics.add(
        _CODES[quantity],
        message.format(f"{low:g} to {high:g} of model `{context.manifest.name}`"),
        leaf.span if leaf is not None else None,
        help=f"measured there: {figures}"
        if figures
        else "the picture may be less exact than the model's figures",
    )
