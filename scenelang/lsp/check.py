"""Everything that can be said of a scene, in the background: evaluation, the compiler's checks, values.

Nothing here touches a `Document`: a check gets what it needs when it begins and gives back one value, so that
it may run beside the editing.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.evaluate.evaluation import Source, in_file_order
from scenelang.evaluate.limits import Halt
from scenelang.graph.nodes import Graph
from scenelang.models.manifest import Manifest
from scenelang.program.check import check_compiles, check_frames
from scenelang.resolve.unused import find_unused
from scenelang.syntax import nodes

MAX_SEEN: Final = 4  # values and nodes kept of one place


class Superseded(Exception):
    """The text has changed: nobody wants this check any more."""


@dataclass(slots=True)
class Seen:
    """What one place had while a scene was evaluated.

    Args:
        values: of the first frame the first few, in order, equal ones once.
        count: how many there were.
    """

    values: list[Any] = field(default_factory=list)
    count: int = 0


@dataclass(slots=True)
class Checked:
    """What a check found.

    Args:
        diagnostics: mistakes and warnings of evaluation and compiler, without those of syntax.
        wanted: the files that it imports, also those that are not there.
        seen: by file name, start and end: values of names, nodes of statements.
        manifest: the model that draws it, where that is known.
    """

    source: SourceFile
    diagnostics: list[Diagnostic]
    wanted: frozenset[Path]
    seen: dict[tuple[str, int, int], Seen]
    manifest: Manifest | None = None


def check(
    file: nodes.File,
    path: Path | None,
    root: Path | None,
    texts: Mapping[Path, str],
    model: str | None,
    parsed: bool,
    stop: threading.Event,
) -> Checked:
    """Evaluate a scene and run the compiler's checks.

    Args:
        file: the tree.
        path: its file, if it has one.
        root: the folder that imports cannot leave; by default the file's.
        texts: what open files hold.
        model: draw with this model instead of the scene's.
        parsed: the text has no syntax mistakes.
        stop: asks it to give up.

    Raises:
        Superseded: ``stop`` was set meanwhile.
    """
    found, frame = Diagnostics(), 0
    seen: dict[tuple[str, int, int], Seen] = {}

    def watch(span: Span, value: Any) -> None:
        if stop.is_set():
            raise Halt
        if frame:
            return
        place = seen.setdefault((span.source.name, span.start, span.end), Seen())
        place.count += 1
        if len(place.values) < MAX_SEEN and not any(value is old for old in place.values):
            place.values.append(value)

    def after(stage: str, graph: Graph | None = None) -> None:
        if stop.is_set():
            raise Superseded

    source = Source(path, tree=file, model=model, root=root, texts=texts)
    evaluation = source.evaluation(found, replays=True, watch=watch)
    scene, spans = evaluation.run(0)
    after("evaluate")
    manifest = None
    if parsed:
        find_unused(file, found)
        if scene is not None:
            manifest = check_compiles(scene, spans, found, after=after)
        frame = 1
        check_frames(evaluation, found, first=scene, after=after)
        after("frames")
    wanted = frozenset(evaluation.wanted)
    return Checked(file.span.source, in_file_order(found.items), wanted, seen, manifest)
