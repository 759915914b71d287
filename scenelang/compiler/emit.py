"""Stream to Program: chains are lifted, operators become tokens, boxes become bounds."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import Element, Gradient
from scenelang.compiler.chain import split_levels
from scenelang.compiler.graph import Fold, Graph, Later, Leaf, Row
from scenelang.compiler.groups import BEGINS, ENDS
from scenelang.compiler.lifting import (
    LAYOUTS,
    WIDTH,
    lift_colours,
    lift_geometry,
    lift_many,
    lift_material,
    texture_frame,
)
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.program import Paint, Place, Program, ProgramError
from scenelang.compiler.spaces import SPACES
from scenelang.compiler.weights import Codes
from scenelang.language.diagnostics import Span
from scenelang.language.words import TOKENS

Bound = tuple[float, float, float, float]


def emit(graph: Graph, manifest: Manifest, codes: Codes) -> Program:
    """The Program of a stream without errors; raises `ProgramError` for a lifting that is not known."""
    if manifest.lifting != "exact" and codes.lifting is None:
        raise ProgramError(f"model `{manifest.name}` needs the lifting `{manifest.lifting}`")
    rows = graph.rows()
    leaves = [row.leaf for row in rows]
    listed = sorted({leaf.geometry for leaf in leaves} & graph.elements.keys())
    forms = {name: at for at, name in enumerate(listed)}
    palette, worn = _palette(leaves)
    materials = dict.fromkeys(paint.element for paint in palette if isinstance(paint.element, Element))
    vectors = _vectors(leaves, manifest, codes)
    for at, row in enumerate(rows):
        if row.k and row.op != "union":  # a width that is not the usual one belongs to a row, not to a leaf
            vectors[at, LAYOUTS[manifest.dimension].places.width] = row.k
    return Program(
        vectors=vectors,
        tokens=tokens_of(rows),
        bounds=_bounds(graph),
        canvas=graph.canvas,
        background=graph.background,
        stage=graph.stage,
        model=manifest.name,
        weights=codes.digest,
        objects=tuple([leaf.called for leaf in leaves]),
        places=places_of([leaf.span for leaf in leaves]),
        numbers=tuple([leaf.number or at for at, leaf in enumerate(leaves, 1)]),
        elements=(*[graph.elements[name] for name in listed], *materials),
        forms=np.array([forms.get(leaf.geometry, -1) for leaf in leaves], dtype=np.int32),
        palette=palette,
        worn=worn,
        samples=graph.samples,
    )


def tokens_of(rows: list[Row]) -> npt.NDArray[np.int8]:
    return np.array([TOKENS[r.op] | BEGINS * r.begins | r.ends << ENDS for r in rows], dtype=np.int8)


def _palette(leaves: list[Leaf]) -> tuple[tuple[Paint, ...], npt.NDArray[np.int32]]:
    """The paints of rows, in the order of first rows, and the index of each row's paint, -1 for none."""
    result: dict[Paint, int] = {}
    known: dict[int, int] = {}
    for look in {id(leaf.look): leaf.look for leaf in leaves}.values():
        known[id(look)] = -1
        if look.element is not None:
            steps = [(kind, *_rounded(numbers)) for kind, *numbers in look.colours]
            element = look.element
            if isinstance(element, Gradient):
                element = Gradient(element.name, tuple(map(_rounded, element.stops)))
            paint = Paint(element, tuple(steps), _rounded(texture_frame(look.moved)[1]))
            known[id(look)] = result.setdefault(paint, len(result))
    return tuple(result), np.array([known[id(leaf.look)] for leaf in leaves], np.int32)


def _rounded(numbers: Sequence[float]) -> Any:
    """Numbers in float32."""
    return tuple(np.asarray(numbers, np.float32).tolist())


def _vectors(leaves: list[Leaf], manifest: Manifest, codes: Codes) -> npt.NDArray[np.float32]:
    """Vectors (N, 64). Leaves that stay from frame to frame note theirs; a row depends on nothing else."""
    note = "vector", codes.digest
    known = {id(leaf): leaf.notes[note] for leaf in leaves if leaf.notes and note in leaf.notes}
    fresh = [leaf for leaf in leaves if id(leaf) not in known]
    lifted = _lifted(fresh, manifest, codes)
    for leaf, vector in zip(fresh, lifted, strict=True):
        if leaf.notes is not None:
            leaf.notes[note] = vector.copy()
    if not known:
        return lifted
    known |= {id(leaf): vector for leaf, vector in zip(fresh, lifted, strict=True)}
    return np.stack([known[id(leaf)] for leaf in leaves])


