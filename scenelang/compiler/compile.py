"""Scene to Program in one call, and checks of a scene or its frames before lifting, which need no numpy."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Literal

from scenelang.compiler.graph import Graph
from scenelang.compiler.lower import Memory, Spans
from scenelang.compiler.manifest import USUAL, Manifest, available, load_manifest
from scenelang.compiler.passes import check_scene
from scenelang.language import tree as nodes
from scenelang.language.definitions import find_unused
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile, Span, did_you_mean, settle
from scenelang.language.evaluation import Evaluation, Source, in_file_order, name_frame, opened
from scenelang.language.reports import SceneError
from scenelang.language.scene import Brought, Chain, Object, Scene, SceneNode, same_nodes
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


Frames = Literal["one", "some", "all"]
"""Frames of an animation that are checked: the one asked for; the first, second, middle and last; all."""

After = Callable[[str, Graph], None]


def check_compiles(
    scene: Scene,
    spans: Spans | None,
    diagnostics: Diagnostics,
    *,
    after: After | None = None,
    memory: Memory | None = None,
) -> Manifest | None:
    """Run the compiler's checks; the manifest of the scene's model, None where there is none."""
    manifest = find_model(scene, diagnostics, spans=spans)
    if manifest is not None:
        check_scene(scene, spans, diagnostics, manifest, after, memory=memory)
    return manifest


def check_frames(
    evaluation: Evaluation,
    diagnostics: Diagnostics,
    *,
    first: Scene | None = None,
    every: bool = False,
    after: After | None = None,
) -> tuple[int, int]:
    """Check further frames of an animation of which frame 0, with the scene ``first``, has been run.

    They share the limits of one frame; where these are met, the rest is left out. Returns how many were
    checked, and how many were to be: the second, the middle and the last, or ``every`` one.
    """
    count, looked, last, memory = evaluation.frames, 1, first, Memory()
    chosen = range(1, count) if every else sorted({1, count // 2, count - 1} - {0, count})
    for frame in chosen:
        if evaluation.spent:
            break
        looked += 1
        scene, spans = evaluation.run(frame)
        if scene is None or (last is not None and same_nodes(scene, last)):
            continue
        last, result = scene, Diagnostics()
        check_compiles(scene, spans, result, after=after, memory=memory)
        known = {d.code for d in diagnostics}
        name_frame(result, 0, frame)
        for d in result:
            if d.severity == "error" or d.code not in known:
                diagnostics.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
    evaluation.warn_of_zeros()
    return looked, len(chosen) + 1


def check_evaluated(
    tree: nodes.File | None,
    evaluation: Evaluation | None,
    scene: Scene | None,
    spans: Spans | None,
    diagnostics: Diagnostics,
    *,
    frames: Frames = "some",
) -> int:
    """Run all checks that follow evaluation; the number of frames left out, beyond the limits of one scene.

    Tree and evaluation are None for JSON, the scene is None if it has errors.
    """
    left = 0
    if scene is not None:
        check_compiles(scene, spans, diagnostics)
    if evaluation is not None and frames != "one":
        looked, wanted = check_frames(evaluation, diagnostics, first=scene, every=frames == "all")
        left = wanted - looked
    if tree is not None and not diagnostics.errors:
        find_unused(tree, diagnostics)  # a name that is misspelt where it is used is not a second mistake
    return left


def check(
    path: str | os.PathLike[str],
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    all_frames: bool = False,
) -> Diagnostics:
    """All diagnostics of a scene file, as ``scenelang check`` reports them.

    Args:
        path: the file.
        params: values for params, as for `scenelang.load`.
        model: check for this model instead of the one that the file names.
        root: folder that imports cannot leave; by default the file's.
        all_frames: check all frames of an animation, not only the first, second, middle and last one.

    Returns:
        Errors and warnings by their place; empty where there are none.

    Raises:
        OSError: the file cannot be opened.
    """
    return _look(Source(path, params=params, model=model, root=root), all_frames)


def check_text(
    text: str,
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    all_frames: bool = False,
    name: str = "<text>",
) -> Diagnostics:
    """All diagnostics of scene text, called ``name`` there; as `check`, but imports come from ``root``."""
    source = Source(text=SourceFile(name, text), params=params, model=model, root=root)
    return _look(source, all_frames)


def fix_text(
    text: str,
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    name: str = "<text>",
) -> tuple[str, Diagnostics]:
    """Scene text after the safe fixes of ``scenelang check --fix``, and what is left; as `check_text`."""

    def look(texts: Mapping[str, str]) -> Iterable[tuple[str | None, Diagnostic]]:
        text = SourceFile(name, texts[name])
        result = _look(Source(text=text, params=params, model=model, root=root), False)
        return [(name if d.span is not None and d.span.source.name == name else None, d) for d in result]

    settled = settle({name: text}, look)
    return settled.texts[name], Diagnostics(d for _, d in settled.left)


def _look(source: Source, all_frames: bool) -> Diagnostics:
    result = Diagnostics()
    with suppress(SceneError):  # it is not text
        source = source.parsed(result)
        evaluation = source.evaluation(result, replays=True)
        scene, spans = evaluation.run(0)
        frames: Frames = "all" if all_frames else "some"
        scene = None if result.errors else scene
        check_evaluated(source.tree, evaluation, scene, spans, result, frames=frames)
    result.items[:] = in_file_order(result.items)
    return result
