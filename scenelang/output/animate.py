"""Animations to files: draw what is missing, encode, put in place."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, Unpack

from PIL import features

from scenelang.assets.files import output_place, write_whole
from scenelang.assets.records import Record
from scenelang.drawing.how import How, Options, RenderError, usable_cores
from scenelang.drawing.image import Image, output_file
from scenelang.language.diagnostics import plural
from scenelang.language.evaluation import Source
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene
from scenelang.output.encoders import Palette, find_codec, write_apng, write_gif, write_video, write_webp
from scenelang.output.frames import (
    Clip,
    Drawable,
    Film,
    FrameRange,
    FrameStore,
    Target,
    find_target,
    put_frame,
)
from scenelang.output.painting import Cluster, Errand, Painter, Workers

WORTH_S: Final = 12.0  # least drawing left that repays starting other processes, each of which loads torch
_FPS: Final = 1e-4, 1e6  # rates of films: beyond, formats cannot store the time of a frame
_TRIED: Final = 3  # frames drawn here before that is decided


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of an animation."""

    stage: str  # "drawing" or "encoding"
    done: float  # of this stage, in frames for drawing and as a share for encoding
    total: float  # final value of ``done``

    @property
    def told(self) -> str:
        """The stage in words, with the frame if it counts any."""
        return f"drawing {self.done:.0f}/{self.total:.0f}" if self.stage == "drawing" else self.stage


@dataclass(slots=True)
class RenderResult:
    """An animation that was written."""

    files: list[Path]
    frames: int
    drawn: int = 0  # pictures that were drawn now; equal frames are drawn once
    resumed: int = 0  # pictures of a previous run, which was interrupted
    compile_s: float = 0.0  # time to evaluate and compile all frames
    draw_s: float = 0.0  # time to draw, encode pictures and wait for other processes
    encode_s: float = 0.0  # time to encode the film
    jobs: int = 1  # processes that drew
    asked: int | None = None  # requested processes, where that is more than there are frames or cores
    keys: list[str] = field(default_factory=list)  # digest of each frame's inputs; empty where left out

    def lines(self) -> list[str]:
        each = 1000 / max(1, self.frames)
        asked = f" ({self.asked} asked for; more than frames or cores do not help)" if self.asked else ""
        return [
            f"{plural(self.drawn, 'picture')} drawn by {self.jobs} process{'es' * (self.jobs > 1)}{asked}, "
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
    cluster: str | None = None,
    palette: Palette = "auto",
    dither: bool = False,
    strict: bool = False,
    progress: Callable[[Progress], None] = lambda _: None,
) -> RenderResult:
    """Draw frames and write them whole, with arguments and errors as of `animate`.

    Drawn frames stay in `Target.work` until the same call continues. ``strict`` counts warnings as errors.
    """
    place = output_place(target.path)
    if target.kind == "video":
        find_codec(target.path.suffix.lower())
    elif target.kind == "webp" and not features.check("webp"):
        raise RenderError("this Pillow is built without WebP")
    if target.kind != "sequence" and not _FPS[0] <= (fps := painter.clip.animation.fps) <= _FPS[1]:
        least, most = _FPS
        raise RenderError(f"a film of {fps:g} frames a second, where {least:g} to {most:,.0f} can be written")
    if cluster is not None and painter.how.backend == "reference":
        raise RenderError("a cluster draws by the network, and the reference is asked for")
    suffix = Path(target.pattern).suffix.lower() if target.kind == "sequence" else ".png"
    result = RenderResult([], len(numbers))
    with FrameStore(target.work, suffix) as store:
        run = _Run(painter, store, jobs, cluster, strict, progress, result)
        run.draw(numbers)
        started = time.perf_counter()
        if target.kind == "sequence":
            result.files = _numbered(store, target, numbers, run)
        else:
            animation = painter.clip.animation
            files = [store.file(key) for key in result.keys]
            film = Film(files, animation.fps, animation.loop, painter.clip.first.scene.canvas, run.alpha)
            part = store.folder / f"film{target.path.suffix}"
            encoders: dict[str, Callable[..., None]] = {
                "gif": partial(write_gif, palette=palette, dither=dither),
                "apng": write_apng,
                "webp": write_webp,
                "video": partial(write_video, suffix=target.path.suffix.lower()),
            }
            encoders[target.kind](film, part, lambda share: progress(Progress("encoding", share, 1.0)))
            with part.open("rb") as written:
                os.fsync(written.fileno())
            os.replace(part, place)
            result.files = [target.path]
        result.encode_s = time.perf_counter() - started
        store.remove()
    return result


