"""Outlines and surfaces of scenes in one call: `scenelang.to_svg`, `scenelang.to_mesh`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, cast

from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import Program, ProgramError, written
from scenelang.compiler.weights import ModelError
from scenelang.drawing.how import Backend, How, RenderError, keep_memory
from scenelang.drawing.render import given
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.evaluation import opened
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene
from scenelang.output.mesh import TriangleMesh, surface_of
from scenelang.output.svg import svg_of

RESOLUTION: Final = 320
FINEST: Final = 512
UNSEEN: Final = ("drop_unseen",)  # passes that are left out where the camera has no say


def to_svg(
    program_or_scene: Program | Scene | str | os.PathLike[str],
    *,
    size: tuple[int, int] | None = None,
    backend: Backend = "neural",
    diagnostics: Diagnostics | None = None,
) -> str:
    """Draw a flat scene as SVG: curves along the outlines of all that is seen, within 0.1 pixels.

    Args:
        program_or_scene: what to draw, or its file, as for `render`.
        size: canvas in pixels instead of the Scene's.
        backend: ``"neural"`` or ``"exact"``, whose outlines they are.
        diagnostics: collects warnings, such as W0550, that colours of a blend became the nearer object's.

    Returns:
        The text of the file.

    Raises:
        SceneError: the Scene cannot be compiled or is one of solids, or the file holds an animation.
        RenderError: the model has no outlines, its weights are missing, or the backend is the reference.
        ProgramError, OSError, ValueError, TypeError: as for `render`.
    """
    diagnostics = diagnostics if diagnostics is not None else Diagnostics()
    program = _program(program_or_scene, size, backend, diagnostics, flat=True)
    with _reported():
        text, blended = svg_of(program, backend == "exact")
    if blended:
        fact = "colours that `smooth` mixes become those of the nearer object"
        diagnostics.add("W0550", fact, None, help="an SVG has no such gradients; a picture has")
    return text


def to_mesh(
    program_or_scene: Program | Scene | str | os.PathLike[str],
    *,
    resolution: int = RESOLUTION,
    backend: Backend = "neural",
    diagnostics: Diagnostics | None = None,
) -> TriangleMesh:
    """Make the solids of a scene one closed mesh, wherever the camera looks; ground and media are left out.

    Args:
        program_or_scene: what to mesh, or its file, as for `render`. A Program has what the camera sees.
        resolution: cells along the longest side, 8 to 512.
        backend: ``"neural"`` or ``"exact"``, whose surface it is.
        diagnostics: collects warnings: W0551 for media, W0552 for what is thinner than a cell, W0553 for a
            resolution that takes too many cells.

    Returns:
        Vertices, triangles and colours, y up; ``save`` writes .stl, .ply, .obj or .glb, with ``up="z"`` z up.

    Raises:
        SceneError: the Scene cannot be compiled, is flat or has no surface, or the file holds an animation.
        RenderError: as for `to_svg`.
        ProgramError, OSError, ValueError, TypeError: as for `render`.
    """
    diagnostics = diagnostics if diagnostics is not None else Diagnostics()
    if not 8 <= resolution <= FINEST:
        raise ValueError(f"a resolution of {resolution}, where 8 to {FINEST} are allowed")
    program = _program(program_or_scene, None, backend, diagnostics, flat=False)
    with _reported():
        mesh, warnings = surface_of(program, resolution, backend == "exact")
    if not len(mesh.triangles):
        raise _empty(program, diagnostics)
    finer = f"a finer mesh has more: --resolution {min(2 * resolution, FINEST)}"
    for code, fact in warnings.items():
        diagnostics.add(code, fact, None, help=finer if code == "W0552" and "W0553" not in warnings else None)
    return mesh


def _empty(program: Program, diagnostics: Diagnostics) -> SceneError:
    help = "a mesh has what is opaque and solid"
    diagnostics.add("E0552", f"nothing is left for a mesh{written(program.places)}", None, help=help)
    return SceneError(diagnostics)


@contextmanager
def _reported() -> Iterator[None]:
    try:
        yield
    except (ModelError, ProgramError) as error:
        raise RenderError(str(error)) from None


def _program(
    held: Program | Scene | str | os.PathLike[str],
    size: tuple[int, int] | None,
    backend: Backend,
    diagnostics: Diagnostics,
    flat: bool,
) -> Program:
    """What has outlines, if flat, or else a surface; raises as `to_svg` and `to_mesh`."""
    if backend == "reference":
        fact = "outlines and surfaces are those of the model's field"
        raise RenderError(f"{fact}; the reference has pictures alone")
    How(backend).checked()
    name = "" if isinstance(held, Program | Scene) else os.fspath(held)
    if isinstance(held, Program) or name.endswith(".safetensors"):
        program = cast("Program", given(held, size, "neural")[0])
    else:
        scene, spans = opened(held, diagnostics, size)
        if name and scene.animation is not None:
            refuse_animation(name, diagnostics)
            raise SceneError(diagnostics)
        without = () if flat else UNSEEN
        try:
            program = compile_scene(scene, spans=spans, diagnostics=diagnostics, without=without)
        except FileNotFoundError as error:
            raise RenderError(f"a model has no weights here: {error.filename}") from None
    if not flat and not len(program):
        raise _empty(program, diagnostics)  # which is neither flat nor of space
    if (program.stage is None) != flat:
        fact = ("an SVG of solids" if flat else "a mesh of a flat scene") + written(program.places)
        other = "write a mesh, such as .glb, or a picture" if flat else "write an .svg or a picture"
        diagnostics.add("E0551", fact, None, help=other)
        raise SceneError(diagnostics)
    try:
        manifest = load_manifest(program.model)
    except KeyError:
        raise RenderError(f"unknown model `{program.model}`") from None
    if not manifest.framed:
        raise RenderError(f"model `{program.model}` draws pictures alone")
    keep_memory()
    return program


def refuse_animation(name: str, diagnostics: Diagnostics) -> None:
    """Report that a file would have to hold an animation."""
    help = "one frame of it can be written: --frame 0, or scenelang.load(path, frame=0)"
    diagnostics.add("E0550", f"`{name}` is an animation, and the file holds one frame", None, help=help)
