"""Scenes as pages: files, Scenes and Programs to one HTML file each, `scenelang.export`."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from scenelang.backend.render import render
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.evaluate.evaluation import Evaluation, Source
from scenelang.files import write_output
from scenelang.models.manifest import load_manifest
from scenelang.program.compile import compile_scene
from scenelang.program.program import Program, ProgramError
from scenelang.program.reading import load_program
from scenelang.scene import library
from scenelang.scene.schema import Scene
from scenelang.viewer.form import form_of
from scenelang.viewer.page import control_rows, page, plain
from scenelang.viewer.view import View, view_of

if TYPE_CHECKING:
    import PIL.Image

    from scenelang.image import Image

PROGRAM: Final = ".safetensors"
STILL_SIDE: Final = {2: 960, 3: 480}
"""Pixels along the longer side of a still picture; solids take longer."""
_QUALITIES: Final = (80, 60, 40, 20)  # of WebP, until it has few enough bytes
_MOST_STILL: Final = 40_000  # bytes
_FRAME_PX: Final = (360, 640)  # width of a frame in a notebook, at least and at most
_MOST_TEXT: Final = 20_000  # of a Scene, whose text nobody wrote


def export(
    source: str | os.PathLike[str] | Scene | Program,
    out: str | os.PathLike[str],
    *,
    params: Mapping[str, Any] | None = None,
    size: tuple[int, int] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    title: str | None = None,
) -> None:
    """Write an HTML page that draws a scene in any browser with WebGL2 and asks for nothing else.

    Args:
        source: a scene's file, whose params the page can change and whose animation it plays; or a compiled
            Program's (.safetensors), a Scene or a Program, which are as they are.
        out: the page.
        params: values for a file's params that the page starts from; as for `scenelang.load`.
        size: canvas in pixels instead of the scene's; the picture keeps its aspect.
        model: draw with this model instead of the one that the scene names.
        root: folder that imports cannot leave; by default the file's.
        title: of the page; by default the name of the file.

    Raises:
        SceneError: the scene has errors.
        ProgramError: the file is not a Program, or no page can draw its model.
        RenderError: the model has no weights here.
        ValueError: an argument says something of a file where there is none, or of a scene where there is a
            Program.
        OSError: a file cannot be read, or the page cannot be written.
    """
    given: Source | Scene | Program
    path = None if isinstance(source, Scene | Program) else Path(source)
    if path is None or path.suffix == PROGRAM:
        if params or root is not None:
            raise ValueError("params and root are for files of scenes")
        given = source if isinstance(source, Scene | Program) else load_program(Path(source))
        if isinstance(given, Scene):
            given = (given if size is None else given.sized(size)).of_model(model)
        elif size is not None or model is not None:
            raise ValueError("size and model are for scenes; a program is compiled for its own")
    else:
        given = Source(path, params=params, model=model, root=root, size=size)
    name = "" if path is None else path.stem
    view, program = viewed(given, name if title is None else title)
    write_output(out, page(view, still=still(program)).encode())


def viewed(source: Source | Scene | Program, title: str) -> tuple[View, Program]:
    """The view of a scene or a Program, and the Program that it shows first; raises as `export`."""
    if isinstance(source, Program):
        return scene_view(source, None, None, title=title), source
    evaluation = None
    if isinstance(source, Scene):
        scene: Scene | None = source
    else:
        found = Diagnostics()
        evaluation = source.evaluation(found)
        scene = evaluation.run(0)[0]
        if scene is None or found.errors:
            raise SceneError(found)
    assert scene is not None
    program = compile_scene(scene)
    return scene_view(program, scene, evaluation, title=title), program


def scene_view(
    program: Program, scene: Scene | None, evaluation: Evaluation | None, *, title: str = ""
) -> View:
    """The view of a compiled scene.

    Args:
        program: what the page shows first.
        scene: what it was compiled from, where there is one.
        evaluation: of the text of that scene, after the run that gave it, where there is one.
        title: of the page.
    """
    source: list[tuple[str, str]] = []
    form = None
    if evaluation is not None:
        form = form_of(evaluation, load_manifest(program.model), program.elements)
        first = evaluation.sources[0].name
        own = [text for text in evaluation.sources if not library.holds(text)]
        source = [(_shown(text.name, first), text.text) for text in own]
    elif scene is not None and len(text := scene.to_nsg()) <= _MOST_TEXT:
        source = [(f"{title or 'scene'}.nsg", text)]
    animation = None if scene is None else scene.animation
    return view_of(program, title=title, source=source, form=form, animation=animation)


def still(program: Program) -> bytes:
    """A picture of a Program as WebP, large enough that what is small in it can be read."""
    side = STILL_SIDE[2 if program.stage is None else 3] / max(program.canvas)
    width, height = (max(1, round(side * length)) for length in program.canvas)
    return _packed(render(replace(program, canvas=(width, height))).to_pil())


def frame(value: Scene | Program, picture: Image) -> str:
    """The viewer of a Scene or a Program as HTML for a notebook, in a frame that may run scripts alone.

    Args:
        picture: of the value, for browsers that cannot draw it.

    Returns:
        Nothing where no page can draw its model.
    """
    program, scene = (value, None) if isinstance(value, Program) else (compile_scene(value), value)
    try:
        view = scene_view(program, scene, None)
    except ProgramError:
        return ""
    small = picture.to_pil().reduce(-(-max(program.canvas) // STILL_SIDE[2]))
    text = escape(page(view, still=_packed(small), embedded=True))
    width = max(_FRAME_PX[0], min(_FRAME_PX[1], program.canvas[0]))
    height = round(width * program.canvas[1] / program.canvas[0]) + 16 * control_rows(view)
    title = escape(plain(view.data["alt"]))
    return (
        f'<iframe sandbox="allow-scripts" title="{title}" srcdoc="{text}" '
        f'width="{width}" height="{height}" style="border: 0; max-width: 100%"></iframe>'
    )


def _packed(picture: PIL.Image.Image) -> bytes:
    for quality in _QUALITIES:
        data = io.BytesIO()
        picture.save(data, "WEBP", quality=quality, method=6)
        if data.tell() <= _MOST_STILL:
            break
    return data.getvalue()


def _shown(name: str, first: str) -> str:
    """What a page calls a file: by its place beside the scene's, and of others only their names."""
    place = os.path.relpath(name, os.path.dirname(first)).replace(os.sep, "/")
    return Path(name).name if place.startswith("../") else place
