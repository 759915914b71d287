"""Pictures in one call: `scenelang.render`."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from scenelang.backend.options import Device, RenderError, Samples, Still
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.scene.schema import Scene

if TYPE_CHECKING:
    from scenelang.fitting.ladder import Shape
    from scenelang.graph.lower import Spans
    from scenelang.graph.nodes import Graph
    from scenelang.image import Image
    from scenelang.program.program import Program


def exact_graph(
    scene: Scene, spans: Spans | None = None, model: str | None = None
) -> tuple[Graph, dict[str, Shape]]:
    """The graph of a scene as written, and true shapes of its elements; raises as `draw_exact`."""
    from scenelang.graph.lower import lower
    from scenelang.program.compile import find_model

    found = Diagnostics()
    manifest = find_model(scene, found, model=model, spans=spans)
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
    model: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Image:
    """Draw a scene by the exact definition, from its graph as written, before any pass.

    Args:
        model: take names from this model instead of the one the scene names.
        progress: called with the share done, in [0, 1].

    Raises:
        SceneError: the scene uses what its model does not have.
        RenderError: there is no picture from where the eye is, or no original of an element.
    """
    from scenelang.reference.image import reference_image

    graph, brought = exact_graph(scene, spans, model)
    try:
        return reference_image(graph, brought=brought, progress=progress or (lambda _: None))
    except ValueError as error:
        raise RenderError(str(error)) from None


def render(
    program_or_scene: Program | Scene | str | os.PathLike[str],
    *,
    size: tuple[int, int] | None = None,
    backend: Still = "neural",
    device: Device = "auto",
    threads: int | None = None,
    samples: Samples = "adaptive",
    progress: Callable[[float], None] | None = None,
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
        backend: ``"neural"`` draws with the trained network, ``"exact"`` with formulas of the shapes in its
            place, all else alike, and ``"reference"`` a Scene by the exact definition, which knows no boolean
            rule and none of a model's limits.
        device: where torch runs the network, whatever the picture's size; with ``"auto"`` numpy draws small
            pictures, and torch others on CUDA where there is any.
        threads: tiles drawn at the same time; by default one for each 131,072 pixels, but no more than there
            are usable cores. Numpy draws the plane in one.
        samples: of a pixel: ``"four"`` as the language defines, ``"adaptive"``, four near outlines and one
            elsewhere (on CUDA four in the plane), which looks the same, ``"one"``, which is faster and has
            hard edges, or ``"draft"``, one for each 2 x 2 pixels, enlarged. ``"quick"`` is ``"adaptive"``
            with less care for solids: steps that may pass what is thinner than 0.04, as those of ``"one"``
            and ``"draft"`` may.
        progress: called with the share done, in [0, 1], from any thread.

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
    if samples not in get_args(Samples):
        ways = ", ".join(f"`{way}`" for way in get_args(Samples))
        raise ValueError(f"unknown samples `{samples}`; there are {ways}")
    if threads is not None and threads < 1:
        raise ValueError(f"{threads} threads, where at least 1 is needed")
    if backend == "reference" and samples != "adaptive":
        raise RenderError("the reference always takes four samples a pixel")
    program, spans = given(program_or_scene, size, backend)
    if isinstance(program, Scene):
        return draw_exact(program, spans=spans, progress=progress)
    from scenelang.backend.small import choose_drawer, draw_small

    if backend == "exact" and device == "cuda":
        raise RenderError("formulas are computed by numpy, not by device cuda")
    exact, library = backend == "exact", choose_drawer(program, device, samples).library
    if exact or library == "numpy":
        return draw_small(program, samples=samples, progress=progress, threads=threads, exact=exact).image
    from scenelang.backend.neural import choose_device, draw_program, open_model

    model = open_model(program.model, choose_device(device), program.weights)
    return draw_program(program, model, threads=threads, samples=samples, progress=progress).image


def given(
    program_or_scene: Program | Scene | str | os.PathLike[str],
    size: tuple[int, int] | None,
    backend: Still,
) -> tuple[Program | Scene, Spans | None]:
    """Input of a backend: a Scene for the reference, a Program for the network; raises as `render`.

    With a Scene of a file comes where its nodes were written.
    """
    from scenelang.program.program import Program

    if backend not in get_args(Still):
        raise ValueError(f"unknown backend `{backend}`; there are `neural`, `exact` and `reference`")
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
