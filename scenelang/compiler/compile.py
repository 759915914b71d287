"""Scene to Program in one call. Imports numpy, never torch."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING

from scenelang.compiler.graph import Graph
from scenelang.compiler.lower import Memory, Spans
from scenelang.compiler.manifest import USUAL, Manifest, available, load_manifest
from scenelang.compiler.passes import check_scene
from scenelang.language.diagnostics import Diagnostics, Span, did_you_mean
from scenelang.language.reports import SceneError
from scenelang.language.scene import Brought, Chain, Object, Scene, SceneNode
from scenelang.language.words import STAGE, dimension_of

if TYPE_CHECKING:
    from scenelang.compiler.program import Program
    from scenelang.compiler.weights import Codes


def compile_scene(
    scene: Scene | str | os.PathLike[str],
    *,
    spans: Spans | None = None,
    diagnostics: Diagnostics | None = None,
    model: str | None = None,
    codes: Codes | None = None,
    after: Callable[[str, Graph], None] | None = None,
    without: Collection[str] = (),
    memory: Memory | None = None,
) -> Program:
    """Compile a scene for a model.

    Args:
        scene: a concrete scene, or the path of one, which is read as by `scenelang.load`.
        spans: where its nodes were written, for diagnostics and the source map; those of a file are known.
        diagnostics: collects errors and warnings.
        model: draw with this model instead of the one the scene names.
        codes: lift with these instead of the model's shipped ones, for weights under trial.
        after: called with ``"lower"`` and the name of each pass and the graph it left.
        without: names of passes to leave out, of those that only save work (`passes.OPTIONAL`).
        memory: of the previous frame of an animation whose frames share nodes; the Program is the same
            with or without it.

    Returns:
        The Program; the same scene always gives the same one, byte for byte.

    Raises:
        SceneError: the scene cannot be compiled; it carries all diagnostics.
        FileNotFoundError: the model has no weights.
        OSError: the file cannot be opened.
        TypeError: neither a Scene nor a path.
    """
    result = diagnostics if diagnostics is not None else Diagnostics()
    if not isinstance(scene, Scene):
        from scenelang.language.evaluation import opened

        scene, spans = opened(scene, result)
    if (manifest := find_model(scene, result, model=model, spans=spans)) is not None:
        graph = check_scene(scene, spans, result, manifest, after, without, memory)
    if manifest is None or result.errors:
        raise SceneError(result)
    # Lifting is what needs numpy; scenes that are only checked or have errors never come this far.
    from scenelang.compiler.emit import emit
    from scenelang.compiler.weights import load_codes

    return emit(graph, manifest, codes or load_codes(manifest.name))


def find_model(
    scene: Scene, diagnostics: Diagnostics, *, model: str | None = None, spans: Spans | None = None
) -> Manifest | None:
    """The manifest of the model asked for, named by the scene or usual; reports E0514 where there is none."""
    name = model or scene.model or USUAL[scene_dimension(scene)]
    try:
        return load_manifest(name)
    except KeyError:
        place = spans.span(scene) if spans is not None and model is None else None
        help, fix = f"the models are {', '.join(f'`{known}`' for known in available())}", None
        if place is not None and (start := place.text.find(f'"{name}"')) >= 0:
            start += place.start + 1
            place = Span(place.source, start, start + len(name))
            near, fix = did_you_mean(name, available(), place)
            help = near or help
        diagnostics.add("E0514", f"unknown model `{name}`", place, help=help, fix=fix)
        return None


def scene_dimension(scene: Scene) -> int:
    """The dimension of a scene, 2 or 3: by its first geometry, else 3 where it has a stage."""
    brought = Brought.of(scene.elements).geometries
    stack: list[SceneNode] = list(reversed(scene.nodes))
    while stack:
        node = stack.pop()
        if isinstance(node, Object):
            element = brought.get(node.geometry)
            dimension = dimension_of(node.geometry) if element is None else element.dimension
            if dimension is not None:
                return dimension
        else:
            links = [link.node for link in node.children] if isinstance(node, Chain) else list(node.children)
            stack += links[::-1]
    return 3 if any(getattr(scene, word) != "default" for word in STAGE) else 2


def why_chosen(scene: Scene | None, asked: bool) -> str:
    """Reason for the model that draws a scene; ``asked`` says whether the command line named it."""
    if asked:
        return "by --model"
    named = scene is not None and scene.model is not None
    return "named by the scene" if named else "the usual one of its dimension"


compile = compile_scene
"""`scenelang.compile`."""