class _Run(Record, frozen=False):
    """Frames on their way into a store."""

    painter: Painter
    store: FrameStore
    jobs: int | None
    cluster: str | None
    strict: bool
    progress: Callable[[Progress], None]
    result: RenderResult
    alpha: bool = False  # whether any frame has
    suffixes: tuple[str, ...] = ()  # of the files next to each picture
    others: Workers | Cluster | None = None  # the processes that draw besides this one
    spent_s: float = 0.0  # time spent drawing here

    def draw(self, numbers: range) -> None:
        """Draw all missing frames into the store, and note the key of each in the result."""
        result, total = self.result, len(numbers)
        asked: set[str] = set()
        try:
            for index, number in enumerate(numbers):
                frame = self._prepared(number)
                result.keys.append(frame.key if frame else "")
                if frame is not None and frame.key not in asked:
                    asked.add(frame.key)
                    started = time.perf_counter()
                    if self.store.has(frame.key, frame.shot.scene.canvas):
                        result.resumed += 1
                    else:
                        self._one(frame, index, total)
                    result.draw_s += time.perf_counter() - started
                self._say(index + 1, total)
            started = time.perf_counter()
            if self.others is not None:
                result.jobs = self.others.count
                while self.others.waiting:
                    self.others.take()
                    self._say(total, total)
            result.draw_s += time.perf_counter() - started
        finally:
            if self.others is not None:
                self.others.close()

    def _prepared(self, number: int) -> Drawable | None:
        """Compile a frame; None for one with errors that is left out."""
        painter = self.painter
        started = time.perf_counter() - painter.load_s  # loading torch is not part of a frame
        try:
            frame = painter.prepare(painter.clip.shot(number))
            if self.strict and painter.clip.diagnostics.items:
                raise SceneError(painter.clip.diagnostics)
        except SceneError as error:
            painter.clip.failed(number, error)
            return None
        self.result.compile_s += time.perf_counter() - painter.load_s - started
        self.alpha |= frame.shot.scene.background is None
        files = painter.clip.beside(frame, self.store)
        self.suffixes = tuple(files)
        for suffix, data in files.items():
            write_whole(self.store.beside(frame.key, number, suffix), data, flush=False)
        return frame

    def _one(self, frame: Drawable, index: int, total: int) -> None:
        """Draw a frame here, or submit it to other processes."""
        painter, file, started = self.painter, self.store.file(frame.key), time.perf_counter()
        if self.others is None:
            self.others = self._helpers(frame, total - index)
        if self.others is not None and frame.program is not None:
            split = painter.split(frame.program)
            errand = Errand(str(file), frame.place, split, painter.outputs, painter.how)
            self.others.submit(frame.program, errand)
        else:
            put_frame(painter.files(frame, file, lambda share: self._say(index + share, total)))
            self.spent_s += time.perf_counter() - started
        self.result.drawn += 1

    def _helpers(self, frame: Drawable, left: int) -> Workers | Cluster | None:
        """The processes that draw from here on: a given cluster, or other processes where they pay."""
        if self.cluster is not None:
            return Cluster(self.cluster)
        painter, jobs = self.painter, self.jobs
        if frame.program is None or jobs == 1 or frame.place == "cuda":
            return None
        if jobs is None:
            drawn = self.result.drawn
            if painter.how.threads is not None or usable_cores() < 2 or drawn < _TRIED:
                return None
            if self.spent_s / drawn * left <= WORTH_S:
                return None
        count = min(jobs or left, max(2, usable_cores()), left)
        if jobs is not None and jobs > count:
            self.result.asked = jobs
        if count < 2:
            self.jobs = 1
            return None
        return Workers(count)

    def _say(self, done: float, total: int) -> None:
        waiting = self.others.waiting if self.others is not None else 0
        self.progress(Progress("drawing", done - waiting, total))


def _numbered(store: FrameStore, target: Target, numbers: range, run: _Run) -> list[Path]:
    """Move the files of frames to their places; of equal frames all but the last are copies."""
    target.path.mkdir(parents=True, exist_ok=True)
    keys = run.result.keys
    last = {key: index for index, key in enumerate(keys)}
    files: list[Path] = []
    for index, (number, key) in enumerate(zip(numbers, keys, strict=True)):
        if not key:
            continue
        file, stored = target.file(number), store.file(key)
        pairs = {output_file(file, name): output_file(stored, name) for name in run.painter.outputs}
        pairs[file] = stored
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


Frames = range | str | None
Drawn = str | os.PathLike[str] | Scene | Iterable[Scene]


