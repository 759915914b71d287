"""From a clip to files: draw what is missing, encode, put in place."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from scenelang.animation.apng import write_apng
from scenelang.animation.gif import write_gif
from scenelang.animation.painting import Drawable, Errand, Painter
from scenelang.animation.store import Encoder, Film, Store, deliver, put_frame
from scenelang.animation.targets import Target
from scenelang.animation.video import find_codec, write_video
from scenelang.animation.webp import write_webp
from scenelang.backend.options import RenderError, usable_cores
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.suggest import plural
from scenelang.files import output_place, write_whole
from scenelang.outputs import output_file

if TYPE_CHECKING:
    from scenelang.animation.gif import Palette
    from scenelang.program.program import Program

Beside = Callable[[Drawable, Store], Mapping[str, bytes]]
"""What is to lie beside a frame's picture, by suffixes; it may raise what ends the run."""
Failed = Callable[[int, SceneError], None]
"""Is told the number of a frame and what is wrong with it."""

WORTH_S: Final = 12.0  # drawing left that repays starting other processes, each of which loads torch
_FPS: Final = 1e-4, 1e6  # of films: beyond, formats cannot say how long a frame is shown
_TRIED: Final = 3  # frames drawn here before it is decided


@dataclass(frozen=True, slots=True)
class Progress:
    """How far an animation is.

    Args:
        stage: ``"drawing"`` or ``"encoding"``.
        done: of this stage, in frames for drawing and as a share for encoding.
        total: what it counts up to.
    """

    stage: str
    done: float
    total: float

    @property
    def told(self) -> str:
        """The stage in words, with the frame if it counts any."""
        return f"drawing {self.done:.0f}/{self.total:.0f}" if self.stage == "drawing" else self.stage


@dataclass(slots=True)
class RenderResult:
    """An animation that was written.

    Args:
        files: what was written, in order.
        frames: number of frames.
        drawn: pictures that were drawn now; equal frames are drawn once.
        resumed: pictures found from a run before, which was interrupted.
        compile_s: time to evaluate and compile all frames.
        draw_s: time to draw, encode pictures and wait for other processes.
        encode_s: time to encode the film.
        jobs: processes that drew.
        asked: processes that were asked for, where that is more than there are frames or cores.
        keys: digest of all that decides a frame, of each; empty for one that was left out.
    """

    files: list[Path]
    frames: int
    drawn: int = 0
    resumed: int = 0
    compile_s: float = 0.0
    draw_s: float = 0.0
    encode_s: float = 0.0
    jobs: int = 1
    asked: int | None = None
    keys: list[str] = field(default_factory=list)

    def lines(self) -> list[str]:
        """What there is to say about it."""
        each = 1000 / max(1, self.frames)
        asked = f" ({self.asked} asked for; more than frames or cores do not help)" if self.asked else ""
        return [
            f"{plural(self.drawn, 'picture')} drawn by {self.jobs} process{'es' * (self.jobs > 1)}{asked}, "
            f"{self.resumed} kept from a run before",
            f"a frame (ms): compile {self.compile_s * each:.1f}, draw {self.draw_s * each:.1f}, "
            f"encode {self.encode_s * each:.1f}",
        ]


class Helpers(Protocol):
    """Other processes that draw frames, here or on other machines."""

    @property
    def count(self) -> int:
        """How many there are."""

    @property
    def waiting(self) -> int:
        """Frames that are asked for and not known to be done."""

    def submit(self, program: Program, errand: Errand) -> None:
        """Have a Program drawn to files; waits while many are under way. Raises as `take`."""

    def take(self) -> None:
        """Wait until more is done; raises the `RenderError` or `OSError` by which something failed."""

    def close(self) -> None:
        """End them, whatever they are doing."""


