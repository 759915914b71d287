"""Stream to Program: chains are lifted, operators become tokens, boxes become bounds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scenelang.diagnostics.span import Span
from scenelang.graph.bounds import felt_level, leaf_box
from scenelang.graph.chain import split_levels
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.space import Box
from scenelang.lifting.exact import lift_colours, lift_many
from scenelang.lifting.layout import LAYOUTS, WIDTH
from scenelang.lifting.learned import lift_geometry, lift_material
from scenelang.models.manifest import Manifest
from scenelang.models.weights import Codes
from scenelang.program.program import Place, Program, ProgramError
from scenelang.words import TOKENS, Combine

Rows = list[tuple[Combine, Leaf]]


def emit(graph: Graph, manifest: Manifest, codes: Codes) -> Program:
    """The Program of a stream that all passes have left without errors.

    Raises:
        ProgramError: the model's lifting is not one of this version.
    """
    if manifest.lifting != "exact" and codes.lifting is None:
        raise ProgramError(f"model `{manifest.name}` needs the lifting `{manifest.lifting}`")
    rows = graph.rows()
    leaves = [leaf for _, leaf in rows]
    return Program(
        vectors=_vectors(leaves, manifest, codes),
        tokens=np.array([TOKENS[op] for op, _ in rows], dtype=np.int8),
        bounds=_bounds(rows, graph),
        canvas=graph.canvas,
        background=graph.background,
        model=manifest.name,
        weights=codes.digest,
        objects=tuple([leaf.geometry for leaf in leaves]),
        places=_places([leaf.span for leaf in leaves]),
    )


def _vectors(leaves: list[Leaf], manifest: Manifest, codes: Codes) -> npt.NDArray[np.float32]:
    """Vectors (N, 64). Leaves that stay from frame to frame note theirs; a row depends on nothing else."""
    note = "vector", codes.digest
    known = {id(leaf): leaf.notes[note] for leaf in leaves if leaf.notes and note in leaf.notes}
    fresh = [leaf for leaf in leaves if id(leaf) not in known]
    made = _lifted(fresh, manifest, codes)
    for leaf, vector in zip(fresh, made, strict=True):
        if leaf.notes is not None:
            leaf.notes[note] = vector.copy()
    if not known:
        return made
    known |= {id(leaf): vector for leaf, vector in zip(fresh, made, strict=True)}
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
    else:
        layout, levels = LAYOUTS[manifest.layout], [split_levels(chain, manifest.limits) for chain in chains]
        geometry = lift_many(levels, [codes.geometry[leaf.geometry] for leaf in leaves], layout)
        material = lift_colours(colours, [codes.material[leaf.look.material] for leaf in leaves], layout)
    vectors = np.concatenate([geometry, material], 1)
    if (width := vectors.shape[1]) != WIDTH:
        raise ProgramError(f"model `{manifest.name}` lifts to {width} numbers, not {WIDTH}")
    # one zero only, so that equal scenes give equal bytes
    return vectors.astype(np.float32) + np.float32(0.0)


def _bounds(rows: Rows, graph: Graph) -> npt.NDArray[np.float32]:
    window = graph.window()
    boxes: list[Box] = []
    smooths = 0
    for op, leaf in reversed(rows):
        level = felt_level(op, smooths)
        everywhere = level is None or op == "intersect"
        boxes.append(window if everywhere else leaf_box(leaf, level or 0.0, graph.space))
        smooths += op == "smooth"
    exact = np.array(boxes[::-1], dtype=np.float64).reshape(len(rows), 4)
    most = np.finfo(np.float32).max
    rounded = np.clip(exact, -most, most).astype(np.float32)
    # Rounding to float32 may not shrink a box.
    low = np.where(rounded[:, :2] > exact[:, :2], np.nextafter(rounded[:, :2], -most), rounded[:, :2])
    high = np.where(rounded[:, 2:] < exact[:, 2:], np.nextafter(rounded[:, 2:], most), rounded[:, 2:])
    return np.concatenate([low, high], axis=1).astype(np.float32)


def _places(spans: list[Span | None]) -> tuple[Place | None, ...]:
    known: dict[tuple[str, int, int] | None, Place | None] = {None: None}
    keys = [None if span is None else (span.source.name, span.start, span.end) for span in spans]
    for key, span in zip(keys, spans, strict=True):
        if span is not None and key not in known:
            start, end = span.locate()
            known[key] = Place(span.source.name, *start, *end)
    return tuple([known[key] for key in keys])
