"""What one evaluation takes from outside, and what it shares: diagnostics, spans, limits and counters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from scenelang.diagnostics.diagnostic import Diagnostics, Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import listing, nearest
from scenelang.evaluate.limits import MAX_OBJECTS, MAX_PARTS, MAX_STEPS, Halt
from scenelang.evaluate.names import UNBOUND, Needs
from scenelang.evaluate.report.reporter import Reporter
from scenelang.records import Record
from scenelang.scene.schema import Animation, Elements
from scenelang.scene.spans import SpanMap
from scenelang.scene.stage import Unsaid

Watch = Callable[[Span, Any], None]
"""What an editor looks on with; it may raise `Halt` to end the evaluation."""


class Settings(Record, frozen=False):
    """What the top level sets, and where each was given.

    Args:
        canvas: width and height in pixels.
        background: colour as written, or None for transparency.
        stage: camera, light and ground, where they are stated.
        given: the place of each setting, by its word.
        model: name of the model that the file names.
    """

    canvas: tuple[int, int] = (256, 256)
    background: tuple[float, float, float] | Unsaid | None = "default"
    stage: dict[str, Any] = field(default_factory=dict)
    animation: Animation | None = None
    model: str | None = None
    given: dict[str, Span] = field(default_factory=dict)


class Session(Record, frozen=False):
    """The state of one evaluation over all its files.

    Args:
        expressions, statements: how each class of the syntax tree is prepared.
        frame: the one that is run, from 0.
        fps: frames a second, instead of those that ``animate`` names.
        replays: run what no frame changes once; the evaluation is for several frames.
        roots: the live slots of every file.
        needs: collects what the statement being prepared depends on.
        elements: files of elements that were imported, by their places.
        zeros: where an angle was a 0 without a unit that frames may change.
        still: it has been said that there is no animation for time to run in.
        watch: called with the place of each name and its value, and of each statement and its node.
    """

    report: Reporter
    expressions: Mapping[type, Callable[..., Any]]
    statements: Mapping[type, Callable[..., Any]]
    frame: int = 0
    fps: float | None = None
    spans: SpanMap = field(default_factory=SpanMap)
    steps: int = 0
    objects: int = 0
    parts: int = 0
    depth: int = 0
    node_depth: int = 0
    animated: list[Any] = field(default_factory=lambda: [UNBOUND] * 4)
    settings: Settings = field(default_factory=Settings)
    replays: bool = False
    roots: list[list[Any]] = field(default_factory=list)
    needs: Needs = field(default_factory=Needs)
    elements: dict[Path, Elements] = field(default_factory=dict)
    zeros: dict[tuple[SourceFile, Span], Span] = field(default_factory=dict)
    still: bool = False
    watch: Watch | None = None

    def restart(self, frame: int) -> None:
        """Forget what the last run left, to run what is prepared for another frame."""
        self.frame = frame
        self.spans = SpanMap()
        self.steps = self.objects = self.parts = self.depth = self.node_depth = 0
        self.report.calls = None
        self.settings = Settings(given=self.settings.given, model=self.settings.model)
        for root in self.roots:
            root[:] = [UNBOUND] * len(root)

    def halt(self, code: str, message: str, span: Span, help: str | None = None) -> Halt:
        """Report a limit that was met; the caller raises what this returns."""
        self.report.error(code, message, span, help=help)
        return Halt()

    def tick(self, steps: int, span: Span) -> None:
        """Count evaluation steps."""
        self.steps += steps
        if self.steps > MAX_STEPS:
            raise self.halt("E0322", f"more than {MAX_STEPS:,} evaluation steps", span)

    def count_parts(self, parts: int, span: Span) -> None:
        """Count nodes, transforms and operations that a Scene will hold."""
        self.parts += parts
        if self.parts > MAX_PARTS:
            raise self.halt("E0320", f"more than {MAX_PARTS:,} nodes and transforms in one scene", span)

    def count_objects(self, number: int, span: Span) -> None:
        """Count objects that a Scene will hold."""
        self.objects += number
        if self.objects > MAX_OBJECTS:
            raise self.halt("E0320", f"more than {MAX_OBJECTS:,} objects in one scene", span)


class Defines(Record, frozen=False):
    """Values for params from outside, and the params that files have.

    Args:
        values: text as after ``-D NAME=``, or a Python value.
        known: where each param stands, by its name seen from the first file.
        lost: words that recovery skipped: a param may have been among them.
    """

    values: Mapping[str, Any]
    known: dict[str, Span] = field(default_factory=dict)
    lost: set[str] = field(default_factory=set)

    def report_unused(self, diagnostics: Diagnostics) -> None:
        """Report values that no param takes."""
        for name in self.values:
            if name in self.known or name in self.lost:
                continue
            found = nearest(name, self.known)
            if found:
                help, labels = f"did you mean `{found}`?", [Label(self.known[found], "this param")]
            else:
                names = listing(self.known)
                help, labels = f"its params are {names}" if names else "the scene has no params", []
            diagnostics.add("E0211", f"no param `{name}` to set", None, help=help, labels=labels)
