"""Scenes that the command line names: files, or ``-`` for standard input."""

from __future__ import annotations

import sys
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenelang.backend.options import DEFAULT, How
from scenelang.cli.progress import Clock
from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics
from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.evaluation import Evaluation, Source, report_unreadable
from scenelang.evaluate.limits import MAX_BYTES
from scenelang.evaluate.loader import Unreadable, decode_source, read_source
from scenelang.evaluate.session import Defines
from scenelang.files import note_input
from scenelang.records import Record
from scenelang.scene.schema import Scene
from scenelang.scene.spans import SpanMap
from scenelang.syntax import nodes

if TYPE_CHECKING:
    from scenelang.graph.nodes import Graph
    from scenelang.program.program import Program

STDIN = "-"
JSON = ".json"


class Request(Record):
    """Options of the command line that hold for every scene."""

    source: Source  # all but its text; values for params are shared by all scenes
    frame: int | None = None  # of an animation, to be drawn as a picture

    def named(self) -> dict[str, Any]:
        """The same by the names that `scenelang.load` has for them."""
        given = self.source
        own = {"params": given.values, "model": given.model, "root": given.root, "size": given.size}
        return {**own, "frame": self.frame or 0}


class Input(Record, frozen=False):
    """A scene or a compiled program that the command line names, and what is made of it."""

    name: str  # as the user wrote it
    how: How = DEFAULT  # how it is drawn
    diagnostics: Diagnostics = field(default_factory=Diagnostics)  # what was found so far
    trouble: str | None = None  # why a compiled program cannot be drawn
    tree: nodes.File | None = None  # None if it is not text
    evaluation: Evaluation | None = None  # runs its other frames; None for JSON
    scene: Scene | None = None  # None if it has errors
    spans: SpanMap = field(default_factory=SpanMap)  # where its nodes were written
    program: Program | None = None  # what the network draws
    # the graph after `lower` and each pass, in order
    graphs: dict[str, Graph] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)  # what to say about it on `-v`

    def failed(self, strict: bool = False) -> bool:
        """True where there is nothing to draw."""
        return self.trouble is not None or any(d.severity == "error" or strict for d in self.diagnostics)


def stem_of(name: str) -> str:
    """What files made of a scene are called."""
    return "stdin" if name == STDIN else Path(name).stem


def read_text(name: str, diagnostics: Diagnostics) -> SourceFile | None:
    """The text of a scene, None after a report that it is not text; raises `OSError` if it cannot be read."""
    try:
        if name == STDIN:
            note_input("/dev/stdin")  # which may be a file, by `<`
            return decode_source(sys.stdin.buffer.read(MAX_BYTES + 1), "<stdin>")
        return read_source(Path(name), name)
    except Unreadable as error:
        report_unreadable(name, error, diagnostics)
        return None


def read_input(
    name: str,
    request: Request,
    clock: Clock | None = None,
    how: How = DEFAULT,
    text: SourceFile | None = None,
) -> Input:
    """Read one scene: text is evaluated, JSON (by its suffix, or `{` first in standard input) just read.

    ``text`` is what it holds, where that was read before. Raises `OSError` where it cannot be opened.
    """
    clock, found, frame = clock or Clock(), Input(name, how), request.frame or 0
    text = text or read_text(name, found.diagnostics)
    if text is None:
        return found
    path, root = (None, ".") if name == STDIN else (name, None)
    source = replace(request.source, path=path, text=text, root=request.source.root or root)
    if name.endswith(JSON) or (path is None and text.text.lstrip()[:1] == "{"):
        from scenelang.scene.json import load_json

        if frame:
            fact = f"frame {frame} of a scene from JSON, which is one frame"
            found.diagnostics.add("E0337", fact, None, help="convert that frame of the animation to JSON")
        with clock("read"):
            folder = Path(source.root or Path(name).parent)
            scene, spans = load_json(text, Scene, found.diagnostics, folder)
            if scene is not None and (source.size or source.model):
                made = (scene if source.size is None else scene.sized(source.size)).of_model(source.model)
                if spans.span(scene) is not None:
                    spans.copy(scene, made)
                scene = made
    else:
        with clock("parse"):
            source = source.parsed(found.diagnostics)
        with clock("evaluate"):
            found.evaluation = source.evaluation(found.diagnostics, frame=frame, replays=True)
            scene, spans = found.evaluation.run(frame)
        found.tree = source.tree
    if scene is not None and not found.diagnostics.errors:
        found.scene, found.spans = scene, spans
    return found


def unused_defines(request: Request) -> list[Diagnostic]:
    """An error for every ``-D`` that no scene read so far has a param for."""
    found = Diagnostics()
    params = request.source.params
    if isinstance(params, Defines):
        params.report_unused(found)
    return found.items


def merged(parts: list[list[Diagnostic]]) -> Diagnostics:
    """All diagnostics; what several scenes import and share is said once."""
    found = Diagnostics()
    for d in (d for part in parts for d in part):
        found.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
    return found
