"""What is known of a picture beside its colours in one call: `scenelang.render_outputs`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, get_args

from scenelang.backend.options import Backend, How, RenderError, keep_memory, threads_for
from scenelang.backend.render import exact_graph, given
from scenelang.outputs import PLANE, Output, Outputs, Source
from scenelang.scene.schema import Scene

if TYPE_CHECKING:
    from scenelang.graph.lower import Spans
    from scenelang.program.program import Place, Program


def render_outputs(
    program_or_scene: Program | Scene | str | os.PathLike[str],
    outputs: Sequence[Output],
    *,
    size: tuple[int, int] | None = None,
    backend: Backend = "neural",
    threads: int | None = None,
) -> Outputs:
    """Depth, normals, objects and alpha of a picture, for compositing; numpy computes them.

    Args:
        program_or_scene: what to look at, or its file, as for `render`.
        outputs: which of ``"depth"``, ``"normal"``, ``"object"`` and ``"alpha"``; 2D has the last two.
        size: canvas in pixels instead of the Scene's.
        backend: ``"neural"`` asks the trained network, ``"exact"`` formulas in its place, and ``"reference"``
            of a Scene the exact definition.
        threads: of solids, by default as for `render`.

    Returns:
        Arrays (H, W) or (H, W, 3), None for what was not asked for.

    Raises:
        SceneError: the Scene cannot be compiled.
        RenderError: the model or the scene has no such output, the weights are missing or others, or the
            reference was given a Program.
        ProgramError, OSError: as for `render`.
        ValueError, TypeError: an argument is none of the above.
    """
    known = get_args(Output)[:-1]  # a proof is of a picture, and `scenelang.prove` has it
    for name in outputs:
        if name not in known:
            raise ValueError(f"unknown output `{name}`; there are {', '.join(known)}")
    how = How(backend, threads=threads).checked()
    found, spans = given(program_or_scene, size, backend)
    return outputs_of(found, outputs, how, spans=spans)


def outputs_of(
    drawn: Program | Scene,
    wanted: Sequence[Output],
    how: How,
    *,
    spans: Spans | None = None,
) -> Outputs:
    """Outputs of what a backend draws, a proof aside; raises as `render_outputs`.

    Args:
        spans: where the nodes of a Scene were written.
    """
    wanted = tuple([name for name in wanted if name != "proof"])
    if not wanted:
        return Outputs()
    if isinstance(drawn, Scene):
        return _exact(drawn, wanted, spans)
    return _neural(drawn, wanted, how)


def _neural(program: Program, wanted: Sequence[Output], how: How) -> Outputs:
    """Outputs of a Program by its network, or by formulas in its place."""
    from scenelang.backend.closed import field_of
    from scenelang.models.manifest import load_manifest
    from scenelang.models.weights import ModelError
    from scenelang.program.program import ProgramError
    from scenelang.renderers.outputs import program_outputs

    _check(wanted, program.stage is None)
    try:
        if load_manifest(program.model).renderer not in ("framed", "solid"):
            raise RenderError(f"model `{program.model}` draws colours only")
        keep_memory()
        field = field_of(program, how.backend == "exact")
        found = program_outputs(field, program, threads=how.threads or threads_for(program.canvas))
    except KeyError:
        raise RenderError(f"unknown model `{program.model}`") from None
    except (ModelError, ProgramError) as error:
        raise RenderError(str(error)) from None
    return found.only(wanted, _sources(program.numbers, program.objects, program.places))


def _exact(scene: Scene, wanted: Sequence[Output], spans: Spans | None) -> Outputs:
    """Outputs of a scene by the exact definition."""
    from scenelang.graph.nodes import leaves
    from scenelang.program.emit import places_of
    from scenelang.reference.outputs import graph_outputs

    graph, brought = exact_graph(scene, spans)
    _check(wanted, graph.stage is None)
    try:
        found = graph_outputs(graph, brought)
    except ValueError as error:
        raise RenderError(str(error)) from None
    objects = list(leaves(graph.root))
    names, numbers = [leaf.geometry for leaf in objects], [leaf.number for leaf in objects]
    return found.only(wanted, _sources(numbers, names, places_of([leaf.span for leaf in objects])))


def _check(wanted: Sequence[Output], flat: bool) -> None:
    for name in wanted:
        if flat and name not in PLANE:
            raise RenderError(f"a 2D picture has no {name}; it has {' and '.join(PLANE)}")


def _sources(
    numbers: Sequence[int], names: Sequence[str], places: Sequence[Place | None]
) -> dict[int, Source]:
    rows = zip(numbers, names, places, strict=True)
    return {n: {"geometry": name, **_written(place)} for n, name, place in rows}


def _written(place: Place | None) -> Source:
    return {} if place is None else {"file": place.file, "line": place.line, "column": place.column}
