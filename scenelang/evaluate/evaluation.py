"""From the syntax tree to a concrete Scene.

A file is prepared (names resolved, expressions made into closures), then run once; both steps report
what they find and go on. A Scene comes out only where nothing is wrong.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from scenelang.deep import deep_stack
from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import listing
from scenelang.evaluate.builder import Builder, make
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.inputs import Defines
from scenelang.evaluate.limits import MAX_OBJECTS, MAX_STEPS, Halt
from scenelang.evaluate.loader import Loader, Unreadable, read_source
from scenelang.evaluate.names import UNBOUND
from scenelang.evaluate.prepare import EXPRESSIONS, STATEMENTS
from scenelang.evaluate.prepare.blocks import Body
from scenelang.evaluate.prepare.imports import prepare_file
from scenelang.evaluate.report.bad_calls import report_misfits
from scenelang.evaluate.report.reporter import Reporter
from scenelang.evaluate.session import Session, Watch
from scenelang.evaluate.vocabulary import Vocabulary, vocabulary
from scenelang.models.manifest import Manifest
from scenelang.scene.schema import Scene
from scenelang.scene.spans import Place, SpanMap
from scenelang.syntax import nodes, parse


def evaluate(
    file: nodes.File,
    *,
    diagnostics: Diagnostics,
    defines: Mapping[str, Any] | Defines | None = None,
    models: Iterable[Manifest] | None = None,
    model: str | None = None,
    root: Path | None = None,
    path: Path | None = None,
    frame: int = 0,
    texts: Mapping[Path, str] | None = None,
    watch: Watch | None = None,
) -> tuple[Scene | None, SpanMap]:
    """Evaluate a syntax tree.

    Args:
        file: the tree.
        diagnostics: where mistakes go.
        defines: values for params: text as after ``-D NAME=``, or Python values. `Defines` may be shared by
            several evaluations; the caller then reports what none of them used.
        models: manifests that names are taken from; by default those of all shipped models.
        model: name of the model to use, instead of the one that the file names.
        root: folder that imports cannot leave; by default that of ``path``.
        path: file that the tree was read from.
        frame: frame of the animation, from 0.
        texts: what imported files hold, by their resolved paths, instead of what is on the disk.
        watch: is shown every name's value and every node; see `Session`.

    Returns:
        The Scene, or None if anything is wrong, and where its nodes were written.
    """
    evaluation = Evaluation(
        file,
        diagnostics=diagnostics,
        defines=defines,
        models=models,
        model=model,
        root=root,
        path=path,
        frame=frame,
        texts=texts,
        watch=watch,
    )
    return evaluation.run(frame)


class Evaluation:
    """A file prepared once, to be run for any number of frames.

    Args:
        file: the tree.
        diagnostics: where mistakes go; each is reported for the first frame that has it.
        defines, models, model, root, path, texts, watch: as for `evaluate`.
        frame: the first frame that is run.
        fps: frames a second, instead of those that ``animate`` names.
        replays: run what no frame changes once.
    """

    def __init__(
        self,
        file: nodes.File,
        *,
        diagnostics: Diagnostics,
        defines: Mapping[str, Any] | Defines | None = None,
        models: Iterable[Manifest] | None = None,
        model: str | None = None,
        root: Path | None = None,
        path: Path | None = None,
        frame: int = 0,
        fps: float | None = None,
        replays: bool = False,
        texts: Mapping[Path, str] | None = None,
        watch: Watch | None = None,
    ) -> None:
        self.file, self.diagnostics = file, diagnostics
        self.animates = _animates(file)
        self._errors = len(diagnostics.errors)
        words = _choose(file, vocabulary(models), model, diagnostics)
        self._steps = self._objects = 0
        self._session = session = Session(
            Reporter(diagnostics),
            words,
            EXPRESSIONS,
            STATEMENTS,
            frame,
            fps,
            replays=replays and self.animates,
        )
        session.watch = watch
        resolved = path.resolve() if path is not None else None
        folder = root.resolve() if root is not None else resolved.parent if resolved is not None else None
        loader = Loader(folder, [resolved] if resolved is not None else [], texts=texts or {})
        self.inputs = inputs = defines if isinstance(defines, Defines) else Defines(defines or {})
        self._unit = Unit(file.span.source, session, loader, inputs, resolved)
        self._body: Body | None = None
        if not self.animates:
            session.animated[:] = [0.0, 0.0, 0.0, 1.0]
        with deep_stack():
            try:
                self._body = prepare_file(self._unit, file)
                inputs.lost |= self._unit.lost
                if inputs is not defines:
                    inputs.report_unused(diagnostics)
            except Halt:
                pass
            with suppress(Halt):
                report_misfits(session.report)
        self.wanted = tuple(loader.wanted)
        """All files that it imports, also those that are not there."""
        self.sources = (file.span.source, *(imported.span.source for imported in loader.parsed.values()))
        """The text of the file and of all that it imports."""

    @property
    def frames(self) -> int:
        """Number of frames of the animation, as far as the last run knows; 1 without one."""
        animation = self._session.settings.animation
        return 1 if animation is None else animation.frames

    @property
    def spent(self) -> bool:
        """Whether all runs together exceed the limits of one."""
        return self._steps > MAX_STEPS or self._objects > MAX_OBJECTS

    def warn_of_zeros(self) -> None:
        """Warn of angles that were 0 without a unit whenever they were met, and that frames may change."""
        errors = self.diagnostics.errors
        wrong = {d.span for d in errors} | {label.span for d in errors for label in d.labels}
        for span in self._session.zeros.values():
            if span not in wrong:
                message = "0 without a unit, which another frame may change"
                help = "any other number is an error: multiply by 1deg, 1rad or 1turn"
                self.diagnostics.add("W0303", message, span, help=help)

    def run(self, frame: int) -> tuple[Scene | None, SpanMap]:
        """Evaluate a frame; the Scene is None if anything was wrong so far, in any frame.

        What is found in another frame than the first has the frame's number.
        """
        session, before = self._session, len(self.diagnostics)
        if not self.animates and frame != 0:
            self.diagnostics.add("E0337", f"frame {frame} of a scene without animate(…)", None)
        session.restart(frame)
        if self.animates:
            session.animated[:] = [UNBOUND] * 4
        out = Builder()
        with deep_stack():
            try:
                if self._body is not None:
                    session.tick(self._body.weight, self.file.span)
                    for act in self._body.actions:
                        act(self._unit.root_env, out)
            except Halt:
                pass
        self._steps += session.steps
        self._objects += session.objects
        if self.animates and frame:
            name_frame(self.diagnostics, before, frame)
        if self._body is None or len(self.diagnostics.errors) > self._errors:
            return None, session.spans
        settings = session.settings
        scene = make(
            Scene,
            {
                "version": 1,
                "model": session.vocabulary.chosen.name if session.vocabulary.chosen else None,
                "canvas": settings.canvas,
                "background": settings.background,
                "animation": settings.animation,
                "nodes": tuple(out.children),
            },
        )
        written = settings.given.get("model")
        if written is not None:
            session.spans.record(scene, Place(written, written))
        return scene, session.spans


def _choose(file: nodes.File, words: Vocabulary, model: str | None, diagnostics: Diagnostics) -> Vocabulary:
    """The vocabulary of the model from outside, or of the one that the file names."""
    if model is not None:
        chosen = words.choose(model)
        if chosen is None:
            help = f"there is {listing(m.name for m in words.models)}"
            diagnostics.add("E0210", f"unknown model `{model}`", None, help=help)
        return chosen or Vocabulary(words.models, blind=True)
    for stmt in file.statements:
        if isinstance(stmt, nodes.Model) and isinstance(stmt.name, nodes.String):
            # An unknown model is reported when its statement is met.
            return words.choose(stmt.name.value) or Vocabulary(words.models, blind=True)
    return words


def _animates(file: nodes.File) -> bool:
    return any(isinstance(s, nodes.Call) and s.name.text == "animate" for s in file.statements)


def load_scene(
    path: str | os.PathLike[str],
    *,
    diagnostics: Diagnostics,
    defines: Mapping[str, Any] | Defines | None = None,
    root: str | os.PathLike[str] | None = None,
    model: str | None = None,
    models: Iterable[Manifest] | None = None,
    frame: int = 0,
) -> tuple[Scene | None, SpanMap]:
    """Read, parse and evaluate a scene file; arguments as for `evaluate`.

    Raises:
        OSError: the file cannot be opened.
    """
    where = Path(path)
    try:
        source = read_source(where, os.fspath(path))
    except Unreadable as error:
        empty = SourceFile(os.fspath(path), "")
        diagnostics.add(error.code, f"cannot read `{where.name}`: {error}", Span(empty, 0, 0))
        return None, SpanMap()
    return load_source(
        source,
        diagnostics=diagnostics,
        defines=defines,
        root=Path(root) if root is not None else None,
        path=where,
        model=model,
        models=models,
        frame=frame,
    )


def load_source(
    source: SourceFile,
    *,
    diagnostics: Diagnostics,
    defines: Mapping[str, Any] | Defines | None = None,
    root: Path | None = None,
    path: Path | None = None,
    model: str | None = None,
    models: Iterable[Manifest] | None = None,
    frame: int = 0,
) -> tuple[Scene | None, SpanMap]:
    """Parse and evaluate scene text; arguments as for `evaluate`."""
    before, start = len(diagnostics.errors), len(diagnostics)
    file = parse(source, diagnostics)
    scene, spans = evaluate(
        file,
        diagnostics=diagnostics,
        defines=defines,
        models=models,
        model=model,
        root=root,
        path=path,
        frame=frame,
    )
    diagnostics.items[start:] = in_file_order(diagnostics.items[start:])
    return (scene if len(diagnostics.errors) == before else None), spans


def name_frame(diagnostics: Diagnostics, since: int, frame: int) -> None:
    """Add the number of a frame to the messages of all diagnostics from index ``since`` on."""
    for index, d in enumerate(diagnostics.items[since:], since):
        if d.code != "E0337":  # which names it
            diagnostics.items[index] = replace(d, message=f"{d.message} (frame {frame})")


def in_file_order(found: list[Diagnostic]) -> list[Diagnostic]:
    """Diagnostics by place, file by file as they were first met; those without a place come last."""
    files: dict[str, int] = {}

    def key(d: Diagnostic) -> tuple[int, int]:
        if d.span is None:
            return len(found), 0
        return files.setdefault(d.span.source.name, len(files)), d.span.start

    return sorted(found, key=key)
