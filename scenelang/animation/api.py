"""Animations for callers in Python: `scenelang.render_frames` and `scenelang.animate`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from scenelang.animation.clip import Clip
from scenelang.animation.painting import Painter
from scenelang.animation.run import Progress, RenderResult, make
from scenelang.animation.targets import find_target
from scenelang.animation.timing import FrameRange
from scenelang.backend.options import How, Options
from scenelang.evaluate.evaluation import Source
from scenelang.scene.schema import Scene

if TYPE_CHECKING:
    from scenelang.animation.gif import Palette
    from scenelang.image import Image

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
        fps: frames a second instead of those that ``animate`` names; its seconds stay. Scenes are shown at
            those of the first one's animation.
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
    clip = _opened(path, fps, size, params, model, root)
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
    """Draw a scene file or Scenes to an animation; a call that was interrupted goes on where it stopped.

    Args:
        path: the scene file, or Scenes, one a frame.
        out: a file whose suffix names the format (.gif, .webp, .apng, .mp4, .mov, .mkv, .webm), numbered
            pictures (``frame-%04d.png``), or a folder that ends in a slash or is there.
        frames, fps, size, params, model, root: as for `render_frames`.
        jobs: processes that draw; by default this one, and others where they pay.
        cluster: address of a dask scheduler whose workers draw, or ``"local"``; needs the extra ``dask``.
        palette: of a GIF: ``"global"``, ``"frame"``, or the one that is exact if one is (``"auto"``).
        dither: dither what a GIF's palette lacks.
        progress: called with how far it is, from any thread.
        **how: as for `scenelang.render`.

    Returns:
        What was written.

    Raises:
        ValueError: ``out`` names no format, or nothing says how fast Scenes follow each other.
        SceneError, FramesError, RenderError, OSError: as for `render_frames`; nothing is written then.
    """
    stem = Path(path).stem if isinstance(path, str | os.PathLike) else "frame"
    target = find_target(os.fspath(out), stem)
    clip = _opened(path, fps, size, params, model, root)
    if target.kind != "sequence":
        _ = clip.animation  # what is wrong with it is said before anything is drawn
    painter = Painter(clip, How(**how).checked())
    return make(
        painter,
        target,
        _numbers(clip, frames),
        jobs=jobs,
        cluster=cluster,
        palette=palette,
        dither=dither,
        progress=progress,
    )


def _opened(
    path: Drawn,
    fps: float | None,
    size: tuple[int, int] | None,
    params: Mapping[str, Any] | None,
    model: str | None,
    root: str | os.PathLike[str] | None,
) -> Clip:
    if fps is not None and not 0 < fps < float("inf"):
        raise ValueError(f"{fps} frames a second, where a number above 0 is needed")
    if isinstance(path, str | os.PathLike):
        return Clip(Source(path, params=params, model=model, root=root, size=size, fps=fps))
    scenes = (path,) if isinstance(path, Scene) else tuple(path) if isinstance(path, Iterable) else ()
    if not scenes or not all(isinstance(scene, Scene) for scene in scenes):
        raise ValueError("neither a path nor Scenes to draw")
    if params is not None or root is not None:
        raise ValueError("params and root are for files; Scenes have their values")
    scenes = scenes if size is None else tuple(scene.sized(size) for scene in scenes)
    return Clip(tuple(scene.of_model(model) for scene in scenes), fps=fps)


def _numbers(clip: Clip, frames: Frames) -> range:
    count = clip.frames
    if isinstance(frames, range):
        for end in (frames[0], frames[-1]) if len(frames) else ():
            FrameRange(end, end).among(count)
        return frames
    return (FrameRange() if frames is None else FrameRange.parse(frames)).among(count)