def _lifted(leaves: list[Leaf], manifest: Manifest, codes: Codes) -> npt.NDArray[np.float32]:
    if not leaves:
        return np.zeros((0, WIDTH), np.float32)
    chains, colours = [leaf.steps for leaf in leaves], [leaf.look.rgb for leaf in leaves]
    if codes.lifting is not None:
        geometries = [manifest.geometries.index(leaf.geometry) for leaf in leaves]
        materials = [manifest.materials.index(leaf.look.material) for leaf in leaves]
        geometry = lift_geometry(codes.lifting, chains, geometries)
        material = lift_material(codes.lifting, colours, materials)
        vectors = np.concatenate([geometry, material], 1)
    else:
        layout, space = LAYOUTS[manifest.dimension], SPACES[manifest.dimension]
        levels = [split_levels(chain, manifest.limits, space) for chain in chains]
        nothing = (0.0,) * 4  # a row of an element names it by `forms`
        shapes = [codes.geometry.get(leaf.geometry, nothing) for leaf in leaves]
        painted = [codes.material[leaf.look.material] for leaf in leaves]
        moved, opacities = [leaf.look.moved for leaf in leaves], [leaf.look.opacity for leaf in leaves]
        looks = [leaf.look for leaf in leaves]
        more = () if all(look.matte for look in looks) else ("density", "roughness", "glow")
        lights = {name: [getattr(look, name) for look in looks] for name in more}
        vectors = lift_colours(colours, painted, layout, moved, opacities, **lights)
        vectors += lift_many(levels, shapes, layout)  # these fill other places of the vectors
    if (width := vectors.shape[1]) != WIDTH:
        raise ProgramError(f"model `{manifest.name}` lifts to {width} numbers, not {WIDTH}")
    # one zero only, so that equal scenes give equal bytes
    return vectors.astype(np.float32) + np.float32(0.0)


def _bounds(graph: Graph) -> npt.NDArray[np.float32]:
    """Boxes (N, 4) of the plane, or balls of space, outside which a row makes no difference."""
    result: list[Bound | None] = []

    def bound_of(leaf: Leaf, level: float) -> Bound:
        key = "bound", level
        return leaf.noted(key, lambda leaf: graph.space.bound(leaf.geometry, leaf.steps, level))

    def bound(fold: Fold, later: Later, joins: bool) -> None:
        for index in range(len(fold.links) - 1, -1, -1):
            link = fold.links[index]
            own = later.of(link.op, link.width)
            if isinstance(link.node, Fold):
                bound(link.node, own, link.op == "intersect")
            else:
                level, everywhere = own.level, link.op == "intersect" or (index == 0 and joins)
                result.append(None if everywhere or level is None else bound_of(link.node, level))
            later = later.before(link.op, link.width)

    bound(graph.root, Later(), False)
    whole = graph.window()[:4]
    if graph.stage is not None:
        reach = max((hypot(*b[:3]) + b[3] for b in result if b is not None), default=0.0)
        whole = 0.0, 0.0, 0.0, reach * (1.0 + 2.0**-20)  # around all others, with room for rounding
    exact = np.array([b or whole for b in result[::-1]], dtype=np.float64).reshape(len(result), 4)
    most = np.finfo(np.float32).max
    rounded = np.clip(exact, -most, most).astype(np.float32)
    if graph.stage is not None:
        # A centre that is rounded moves by less than 2^-24 of itself.
        rounded[:, 3] = np.clip(exact[:, 3] + 2.0**-22 * (1.0 + abs(exact).sum(1)), 0.0, most)
        return rounded
    # Rounding to float32 may not shrink a box.
    low = np.where(rounded[:, :2] > exact[:, :2], np.nextafter(rounded[:, :2], -most), rounded[:, :2])
    high = np.where(rounded[:, 2:] < exact[:, 2:], np.nextafter(rounded[:, 2:], most), rounded[:, 2:])
    return np.concatenate([low, high], axis=1).astype(np.float32)


def places_of(spans: list[Span | None]) -> tuple[Place | None, ...]:
    known: dict[tuple[str, int, int] | None, Place | None] = {None: None}
    keys = [None if span is None else (span.source.name, span.start, span.end) for span in spans]
    for key, span in zip(keys, spans, strict=True):
        if span is not None and key not in known:
            start, end = span.locate()
            known[key] = Place(span.source.name, *start, *end)
    return tuple([known[key] for key in keys])
