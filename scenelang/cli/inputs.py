"""Scenes that the command line names: files, or ``-`` for standard input."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

from scenelang.cli.progress import Clock
from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.evaluate.evaluation import Evaluation
from scenelang.evaluate.limits import MAX_BYTES
from scenelang.evaluate.loader import Unreadable, decode_source, read_source
from scenelang.evaluate.session import Defines
from scenelang.files import note_input
from scenelang.records import Record
from scenelang.scene.schema import Scene
from scenelang.scene.spans import SpanMap
from scenelang.syntax import nodes, parse

STDIN = "-"
JSON = ".json"


class Request(Record):
    """What the command line says about every scene."""

    defines: Defines  # values for params, shared by all scenes
    model: str | None = None  # name of the model to use
    root: str | None = None  # folder that imports cannot leave
    frame: int = 0  # frame of the animation
    size: tuple[int, int] | None = None  # canvas instead of the scene's
    # what to read instead of some imported files, by their resolved paths
    texts: Mapping[Path, str] = field(default_factory=dict)


class Input(Record, frozen=False):
    """A scene as it was read."""

    tree: nodes.File | None = None  # None if it is not text
    scene: Scene | None = None  # None if it has errors
    spans: SpanMap = field(default_factory=SpanMap)  # where its nodes were written
    diagnostics: Diagnostics = field(default_factory=Diagnostics)  # what was found so far
    evaluation: Evaluation | None = None  # runs its other frames; None for JSON


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
        empty = SourceFile(name, "")
        diagnostics.add(error.code, f"cannot read `{name}`: {error}", Span(empty, 0, 0))
        return None


def read_input(
    name: str, request: Request, clock: Clock | None = None, source: SourceFile | None = None
) -> Input:
    """Read one scene: text is evaluated, JSON (by its suffix, or `{` first in standard input) just read.

    ``source`` is its text, where it was read before. Raises `OSError` where it cannot be opened.
    """
    clock = clock or Clock()
    found = Input()
    path = None if name == STDIN else Path(name)
    if source is None:
        source = read_text(name, found.diagnostics)
    if source is None:
        return found
    if name.endswith(JSON) or (path is None and source.text.lstrip()[:1] == "{"):
        from scenelang.scene.json import load_json

        if request.frame:
            fact = f"frame {request.frame} of a scene from JSON, which is one frame"
            found.diagnostics.add("E0337", fact, None, help="convert that frame of the animation to JSON")
        with clock("read"):
            folder = Path(request.root or ("." if path is None else path.parent))
            scene, spans = load_json(source, Scene, found.diagnostics, folder)
    else:
        with clock("parse"):
            found.tree = tree = parse(source, found.diagnostics)
        root = request.root if request.root is not None else "." if path is None else None
        with clock("evaluate"):
            found.evaluation = evaluation = Evaluation(
                tree,
                diagnostics=found.diagnostics,
                defines=request.defines,
                model=request.model,
                root=None if root is None else Path(root),
                path=path,
                frame=request.frame,
                replays=True,
                texts=request.texts,
            )
            scene, spans = evaluation.run(request.frame)
    if scene is None or found.diagnostics.errors:
        return found
    if request.size is not None:
        sized = scene.sized(request.size)
        if spans.span(scene) is not None:
            spans.copy(scene, sized)
        scene = sized
    found.scene, found.spans = scene, spans
    return found


def unused_defines(request: Request) -> list[Diagnostic]:
    """An error for every ``-D`` that no scene read so far has a param for."""
    found = Diagnostics()
    request.defines.report_unused(found)
    return found.items


def merged(parts: list[list[Diagnostic]]) -> Diagnostics:
    """All diagnostics; what several scenes import and share is said once."""
    found = Diagnostics()
    for d in (d for part in parts for d in part):
        found.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
    return found
