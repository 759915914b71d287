"""The words and the space of a document's model; values, matrices and chains in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import Any

from scenelang.evaluate.values.value import POISON, Angle, MaterialValue, RangeValue, Time, Vec, pack, show
from scenelang.graph import affine
from scenelang.graph.chain import merged
from scenelang.graph.lower import step_of
from scenelang.graph.nodes import Move
from scenelang.graph.space import Refusal, Space
from scenelang.graph.spaces import SPACES
from scenelang.graph.steps import Affine, Rows, Step, Warp
from scenelang.lsp.workspace import Document
from scenelang.models.manifest import load_manifest
from scenelang.scene import text as to_nsg
from scenelang.syntax import nodes
from scenelang.words import LEAVES, TRANSFORMS

_MOST_ITEMS = 8


def dimensions_of(document: Document) -> tuple[int, ...]:
    """The dimension of the model that a document names; both where it names none."""
    for stmt in document.file.statements:
        if isinstance(stmt, nodes.Model) and isinstance(stmt.name, nodes.String):
            with suppress(KeyError):
                return (load_manifest(stmt.name.value).dimension,)
    return (*LEAVES,)


def space_of(document: Document) -> Space:
    """The space of the model which draws a document."""
    if document.checked is not None and document.checked.manifest is not None:
        return SPACES[document.checked.manifest.dimension]
    return SPACES[dimensions_of(document)[0]]


def show_value(value: Any) -> str | None:
    """A value as one would write it; None for one that a mistake has made unknown."""
    cls = value.__class__
    if value is POISON:
        return None
    if isinstance(value, float):
        return show(value)
    if cls is bool:
        return "true" if value else "false"
    if cls is str:
        short: str = value if len(value) <= 60 else value[:57] + "…"
        return '"' + short.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if cls is Angle:
        return f"{show(round(math.degrees(value.size), 6))}deg"
    if cls is Time:
        return f"{show(value.size)}s"
    if cls is Vec:
        items = [show_value(item) or "?" for item in value.items[:_MOST_ITEMS]]
        more = [f"… {len(value.items)} items"] if len(value.items) > _MOST_ITEMS else []
        return f"[{', '.join([*items, *more])}]"
    if cls is RangeValue:
        ends = [show_value(pack(x, value.unit)) or "?" for x in (value.start, value.stop)]
        step = "" if value.step is None else f" step {show_value(pack(value.step, value.unit))}"
        return f"{ends[0]}{'..<' if value.exclusive else '..'}{ends[1]}{step}"
    if cls is MaterialValue:
        return to_nsg.material(value.material).rstrip(";")
    return "none" if value is None else None


def show_matrix(rows: Rows, space: Space) -> str:
    """The 3 × 3 matrix of a map of the plane, or the 4 × 4 one of space."""
    table = [[rows[at] for at in row] for row in space.shown]
    table.append([0.0] * space.dimension + [1.0])
    cells = [[f"{value + 0.0:.4g}" for value in row] for row in table]
    width = max(len(cell) for row in cells for cell in row)
    return "\n".join("[ " + "  ".join(cell.rjust(width) for cell in row) + " ]" for row in cells)


def show_warp(warp: Warp) -> str:
    """How a point goes back through a warp, in a formula."""
    terms = []
    if warp.twirl:
        terms.append(f"{show(warp.twirl)} |p|")
    for factor, name in zip(warp.bend, ("p.x", "p.y"), strict=True):
        if factor:
            terms.append(f"{show(factor)} {name}")
    angle = " + ".join(terms) or "0"
    return f"p → R({angle}) p"


def show_transform(node: Any, space: Space) -> str | None:
    """The matrix or the formula of a geometry transform; None for what is neither."""
    if node.kind not in TRANSFORMS:
        return None
    return next(_shown(_steps((node,), space), space), None)


def show_chain(transforms: tuple[Any, ...], space: Space) -> list[str]:
    """A chain of transforms after composing its neighbouring affine maps: matrices and formulas in order."""
    return list(_shown([move.step for move in merged(map(Move, _steps(transforms, space)))], space))


def show_stretch(transforms: tuple[Any, ...], space: Space) -> str:
    """How much the affine maps of a chain scale, at least and at most."""
    low, high = space.stretches(affine.composed(_steps(transforms, space)))
    return show(low) if abs(low - high) < 1e-9 * max(high, 1.0) else f"{show(low)} to {show(high)}"


def _steps(transforms: Iterable[Any], space: Space) -> list[Step]:
    """The steps of transforms, without those that have none."""
    found = [step_of(transform, space) for transform in transforms]
    return [step for step in found if not isinstance(step, Refusal)]


def _shown(steps: Iterable[Step], space: Space) -> Iterator[str]:
    for step in steps:
        if isinstance(step, Affine):
            yield show_matrix(step.rows, space)
        elif isinstance(step, Warp):
            yield show_warp(step)
