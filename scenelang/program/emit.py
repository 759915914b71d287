"""Stream to Program: chains are lifted, operators become tokens, boxes become bounds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scenelang.diagnostics.span import Span
from scenelang.graph.bounds import felt_level, leaf_box
from scenelang.graph.levels import split_levels
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
    """The Program of a stream.

    Args:
        graph: after all passes, without errors.
        manifest: of the model it was made for.
        codes: that model's learned codes.

    Raises:
        ProgramError: the model's lifting is not one of this version.
    """
    if manifest.lifting != "exact" and codes.lifting is None:
        raise ProgramError(f"model `{manifest.name}` needs the lifting `{manifest.lifting}`")
    rows = graph.rows()
    return Program(
        vectors=_vectors(rows, manifest, codes),
        tokens=np.array([TOKENS[op] for op, _ in rows], dtype=np.int8),
        bounds=_bounds(rows, graph),
        canvas=graph.canvas,
        background=graph.background,
        model=manifest.name,
        weights=codes.digest,
        objects=tuple(leaf.geometry for _, leaf in rows),
        places=_places([leaf.span for _, leaf in rows]),
    )


def _vectors(rows: Rows, manifest: Manifest, codes: Codes) -> npt.NDArray[np.float32]:
    """Vectors (N, 64). Leaves that stay from frame to frame note theirs; a row depends on nothing else."""
    note = "vector", codes.digest
    fresh = [row for row in rows if row[1].notes is None or note not in row[1].notes]
    made = _lifted(fresh, manifest, codes)
    if len(fresh) == len(rows) and all(leaf.notes is None for _, leaf in rows):
        return made
    for (_, leaf), vector in zip(fresh, made, strict=True):
        if leaf.notes is not None:
            leaf.notes[note] = vector.copy()
    lifted = iter(made)
    vectors = np.empty((len(rows), WIDTH), dtype=np.float32)
    asked = {id(leaf) for _, leaf in fresh}
    for index, (_, leaf) in enumerate(rows):
        vectors[index] = next(lifted) if id(leaf) in asked else (leaf.notes or {})[note]
    return vectors


def _lifted(rows: Rows, manifest: Manifest, codes: Codes) -> npt.NDArray[np.float32]:
    vectors = np.zeros((len(rows), WIDTH), dtype=np.float32)  # (N, 64)
    if rows and codes.lifting is not None:
        lifting = codes.lifting
        geometry = lift_geometry(
            lifting,
            [leaf.steps for _, leaf in rows],
            [manifest.geometries.index(leaf.geometry) for _, leaf in rows],
        )
        materials = [manifest.materials.index(leaf.look.material) for _, leaf in rows]
        made = [geometry, lift_material(lifting, [leaf.look.rgb for _, leaf in rows], materials)]
        if (width := sum(v.shape[1] for v in made)) != WIDTH:
            raise ProgramError(f"model `{manifest.name}` lifts to {width} numbers, not {WIDTH}")
        vectors[:] = np.concatenate(made, 1)
    elif rows:
        levels = [split_levels(leaf.steps, manifest.limits) for _, leaf in rows]
        layout = LAYOUTS[manifest.layout]
        geometry = lift_many(levels, [codes.geometry[leaf.geometry] for _, leaf in rows], layout)
        material = lift_colours(
            [leaf.look.rgb for _, leaf in rows],
            [codes.material[leaf.look.material] for _, leaf in rows],
            layout,
        )
        vectors[:] = np.concatenate([geometry, material], 1)
    vectors += 0.0  # one zero only, so that equal scenes give equal bytes
    return vectors


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
    known: dict[tuple[str, int, int], Place] = {}
    places: list[Place | None] = []
    for span in spans:
        if span is None:
            places.append(None)
            continue
        key = (span.source.name, span.start, span.end)
        if key not in known:
            (line, column), (end_line, end_column) = span.locate()
            known[key] = Place(span.source.name, line, column, end_line, end_column)
        places.append(known[key])
    return tuple(places)
