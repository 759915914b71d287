"""Pictures in one call: `scenelang.render`."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from scenelang.backend.options import DEFAULT, Backend, How, Options, RenderError
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.scene.schema import Scene

if TYPE_CHECKING:
    from scenelang.fitting.mesh import Shape
    from scenelang.graph.lower import Spans
    from scenelang.graph.nodes import Graph
    from scenelang.image import Image
    from scenelang.program.program import Program
    from scenelang.renderers.draw import Drawing, Kept


def exact_graph(scene: Scene, spans: Spans | None = None) -> tuple[Graph, dict[str, Shape]]:
    """The graph of a scene as written, and true shapes of its elements; raises as `draw_exact`."""
    from scenelang.graph.lower import lower
    from scenelang.program.compile import find_model

    found = Diagnostics()
    manifest = find_model(scene, found, spans=spans)
    graph = lower(scene, manifest, spans, found) if manifest is not None else None
    if graph is None or found.errors:
        raise SceneError(found)
    if not graph.elements:
        return graph, {}
    from scenelang.fitting.mesh import FitError
    from scenelang.fitting.originals import originals_of

    try:
        return graph, originals_of(scene, graph)
    except (FitError, OSError) as error:
        raise RenderError(str(error)) from None


def draw_exact(
    scene: Scene,
    *,
    spans: Spans | None = None,
    progress: Callable[[float], None] | None = None,
) -> Image:
    """Draw a scene by the exact definition, from its graph as written, before any pass.

    Args:
        progress: called with the share done, in [0, 1].

    Raises:
        SceneError: the scene uses what its model does not have.
        RenderError: there is no picture from where the eye is, or no original of an element.
    """
    from scenelang.reference.image import reference_image

    graph, brought = exact_graph(scene, spans)
    try:
        return reference_image(graph, brought=brought, progress=progress or (lambda _: None))
    except ValueError as error:
        raise RenderError(str(error)) from None


def draw(
    program: Program,
    how: How = DEFAULT,
    *,
    place: str | None = None,
    split: int | None = None,
    kept: Kept | None = None,
    progress: Callable[[float], None] | None = None,
) -> Drawing:
    """Draw a Program by the library that fits.

    Args:
        how: with a backend that draws Programs.
        place: ``"numpy"`` or a torch device; by default numpy for solids and small pictures, else
            ``how.device``.
        split: threads that the picture is split for, which shows in the last bits; by default as many as
            draw.
        kept: the picture before this one, of which tiles that show the same are taken over.
        progress: called with the share done, in [0, 1], from any thread.

    Raises:
        RenderError: as `render`.
    """
    if place is None:
        from scenelang.backend.small import choose_drawer

        drawer = choose_drawer(program, how.device, how.samples, exact=how.backend == "exact")
        place = drawer.library if drawer.library == "numpy" else how.device
    if place == "numpy":
        from scenelang.backend.small import draw_small

        exact = how.backend == "exact"
        return draw_small(
            program, threads=how.threads, split=split, kept=kept, progress=progress, exact=exact, **how.care
        )
    from scenelang.backend.neural import choose_device, draw_program, open_model

    model = open_model(program.model, choose_device(place), program.weights)
    return draw_program(
        program, model, threads=how.threads, split=split, kept=kept, progress=progress, **how.care
    )


def render(
    program_or_scene: Program | Scene | str | os.PathLike[str],
    *,
    size: tuple[int, int] | None = None,
    progress: Callable[[float], None] | None = None,
    **how: Unpack[Options],
) -> Image:
    """Draw a Program, a Scene, which is compiled first, or the file of either.

    A small picture is drawn by numpy, which saves importing torch; how much there is to draw is counted from
    the Program alone. A model is loaded when it is first drawn with and then kept. The same Program, device
    and number of threads give the same picture bit for bit; other devices and numbers, and the two
    libraries, the same within 1/255, of solids 2/255, where as many samples are taken.

    Args:
        program_or_scene: what to draw; a scene's file is read as by `scenelang.load`, a Program's ends in
            ``.safetensors``.
        size: canvas in pixels instead of the Scene's; a Program is compiled for its own.
        progress: called with the share done, in [0, 1], from any thread.
        **how: ``backend``, ``device``, ``threads`` and ``samples``; see `scenelang.backend.options.How`.

    Returns:
        The picture, float32 (H, W, 3), or (H, W, 4) where the background is none.

    Raises:
        SceneError: the Scene cannot be compiled.
        ProgramError: the file is not a Program.
        OSError: the file cannot be read.
        RenderError: there is no such device, the model's weights are missing or not those the Program was
            compiled for, it does not draw in this way, the reference was given a Program, or it has no
            original of an element.
        ValueError, TypeError: an argument is none of the above.
    """
    way = How(**how).checked()
    found, spans = given(program_or_scene, size, way.backend)
    if isinstance(found, Scene):
        return draw_exact(found, spans=spans, progress=progress)
    return draw(found, way, progress=progress).image


def given(
    program_or_scene: Program | Scene | str | os.PathLike[str],
    size: tuple[int, int] | None,
    backend: Backend,
) -> tuple[Program | Scene, Spans | None]:
    """Input of a backend: a Scene for the reference, a Program for the others; raises as `render`.

    With a Scene of a file comes where its nodes were written.
    """
    from scenelang.program.program import Program

    found = program_or_scene
    if isinstance(found, str | os.PathLike) and Path(found).suffix == ".safetensors":
        from scenelang.program.reading import load_program

        found = load_program(Path(found))
    if isinstance(found, Program):
        if size is not None:
            raise ValueError("a size for a program, which is compiled for its canvas: give it with the scene")
        if backend == "reference":
            raise RenderError("the reference draws scenes; a program keeps only what the network needs")
        return found, None
    from scenelang.evaluate.evaluation import opened
    from scenelang.program.compile import compile_scene

    diagnostics = Diagnostics()
    scene, spans = opened(found, diagnostics, size)
    if backend == "reference":
        return scene, spans
    try:
        return compile_scene(scene, spans=spans, diagnostics=diagnostics), None
    except FileNotFoundError as error:
        raise RenderError(f"a model has no weights here: {error.filename}") from None
