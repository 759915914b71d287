"""An animation's frames, compiled one after another.

A file is read, parsed and prepared once. A frame runs only the statements that ``t``, ``u`` or ``frame``
reach, and where its nodes are those of the frame before, so is its Program.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.evaluate.evaluation import Evaluation
from scenelang.evaluate.loader import Unreadable, read_source
from scenelang.evaluate.session import Defines
from scenelang.graph.lower import Memory
from scenelang.scene.schema import Animation, Scene, same_nodes
from scenelang.scene.spans import SpanMap
from scenelang.syntax import parse

if TYPE_CHECKING:
    from scenelang.program.program import Program

STILL = Animation(seconds=1.0, fps=1.0)
"""What a scene without ``animate`` is: one frame."""


@dataclass(frozen=True, slots=True)
class Shot:
    """One frame."""

    number: int  # from 0
    scene: Scene  # evaluated
    spans: SpanMap  # where its nodes were written


@dataclass(frozen=True, slots=True)
class Given:
    """Frames that are Scenes already."""

    scenes: tuple[Scene, ...]  # at least one
    fps: float | None = None  # frames a second; None for those of the first scene's animation
    wanted: tuple[Path, ...] = ()

    @property
    def animates(self) -> bool:
        return len(self.scenes) > 1

    @property
    def animation(self) -> Animation:
        """How long they last; raises `ValueError` where nothing says how fast, or their canvases differ."""
        if len({scene.canvas for scene in self.scenes}) > 1:
            raise ValueError("scenes with several canvases, where size says one for all")
        first, count = self.scenes[0].animation, len(self.scenes)
        fps = self.fps or (first.fps if first is not None else STILL.fps if count == 1 else None)
        if fps is None:
            raise ValueError("scenes without an animation, where fps says how fast they follow each other")
        return Animation(count / fps, fps, first.loop if first is not None else True)

    def run(self, number: int) -> tuple[Scene, SpanMap]:
        return self.scenes[number], SpanMap()


class Clip:
    """A scene to be evaluated and compiled frame by frame, or Scenes that are its frames.

    Args:
        diagnostics: collects what is found, in each frame; a mistake in any frame ends the clip.
        model: name of the model to draw with, instead of the scene's.
        root: folder that imports cannot leave; by default that of ``path``, where the text was read from.
        size: canvas in pixels, instead of the scene's.
        fps: frames a second, instead of those that ``animate`` names: the seconds stay, so that there are
            seconds × fps frames, and t and u follow.
        texts: what imported files hold, by their resolved paths, instead of what is on the disk.
        reuse: keep what frames share; without it each frame is worked out by itself.
    """

    def __init__(
        self,
        source: SourceFile | tuple[Scene, ...] | Evaluation,
        *,
        path: Path | None = None,
        diagnostics: Diagnostics | None = None,
        defines: Mapping[str, Any] | Defines | None = None,
        model: str | None = None,
        root: Path | None = None,
        size: tuple[int, int] | None = None,
        fps: float | None = None,
        texts: Mapping[Path, str] | None = None,
        reuse: bool = True,
    ) -> None:
        self.diagnostics = diagnostics if diagnostics is not None else Diagnostics()
        self.model, self.size, self.reuse = model, size, reuse
        self._evaluation: Evaluation | Given = (
            source
            if isinstance(source, Evaluation)
            else Given(source, fps)
            if isinstance(source, tuple)
            else Evaluation(
                parse(source, self.diagnostics),
                diagnostics=self.diagnostics,
                defines=defines,
                model=model,
                root=root,
                path=path,
                fps=fps,
                texts=texts,
                replays=reuse,
            )
        )
        self._last: tuple[Shot, Program] | None = None
        self._memory = Memory() if reuse else None
        self.wanted = self._evaluation.wanted
        """All files that it imports, also those that are not there."""

    @cached_property
    def first(self) -> Shot:
        """The first frame, which every scene has; raises `SceneError` if it has errors."""
        return self.shot(0)

    @property
    def animates(self) -> bool:
        """Whether the scene has ``animate(…)``."""
        return self._evaluation.animates

    @property
    def texts(self) -> tuple[str, ...]:
        """What its files hold."""
        given = self._evaluation
        return () if isinstance(given, Given) else tuple(source.text for source in given.sources)

    @property
    def animation(self) -> Animation:
        """Length, frames a second and whether it is a loop."""
        if isinstance(self._evaluation, Given):
            return self._evaluation.animation
        return self.first.scene.animation or STILL

    @property
    def frames(self) -> int:
        """Number of frames, at least 1."""
        given = self._evaluation
        return len(given.scenes) if isinstance(given, Given) else self.animation.frames

    def shot(self, number: int) -> Shot:
        """Evaluate a frame; raises `SceneError` if it has errors."""
        scene, spans = self._evaluation.run(number)
        if scene is None or self.diagnostics.errors:
            raise SceneError(self.diagnostics)
        if self.size is not None:
            sized = scene.sized(self.size)
            if spans.span(scene) is not None:
                spans.copy(scene, sized)
            scene = sized
        return Shot(number, scene, spans)

    def program(self, shot: Shot) -> Program:
        """Compile a frame; raises `SceneError`, or `FileNotFoundError` where the model has no weights."""
        from scenelang.program.compile import compile_scene

        if self.reuse and self._last is not None and same_nodes(self._last[0].scene, shot.scene):
            return self._last[1]
        program = compile_scene(
            shot.scene, spans=shot.spans, diagnostics=self.diagnostics, model=self.model, memory=self._memory
        )
        self._last = shot, program
        return program


def open_clip(path: str | os.PathLike[str], **options: Any) -> Clip:
    """A clip of a scene file; ``options`` as for `Clip`. Raises `SceneError` where it is not text."""
    where = Path(path)
    name = os.fspath(path)
    try:
        source = read_source(where, name)
    except Unreadable as error:
        found = options.get("diagnostics") or Diagnostics()
        found.add(error.code, f"cannot read `{where.name}`: {error}", Span(SourceFile(name, ""), 0, 0))
        raise SceneError(found) from None
    return Clip(source, path=where, **options)