def make(
    painter: Painter,
    target: Target,
    numbers: range,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    palette: Palette = "auto",
    dither: bool = False,
    strict: bool = False,
    beside: Beside | None = None,
    failed: Failed | None = None,
    progress: Callable[[Progress], None] = lambda _: None,
) -> RenderResult:
    """Draw frames and write them whole: nothing is put in place before all of it is there.

    Frames are kept in `Target.work` on the way. If the run ends before its time, they stay there, and the
    same call goes on with those that are missing.

    Args:
        jobs: processes that draw; by default this one, and others as soon as they would pay.
        cluster: address of a dask scheduler whose workers draw instead, or ``"local"``.
        palette, dither: of a GIF, see `write_gif`.
        strict: count warnings as errors.
        beside: is shown each frame before it is drawn, and says what further files of a sequence hold.
        failed: is told of a frame with errors, which is left out; by default it ends the run.
        progress: called from any thread.

    Raises:
        SceneError: a frame has errors.
        RenderError: a frame cannot be drawn, or the format cannot be written.
        OSError: a file cannot be written.
    """
    ready(target)
    if target.kind != "sequence" and not _FPS[0] <= (fps := painter.clip.animation.fps) <= _FPS[1]:
        least, most = _FPS
        raise RenderError(f"a film of {fps:g} frames a second, where {least:g} to {most:,.0f} can be written")
    if cluster is not None and painter.how.backend == "reference":
        raise RenderError("a cluster draws by the network, and the reference is asked for")
    suffix = Path(target.pattern).suffix.lower() if target.kind == "sequence" else ".png"
    made = RenderResult([], len(numbers))
    with Store(target.work, suffix) as store:
        run = _Run(painter, store, jobs, cluster, strict, beside, failed, progress, made)
        run.draw(numbers)
        started = time.perf_counter()
        if target.kind == "sequence":
            made.files = _numbered(store, target, numbers, run)
        else:
            animation = painter.clip.animation
            files = [store.file(key) for key in made.keys]
            film = Film(files, animation.fps, animation.loop, painter.clip.first.scene.canvas, run.alpha)
            part = store.folder / f"film{target.path.suffix}"
            encoders: dict[str, Encoder] = {
                "gif": partial(write_gif, palette=palette, dither=dither),
                "apng": write_apng,
                "webp": write_webp,
                "video": partial(write_video, suffix=target.path.suffix.lower()),
            }
            encoders[target.kind](film, part, lambda share: progress(Progress("encoding", share, 1.0)))
            deliver(part, target.path)
            made.files = [target.path]
        made.encode_s = time.perf_counter() - started
        store.remove()
    return made


