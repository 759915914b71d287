"""Everything that can be said of a scene before it is lifted, of some frames or all; imports no numpy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.evaluate.evaluation import Evaluation, name_frame
from scenelang.graph.lower import Memory, Spans
from scenelang.graph.nodes import Graph
from scenelang.models.manifest import Manifest
from scenelang.passes import check_scene
from scenelang.program.compile import find_model
from scenelang.resolve.unused import find_unused
from scenelang.scene.schema import Scene, same_nodes
from scenelang.syntax import nodes

Frames = Literal["one", "some", "all"]
"""Which frames of an animation are looked at: the one asked for; the first, second, middle and last; all."""

After = Callable[[str, Graph], None]


def check_compiles(
    scene: Scene,
    spans: Spans | None,
    diagnostics: Diagnostics,
    *,
    model: str | None = None,
    after: After | None = None,
    memory: Memory | None = None,
) -> Manifest | None:
    """Run the compiler's checks.

    Args:
        scene: a concrete scene.
        spans: where its nodes were written, None if it did not come from text.
        diagnostics: receives errors and warnings.
        model: draw with this model instead of the scene's.
        after, memory: as for `check_scene`.

    Returns:
        The manifest of the model that draws it; None where there is none.
    """
    manifest = find_model(scene, diagnostics, model=model, spans=spans)
    if manifest is not None:
        check_scene(scene, spans, diagnostics, manifest, after, memory=memory)
    return manifest


def check_frames(
    evaluation: Evaluation,
    diagnostics: Diagnostics,
    *,
    first: Scene | None = None,
    model: str | None = None,
    every: bool = False,
    after: After | None = None,
) -> tuple[int, int]:
    """Look at further frames of an animation whose first frame has been run.

    They share the limits of one frame: where these are met, the rest is left out.

    Args:
        evaluation: has run frame 0.
        diagnostics: those of the evaluation; receives what frame 0 did not have, with the frame's number.
        first: the scene of frame 0, None if it has errors.
        model, after: as for `check_compiles`.
        every: look at all frames, instead of the second, the middle and the last one.

    Returns:
        How many frames have been looked at, and how many were to be.
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
        last, found = scene, Diagnostics()
        check_compiles(scene, spans, found, model=model, after=after, memory=memory)
        known = {d.code for d in diagnostics}
        name_frame(found, 0, frame)
        for d in found:
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
    model: str | None = None,
    frames: Frames = "some",
) -> int:
    """What there is to say of a scene beyond its evaluation.

    Args:
        tree: its text's; None for JSON.
        evaluation: has run one frame, the first unless ``frames`` is ``"one"``; None for JSON.
        scene: what came of it, None if it has errors.
        spans: where that was written.
        diagnostics: those of the evaluation; receives the others.
        model: draw with this model instead of the scene's.
        frames: which are looked at.

    Returns:
        How many frames were to be looked at and were not, as they exceed the limits of one scene.
    """
    left = 0
    if scene is not None:
        check_compiles(scene, spans, diagnostics, model=model)
    if evaluation is not None and frames != "one":
        looked, wanted = check_frames(
            evaluation, diagnostics, first=scene, model=model, every=frames == "all"
        )
        left = wanted - looked
    if tree is not None and not diagnostics.errors:
        find_unused(tree, diagnostics)  # a name that is misspelt where it is used is not a second mistake
    return left
