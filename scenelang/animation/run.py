"""From a clip to files: draw what is missing, encode, put in place."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from scenelang.animation.apng import write_apng
from scenelang.animation.gif import write_gif
from scenelang.animation.painting import Drawable, Painter
from scenelang.animation.store import Encoder, Film, Store, deliver, put_frame
from scenelang.animation.targets import Target
from scenelang.animation.video import find_codec, write_video
from scenelang.animation.webp import write_webp
from scenelang.backend.options import RenderError, usable_cores
from scenelang.diagnostics.error import SceneError
from scenelang.files import output_place, write_whole
from scenelang.image import save_outputs

if TYPE_CHECKING:
    from scenelang.animation.gif import Palette
    from scenelang.animation.workers import Workers
    from scenelang.outputs import Output

WORTH_S: Final = 12.0  # drawing left that repays starting other processes, each of which loads torch
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
    """

    files: list[Path]
    frames: int
    drawn: int = 0
    resumed: int = 0
    compile_s: float = 0.0
    draw_s: float = 0.0
    encode_s: float = 0.0
    jobs: int = 1

    def lines(self) -> list[str]:
        """What there is to say about it."""
        each = 1000 / max(1, self.frames)
        return [
            f"{self.drawn} pictures drawn by {self.jobs} process{'es' * (self.jobs > 1)}, "
            f"{self.resumed} kept from a run before",
            f"a frame (ms): compile {self.compile_s * each:.1f}, draw {self.draw_s * each:.1f}, "
            f"encode {self.encode_s * each:.1f}",
        ]


def make(
    painter: Painter,
    target: Target,
    numbers: range,
    *,
    jobs: int | None = None,
    palette: Palette = "auto",
    dither: bool = False,
    strict: bool = False,
    outputs: Sequence[Output] = (),
    progress: Callable[[Progress], None] = lambda _: None,
) -> RenderResult:
    """Draw frames and write them whole: nothing is put in place before all of it is there.

    Frames are kept in `Target.work` on the way. If the run ends before its time, they stay there, and the
    same call goes on with those that are missing.

    Args:
        jobs: processes that draw; by default this one, and others as soon as they would pay.
        palette, dither: of a GIF, see `write_gif`.
        strict: count warnings as errors.
        outputs: beside each of numbered pictures; such frames are drawn one by one and not kept.
        progress: called from any thread.

    Raises:
        SceneError: a frame has errors.
        RenderError: a frame cannot be drawn, or the format cannot be written.
        OSError: a file cannot be written.
    """
    ready(target)
    if outputs:
        return _with_outputs(painter, target, numbers, outputs, strict, progress)
    suffix = Path(target.pattern).suffix.lower() if target.kind == "sequence" else ".png"
    made = RenderResult([], len(numbers))
    with Store(target.work, suffix) as store:
        keys, alpha = _drawn(painter, store, numbers, jobs, strict, progress, made)
        started = time.perf_counter()
        if target.kind == "sequence":
            made.files = _numbered(store, target, numbers, keys)
        else:
            animation = painter.clip.animation
            files = [store.file(key) for key in keys]
            film = Film(files, animation.fps, animation.loop, painter.clip.first.scene.canvas, alpha)
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


def _with_outputs(
    painter: Painter,
    target: Target,
    numbers: range,
    outputs: Sequence[Output],
    strict: bool,
    progress: Callable[[Progress], None],
) -> RenderResult:
    target.path.mkdir(parents=True, exist_ok=True)
    made, started = RenderResult([], len(numbers), drawn=len(numbers)), time.perf_counter()
    for index, number in enumerate(numbers):
        frame, file = painter.prepare(painter.clip.shot(number)), target.file(number)
        if strict and painter.clip.diagnostics.items:
            raise SceneError(painter.clip.diagnostics)
        found = painter.outputs(frame, outputs)
        image = painter.draw(frame, partial(_part, progress, index, len(numbers)))
        made.files += sorted({file, *save_outputs(image, found, file, write_whole)})
    made.draw_s = time.perf_counter() - started
    return made


def _drawn(
    painter: Painter,
    store: Store,
    numbers: range,
    jobs: int | None,
    strict: bool,
    progress: Callable[[Progress], None],
    made: RenderResult,
) -> tuple[list[str], bool]:
    """Have every frame in the store; the key of each, and whether any has alpha."""
    keys: list[str] = []
    asked: set[str] = set()
    alpha = False
    workers: Workers | None = None
    spent_s = 0.0
    try:
        for index, number in enumerate(numbers):
            started = time.perf_counter() - painter.load_s  # loading torch is not part of a frame
            frame = painter.prepare(painter.clip.shot(number))
            if strict and painter.clip.diagnostics.items:
                raise SceneError(painter.clip.diagnostics)
            made.compile_s += time.perf_counter() - painter.load_s - started
            keys.append(frame.key)
            alpha |= frame.shot.scene.background is None
            started = time.perf_counter()
            if frame.key not in asked:
                asked.add(frame.key)
                if store.has(frame.key, frame.shot.scene.canvas):
                    made.resumed += 1
                else:
                    if workers is None:
                        workers = _helpers(painter, frame, jobs, made.drawn, spent_s, len(numbers) - index)
                    if workers is not None and frame.program is not None:
                        workers.submit(frame.program, store.file(frame.key), None if frame.small else "cpu")
                    else:
                        say = partial(_part, progress, index, len(numbers))
                        put_frame(store.file(frame.key), painter.draw(frame, say))
                        spent_s += time.perf_counter() - started
                    made.drawn += 1
            made.draw_s += time.perf_counter() - started
            progress(Progress("drawing", index + 1 - (workers.waiting if workers else 0), len(numbers)))
        if workers is not None:
            made.jobs = workers.count
            started = time.perf_counter()
            while workers.waiting:
                workers.take()
                progress(Progress("drawing", len(numbers) - workers.waiting, len(numbers)))
            made.draw_s += time.perf_counter() - started
    finally:
        if workers is not None:
            workers.close()
    return keys, alpha


def _part(progress: Callable[[Progress], None], index: int, total: int, share: float) -> None:
    progress(Progress("drawing", index + share, total))


def _helpers(
    painter: Painter, frame: Drawable, jobs: int | None, drawn: int, spent_s: float, left: int
) -> Workers | None:
    """Other processes to draw in from here on, if they pay."""
    if frame.program is None or jobs == 1 or not (frame.small or painter.place == "cpu"):
        return None
    from scenelang.animation.workers import Workers

    if jobs is None:
        if painter.threads is not None or usable_cores() < 2 or drawn < _TRIED:
            return None
        if spent_s / drawn * left <= WORTH_S:
            return None
    return Workers(jobs or usable_cores(), painter.split(frame.program))


def _numbered(store: Store, target: Target, numbers: range, keys: Sequence[str]) -> list[Path]:
    """Move frames to where they belong; of equal ones all but the last are copies."""
    target.path.mkdir(parents=True, exist_ok=True)
    last = {key: index for index, key in enumerate(keys)}
    files = []
    for index, (number, key) in enumerate(zip(numbers, keys, strict=True)):
        file = target.file(number)
        if last[key] == index:
            os.replace(store.file(key), file)
        else:
            write_whole(file, store.file(key).read_bytes())
        files.append(file)
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