@dataclass(slots=True)
class _Run:
    """Frames on their way into a store."""

    painter: Painter
    store: Store
    jobs: int | None
    cluster: str | None
    strict: bool
    beside: Beside | None
    failed: Failed | None
    progress: Callable[[Progress], None]
    made: RenderResult
    alpha: bool = False  # whether any frame has
    suffixes: tuple[str, ...] = ()  # of files beside each picture, by its number
    others: Helpers | None = None  # who draws besides this process
    spent_s: float = 0.0  # drawing here

    def draw(self, numbers: range) -> None:
        """Have every frame in the store, and the key of each in the result."""
        made, total = self.made, len(numbers)
        asked: set[str] = set()
        try:
            for index, number in enumerate(numbers):
                frame = self._prepared(number)
                made.keys.append(frame.key if frame else "")
                if frame is not None and frame.key not in asked:
                    asked.add(frame.key)
                    started = time.perf_counter()
                    if self.store.has(frame.key, frame.shot.scene.canvas):
                        made.resumed += 1
                    else:
                        self._one(frame, index, total)
                    made.draw_s += time.perf_counter() - started
                self._say(index + 1, total)
            started = time.perf_counter()
            if self.others is not None:
                made.jobs = self.others.count
                while self.others.waiting:
                    self.others.take()
                    self._say(total, total)
            made.draw_s += time.perf_counter() - started
        finally:
            if self.others is not None:
                self.others.close()

    def _prepared(self, number: int) -> Drawable | None:
        """A frame, compiled; None of one with errors that is left out."""
        painter = self.painter
        started = time.perf_counter() - painter.load_s  # loading torch is not part of a frame
        try:
            frame = painter.prepare(painter.clip.shot(number))
            if self.strict and painter.clip.diagnostics.items:
                raise SceneError(painter.clip.diagnostics)
        except SceneError as error:
            if self.failed is None:
                raise
            self.failed(number, error)
            return None
        self.made.compile_s += time.perf_counter() - painter.load_s - started
        self.alpha |= frame.shot.scene.background is None
        if self.beside is not None:
            files = self.beside(frame, self.store)
            self.suffixes = tuple(files)
            for suffix, data in files.items():
                write_whole(self.store.beside(frame.key, number, suffix), data, flush=False)
        return frame

    def _one(self, frame: Drawable, index: int, total: int) -> None:
        """Draw a frame here, or have it drawn."""
        painter, file, started = self.painter, self.store.file(frame.key), time.perf_counter()
        if self.others is None:
            self.others = self._helpers(frame, total - index)
        if self.others is not None and frame.program is not None:
            split = painter.split(frame.program)
            errand = Errand(str(file), frame.place, split, painter.outputs, painter.how)
            self.others.submit(frame.program, errand)
        else:
            share = partial(_part, self.progress, index, total)
            put_frame(painter.files(frame, file, share))
            self.spent_s += time.perf_counter() - started
        self.made.drawn += 1

    def _helpers(self, frame: Drawable, left: int) -> Helpers | None:
        """Who draws from here on: a cluster that is named, or other processes, if they pay."""
        if self.cluster is not None:
            from scenelang.animation.cluster import Cluster

            return Cluster(self.cluster)
        painter, jobs = self.painter, self.jobs
        if frame.program is None or jobs == 1 or frame.place == "cuda":
            return None
        if jobs is None:
            drawn = self.made.drawn
            if painter.how.threads is not None or usable_cores() < 2 or drawn < _TRIED:
                return None
            if self.spent_s / drawn * left <= WORTH_S:
                return None
        count = min(jobs or left, max(2, usable_cores()), left)
        if jobs is not None and jobs > count:
            self.made.asked = jobs
        if count < 2:
            self.jobs = 1
            return None
        from scenelang.animation.workers import Workers

        return Workers(count)

    def _say(self, done: int, total: int) -> None:
        waiting = self.others.waiting if self.others is not None else 0
        self.progress(Progress("drawing", done - waiting, total))


def _part(progress: Callable[[Progress], None], index: int, total: int, share: float) -> None:
    progress(Progress("drawing", index + share, total))


def _numbered(store: Store, target: Target, numbers: range, run: _Run) -> list[Path]:
    """Move the files of frames to where they belong; of equal ones all but the last are copies."""
    target.path.mkdir(parents=True, exist_ok=True)
    keys = run.made.keys
    last = {key: index for index, key in enumerate(keys)}
    files: list[Path] = []
    for index, (number, key) in enumerate(zip(numbers, keys, strict=True)):
        if not key:
            continue
        file, kept = target.file(number), store.file(key)
        pairs = {output_file(file, name): output_file(kept, name) for name in run.painter.outputs}
        pairs[file] = kept
        for name, frame in pairs.items():
            if last[key] == index:
                os.replace(frame, name)
            else:
                write_whole(name, frame.read_bytes(), flush=False)
        for suffix in run.suffixes:
            pairs[file.with_suffix(suffix)] = file
            os.replace(store.beside(key, number, suffix), file.with_suffix(suffix))
        files += sorted(pairs)
    if hasattr(os, "sync"):
        os.sync()  # all at once: one by one waits as often as there are files
    return files


def ready(target: Target) -> None:
    """Raise `RenderError` where a format cannot be written, `NotWritten` where an input would be lost."""
    output_place(target.path)
    if target.kind == "video":
        find_codec(target.path.suffix.lower())
    elif target.kind == "webp":
        from PIL import features

        if not features.check("webp"):
            raise RenderError("this Pillow is built without WebP")