def render_frames(
    path: Drawn,
    *,
    frames: Frames = None,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    **how: Unpack[Options],
) -> Iterator[Image]:
    """Draw the frames of a scene file, or Scenes, one after another; no picture is held.

    A file is read once, when the first picture is asked for; a frame compiles what it does not share with
    the one before. Torch draws them, numpy those of solids: each picture is the one that `scenelang.render`
    gives for its frame on the same device, bit for bit. A scene without ``animate(…)`` has one frame.

    Args:
        path: the scene file, or a Scene or several, each with its own canvas.
        frames: which, as a range or as text (``"0..23"``, ``"12.."``); all by default.
        fps: frames a second instead of those of ``animate``; its length stays. The default of Scenes is that
            of the first one's animation.
        size: canvas in pixels instead of the scene's.
        params: values for a file's params, as for `scenelang.load`.
        model: draw with this model instead of the one that the file names.
        root: folder that imports cannot leave; by default the file's.
        **how: as for `scenelang.render`.

    Yields:
        Pictures, float32 (H, W, 3) or, where the background is none, (H, W, 4).

    Raises:
        SceneError: the scene has errors, in any frame.
        FramesError: the animation has no such frames.
        RenderError: as for `scenelang.render`.
        OSError: the file cannot be opened.
        ValueError: an argument is none of the above, or says something of a file where Scenes are given.
    """
    clip = _opened(path, Source(params=params, model=model, root=root, size=size, fps=fps))
    painter = Painter(clip, How(**how).checked())
    last: tuple[str, Image] | None = None
    for number in _numbers(clip, frames):
        frame = painter.prepare(clip.shot(number))
        if last is None or last[0] != frame.key:
            last = frame.key, painter.draw(frame)
        yield last[1].copy()


def animate(
    path: Drawn,
    out: str | os.PathLike[str],
    *,
    frames: Frames = None,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    cluster: str | None = None,
    palette: Palette = "auto",
    dither: bool = False,
    progress: Callable[[Progress], None] = lambda _: None,
    **how: Unpack[Options],
) -> RenderResult:
    """Draw a scene file or Scenes to an animation; repeat an interrupted call to continue it.

    Args:
        path: the scene file, or Scenes, one a frame.
        out: a file whose suffix names the format (.gif, .webp, .apng, .mp4, .mov, .mkv, .webm), numbered
            pictures (``frame-%04d.png``), or a folder that ends in a slash or is there.
        frames, fps, size, params, model, root: as for `render_frames`.
        jobs: processes that draw; by default this one, and others where they pay.
        cluster: address of a dask scheduler whose workers draw, or ``"local"``; needs the extra ``dask``.
        palette: of a GIF: ``"global"``, ``"frame"``, or ``"auto"``, the exact one where there is one.
        dither: dither colours that a GIF's palette lacks.
        progress: called with the progress, from any thread.
        **how: as for `scenelang.render`.

    Returns:
        The files and figures of the run.

    Raises:
        ValueError: ``out`` names no format, or nothing says how fast Scenes follow each other.
        SceneError, FramesError, RenderError, OSError: as for `render_frames`; nothing is written then.
    """
    stem = Path(path).stem if isinstance(path, str | os.PathLike) else "frame"
    target = find_target(os.fspath(out), stem)
    clip = _opened(path, Source(params=params, model=model, root=root, size=size, fps=fps))
    if target.kind != "sequence":
        _ = clip.animation  # raises before anything is drawn
    painter, numbers = Painter(clip, How(**how).checked()), _numbers(clip, frames)
    gif: dict[str, Any] = {"palette": palette, "dither": dither}
    return make(painter, target, numbers, jobs=jobs, cluster=cluster, **gif, progress=progress)


def _opened(path: Drawn, source: Source) -> Clip:
    """The frames of a file, or of Scenes, which take what ``source`` says of these."""
    fps, size = source.fps, source.size
    if fps is not None and not 0 < fps < float("inf"):
        raise ValueError(f"{fps} frames a second, where a number above 0 is needed")
    if isinstance(path, str | os.PathLike):
        return Clip(replace(source, path=path))
    scenes = (path,) if isinstance(path, Scene) else tuple(path) if isinstance(path, Iterable) else ()
    if not scenes or not all(isinstance(scene, Scene) for scene in scenes):
        raise ValueError("neither a path nor Scenes to draw")
    if source.params is not None or source.root is not None:
        raise ValueError("params and root are for files; Scenes have their values")
    scenes = scenes if size is None else tuple(scene.sized(size) for scene in scenes)
    return Clip(tuple(scene.of_model(source.model) for scene in scenes), fps=fps)


def _numbers(clip: Clip, frames: Frames) -> range:
    count = clip.frames
    if isinstance(frames, range):
        for end in (frames[0], frames[-1]) if len(frames) else ():
            FrameRange(end, end).among(count)
        return frames
    return (FrameRange() if frames is None else FrameRange.parse(frames)).among(count)
