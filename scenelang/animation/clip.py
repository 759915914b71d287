"""An animation's frames, compiled one after another.

A file is read, parsed and prepared once. A frame runs only the statements that ``t``, ``u`` or ``frame``
reach, and where its nodes are those of the frame before, so is its Program.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from scenelang.animation.timing import FrameRange, FramesError
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.suggest import plural
from scenelang.evaluate.evaluation import Evaluation, Source
from scenelang.graph.lower import Memory
from scenelang.scene.schema import Animation, Scene, same_nodes
from scenelang.scene.spans import SpanMap

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
        source: the scene, one that is prepared, or its frames.
        diagnostics: collects what is found, in each frame; a mistake in any frame ends the clip.
        fps: frames a second, instead of those of the first Scene's animation.
        reuse: keep what frames share; without it each frame is worked out by itself.

    Raises:
        SceneError: the scene's file is not text.
        OSError: it cannot be opened.
    """

    def __init__(
        self,
        source: Source | Evaluation | tuple[Scene, ...],
        diagnostics: Diagnostics | None = None,
        *,
        fps: float | None = None,
        reuse: bool = True,
    ) -> None:
        self.diagnostics = diagnostics if diagnostics is not None else Diagnostics()
        self.reuse = reuse
        self._evaluation: Evaluation | Given = (
            source.evaluation(self.diagnostics, replays=reuse)
            if isinstance(source, Source)
            else Given(source, fps)
            if isinstance(source, tuple)
            else source
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

    def numbers(self, frames: FrameRange) -> range:
        """The numbers of the frames that are asked for; raises `SceneError` where some are not there."""
        animation = self.animation
        try:
            return frames.among(animation.frames)
        except FramesError as error:
            count = plural(animation.frames, "frame")
            help = f"{animation.seconds:g} s at {animation.fps:g} frames a second make {count}"
            self.diagnostics.add("E0337", str(error), None, help=help)
            raise SceneError(self.diagnostics) from None

    def shot(self, number: int) -> Shot:
        """Evaluate a frame; raises `SceneError` if it has errors."""
        scene, spans = self._evaluation.run(number)
        if scene is None or self.diagnostics.errors:
            raise SceneError(self.diagnostics)
        return Shot(number, scene, spans)

    def program(self, shot: Shot) -> Program:
        """Compile a frame; raises `SceneError`, or `FileNotFoundError` where the model has no weights."""
        from scenelang.program.compile import compile_scene

        if self.reuse and self._last is not None and same_nodes(self._last[0].scene, shot.scene):
            return self._last[1]
        program = compile_scene(
            shot.scene, spans=shot.spans, diagnostics=self.diagnostics, memory=self._memory
        )
        self._last = shot, program
        return program
