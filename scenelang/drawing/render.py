"""Pictures, proofs and outputs in one call: `scenelang.render`, `prove`, `render_outputs`."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Unpack, get_args

from scenelang.drawing.how import (
    DEFAULT,
    Backend,
    How,
    Options,
    RenderError,
    check_time,
    keep_memory,
    threads_for,
)
from scenelang.drawing.image import PLANE, Output, Outputs, Proof, Source
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene

if TYPE_CHECKING:
    from scenelang.compiler.graph import Graph
    from scenelang.compiler.lower import Spans
    from scenelang.compiler.program import Place, Program
    from scenelang.drawing.exact.originals import Shape
    from scenelang.drawing.image import Image
    from scenelang.drawing.neural.draw import Drawing, Run


def exact_graph(scene: Scene, spans: Spans | None = None) -> tuple[Graph, dict[str, Shape]]:
    """The graph of a scene as written, and true shapes of its elements; raises as `draw_exact`."""
    from scenelang.compiler.compile import find_model
    from scenelang.compiler.lower import lower

    result = Diagnostics()
    manifest = find_model(scene, result, spans=spans)
    graph = lower(scene, manifest, spans, result) if manifest is not None else None
    if graph is None or result.errors:
        raise SceneError(result)
    if not graph.elements:
        return graph, {}
    from scenelang.drawing.exact.mesh import FitError
    from scenelang.drawing.exact.originals import originals_of

    try:
        return graph, originals_of(scene, graph)
    except (FitError, OSError) as error:
        raise RenderError(str(error)) from None


def draw_exact(
    scene: Scene,
    *,
    spans: Spans | None = None,
    patient: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Image:
    """Draw a scene by the exact definition, from its graph as written, before any pass.

    Raises `SceneError` for what the model does not have, `RenderError` where there is no picture from where
    the eye is, or no original of an element, or it takes longer than a picture may, unless ``patient``.
    """
    from scenelang.drawing.exact.picture import reference_image
    from scenelang.drawing.work import until_s

    graph, brought = exact_graph(scene, spans)
    over_s = until_s(scene.canvas, patient)

    def drawn(share: float) -> None:
        check_time(over_s)
        if progress is not None:
            progress(share)

    try:
        return reference_image(graph, brought=brought, progress=drawn)
    except ValueError as error:
        raise RenderError(str(error)) from None


def draw(program: Program, how: How = DEFAULT, *, place: str | None = None, **run: Unpack[Run]) -> Drawing:
    """Draw a Program by the library that fits, as of `Run`; raises as `render`. ``place`` is ``"numpy"`` or a
    torch device; by default numpy for solids and small pictures, else ``how.device``.
    """
    run, program = {"threads": how.threads, **run, **how.care}, how.sampled(program)
    if place is None:
        from scenelang.drawing.small import choose_drawer

        library, _ = choose_drawer(program, how.device, exact=how.backend == "exact")
        place = library if library == "numpy" else how.device
    if place == "numpy":
        from scenelang.drawing.small import draw_small

        drawing = draw_small(program, exact=how.backend == "exact", **run)
    else:
        from scenelang.drawing.torch_backend import choose_device, draw_program, open_model

        model = open_model(program.model, choose_device(place), program.weights)
        drawing = draw_program(program, model, **run)
    if drawing.coarser:
        file = next((place.file + ": " for place in program.places if place), "")
        warnings.warn(file + drawing.coarser, stacklevel=2)
    return drawing


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
        **how: ``backend``, ``device``, ``threads``, ``samples`` and ``patient``, as of `How`.

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
    result, spans = given(program_or_scene, size, way.backend)
    if isinstance(result, Scene):
        return draw_exact(way.sampled(result), spans=spans, patient=way.patient, progress=progress)
    return draw(result, way, progress=progress).image


def given(
    program_or_scene: Program | Scene | str | os.PathLike[str], size: tuple[int, int] | None, backend: Backend
) -> tuple[Program | Scene, Spans | None]:
    """Input of a backend: a Scene, and where it was written, for the reference, else a Program."""
    from scenelang.compiler.program import Program

    result = program_or_scene
    if isinstance(result, str | os.PathLike) and Path(result).suffix == ".safetensors":
        from scenelang.compiler.program import load_program

        result = load_program(Path(result))
    if isinstance(result, Program):
        if size is not None:
            raise ValueError("a size for a program, which is compiled for its canvas: give it with the scene")
        if backend == "reference":
            raise RenderError("the reference draws scenes; a program keeps only what the network needs")
        return result, None
    from scenelang.compiler.compile import compile_scene
    from scenelang.language.evaluation import opened

    diagnostics = Diagnostics()
    scene, spans = opened(result, diagnostics, size)
    if backend == "reference":
        return scene, spans
    try:
        return compile_scene(scene, spans=spans, diagnostics=diagnostics), None
    except FileNotFoundError as error:
        raise RenderError(f"a model has no weights here: {error.filename}") from None


def prove(
    scene: Scene | str | os.PathLike[str],
    image: Image | None = None,
    *,
    redraw: bool = False,
    size: tuple[int, int] | None = None,
    **how: Unpack[Options],
) -> tuple[Image, Proof]:
    """Draw a Scene of the plane, and prove how far each pixel is from the exact picture at most.

    Args:
        scene: what to draw, or the path of it, which is read as by `scenelang.load`.
        image: its picture, whoever drew it; by default it is drawn by the network, as `render` does.
        redraw: draw pixels again that are not proved right to 1/255. Then all are, but where an element may
            be seen, and where a sample lies on an outline to the last digits.
        size, **how: as for `render`; the backend is the network.

    Returns:
        The picture, and bounds of its pixels.

    Raises:
        SceneError: the Scene cannot be compiled.
        RenderError: nothing is proved of such pictures (solids, models with a learned lifting), the picture
            is of another size, or it cannot be drawn.
    """
    from scenelang.compiler.compile import compile_scene
    from scenelang.language.evaluation import opened

    way = How(**how).checked()
    if way.backend != "neural":
        raise RenderError(f"a proof is of what the network draws, and backend {way.backend} is exact")
    graphs: dict[str, Graph] = {}
    result = Diagnostics()
    scene, spans = opened(scene, result, size)
    program = compile_scene(scene, spans=spans, diagnostics=result, after=graphs.__setitem__)

    return prove_drawn(
        graphs, program.model, lambda: draw(program, way).image if image is None else image, redraw, way
    )


def prove_drawn(
    graphs: Mapping[str, Graph], model: str, draw: Callable[[], Image], redraw: bool, how: How = DEFAULT
) -> tuple[Image, Proof]:
    """A picture and its proof, by the graphs after `lower` and each pass; raises as `prove`, before drawing.
    The stream that is proved has all objects, so that no pass that drops some has to be believed.
    """
    from scenelang.compiler.manifest import load_manifest
    from scenelang.drawing.proof import check_proved, prove_image
    from scenelang.drawing.work import until_s

    keep_memory()
    check_proved(manifest := load_manifest(model))
    lowered, stream = (how.sampled(graphs[name]) for name in ("lower", "flatten"))
    image, over_s = draw(), until_s(lowered.canvas, how.patient)
    return prove_image(lowered, stream, manifest, image, redraw=redraw, until_s=over_s)


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
    result, spans = given(program_or_scene, size, backend)
    return outputs_of(result, outputs, how, spans=spans)


def outputs_of(
    drawn: Program | Scene, wanted: Sequence[Output], how: How, *, spans: Spans | None = None
) -> Outputs:
    """Outputs of what a backend draws, a proof aside; raises as `render_outputs`."""
    wanted = tuple([name for name in wanted if name != "proof"])
    if not wanted:
        return Outputs()
    drawn = how.sampled(drawn)
    return _exact(drawn, wanted, spans) if isinstance(drawn, Scene) else _neural(drawn, wanted, how)


def _neural(program: Program, wanted: Sequence[Output], how: How) -> Outputs:
    """Outputs of a Program by its network, or by formulas in its place."""
    from scenelang.compiler.manifest import load_manifest
    from scenelang.compiler.program import ProgramError
    from scenelang.compiler.weights import ModelError
    from scenelang.drawing.closed import field_of
    from scenelang.drawing.neural.draw import program_outputs

    _check(wanted, program.stage is None)
    try:
        if load_manifest(program.model).renderer not in ("framed", "solid"):
            raise RenderError(f"model `{program.model}` draws colours only")
        keep_memory()
        field = field_of(program, how.backend == "exact")
        threads = how.threads or threads_for(program.canvas)
        result = program_outputs(field, program, threads=threads, patient=how.patient)
    except KeyError:
        raise RenderError(f"unknown model `{program.model}`") from None
    except (ModelError, ProgramError) as error:
        raise RenderError(str(error)) from None
    return result.only(wanted, _sources(program.numbers, program.objects, program.places))


def _exact(scene: Scene, wanted: Sequence[Output], spans: Spans | None) -> Outputs:
    """Outputs of a scene by the exact definition."""
    from scenelang.compiler.emit import places_of
    from scenelang.compiler.graph import leaves
    from scenelang.drawing.exact.picture import graph_outputs

    graph, brought = exact_graph(scene, spans)
    _check(wanted, graph.stage is None)
    try:
        result = graph_outputs(graph, brought)
    except ValueError as error:
        raise RenderError(str(error)) from None
    objects = list(leaves(graph.root))
    names, numbers = [leaf.geometry for leaf in objects], [leaf.number for leaf in objects]
    return result.only(wanted, _sources(numbers, names, places_of([leaf.span for leaf in objects])))


def _check(wanted: Sequence[Output], flat: bool) -> None:
    for name in wanted:
        if flat and name not in PLANE:
            raise RenderError(f"a 2D picture has no {name}; it has {' and '.join(PLANE)}")


def _sources(
    numbers: Sequence[int], names: Sequence[str], places: Sequence[Place | None]
) -> dict[int, Source]:
    return {
        n: {
            "geometry": name,
            **({} if at is None else {"file": at.file, "line": at.line, "column": at.column}),
        }
        for n, name, at in zip(numbers, names, places, strict=True)
    }
