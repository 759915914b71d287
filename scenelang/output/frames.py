"""Frames of animations: their numbers and times, their Programs, and their files on disk.

A frame's file is named by a digest of all that determines its pixels: the compiled Program, the weights, the
renderer and its split of the picture. So a frame of another text, import, param, size or model is never taken
for one of this run, and equal frames share a file.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Final, Literal, TypeVar

import numpy as np
import numpy.typing as npt
from PIL import Image as pillow

from scenelang.assets.files import lock, open_own, write_whole
from scenelang.assets.records import Record
from scenelang.compiler.lower import Memory
from scenelang.compiler.program import Program
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import image_format
from scenelang.language.diagnostics import Diagnostics, plural
from scenelang.language.evaluation import Evaluation, Source
from scenelang.language.library import SpanMap
from scenelang.language.reports import SceneError
from scenelang.language.scene import Animation, Scene, same_nodes

K = TypeVar("K")

_RANGE: Final = re.compile(r"\s*(\d{1,9})\s*(?:\.\.\s*(<?)\s*(\d{1,9})?\s*)?")


class FramesError(ValueError):
    """Not a range of frames, or one that an animation does not have."""


class FrameRange(Record):
    first: int = 0  # from 0
    last: int | None = None  # the last one; None for that of the animation

    @classmethod
    def parse(cls, text: str) -> FrameRange:
        """``a..b`` inclusive, ``a..<b`` without b, ``a..`` to the end, or ``a``; else `FramesError`."""
        if (match := _RANGE.fullmatch(text)) is None or (match[2] and match[3] is None):
            raise FramesError(f"`{text}` is not a range of frames such as 0..23, 0..<24, 12.. or 7")
        first, last = int(match[1]), int(match[3]) - bool(match[2]) if match[3] else None
        if ".." not in text:
            return cls(first, first)
        if last is not None and last < first:
            raise FramesError(f"the range of frames `{text}` is empty")
        return cls(first, last)

    def among(self, frames: int) -> range:
        """The numbers in an animation of ``frames`` frames; raises `FramesError` if some are outside it."""
        last = frames - 1 if self.last is None else self.last
        for end in (self.first, last):
            if end >= frames:
                raise FramesError(f"frame {end} is outside 0..{frames - 1}")
        return range(self.first, last + 1)


def delays(count: int, fps: float, per_second: int, shortest: int = 1) -> list[int]:
    """Ticks that each frame is shown for; 0 where it is left out, as it would be shorter than ``shortest``.

    When a frame starts is rounded by itself, so that errors do not add up and the whole is as long as it
    should be, but no shorter than ``shortest``.
    """
    step = Fraction(per_second) / Fraction(fps)
    at = [math.floor(i * step + Fraction(1, 2)) for i in range(count + 1)]
    shown = [0]
    for index in range(1, count):
        if at[index] - at[shown[-1]] >= shortest:
            shown.append(index)
    result = [0] * count
    for index, following in zip(shown, [*shown[1:], count], strict=True):
        result[index] = at[following] - at[index]
    while len(shown) > 1 and result[shown[-1]] < shortest:
        late = shown.pop()
        result[shown[-1]] += result[late]
        result[late] = 0
    result[shown[0]] = max(result[shown[0]], shortest)
    return result


def runs(keys: Sequence[K], lengths: Iterable[int]) -> list[tuple[K, int]]:
    """Neighbours with the same key as one, as long as all of them; those of length 0 are left out."""
    result: list[tuple[K, int]] = []
    for key, length in zip(keys, lengths, strict=True):
        if length == 0:
            continue
        if result and result[-1][0] == key:
            result[-1] = key, result[-1][1] + length
        else:
            result.append((key, length))
    return result


Kind = Literal["sequence", "gif", "webp", "apng", "video"]

VIDEOS: Final = {".mp4": "mp4", ".m4v": "mp4", ".mov": "mov", ".mkv": "matroska", ".webm": "webm"}
"""Suffixes of videos, and the formats that ffmpeg calls them."""
_VIDEO: Final[dict[str, Kind]] = dict.fromkeys(VIDEOS, "video")
FILM_FORMATS: Final[dict[str, Kind]] = {".gif": "gif", ".webp": "webp", ".apng": "apng", **_VIDEO}
PICTURES: Final = frozenset({".gif", ".webp", ".apng"})  # hold a single picture as well
_NUMBER: Final = re.compile(r"%(0?\d{0,2})d")


class TargetError(ValueError):
    """A name that says nothing about the format, or cannot be written."""


class Target(Record):
    """Files of an animation."""

    kind: Kind  # format
    path: Path  # the file; for a sequence the folder of its files
    pattern: str = ""  # name of each file of a sequence, with `%04d` for its number

    def file(self, frame: int) -> Path:
        parts = self.pattern.split("%%")
        filled = [_NUMBER.sub(lambda match: f"{frame:{match[1] or 'd'}}", part) for part in parts]
        return self.path / "%".join(filled)

    def there(self) -> list[Path]:
        number = 1_234_567_890
        head, tail = self.file(number).name.split(str(number))
        named = re.compile(rf"{re.escape(head)}\d+{re.escape(tail)}")
        return [path for path in self.path.iterdir() if named.fullmatch(path.name)]

    @property
    def work(self) -> Path:
        """The folder next to it where frames are cached while it is drawn."""
        if self.kind == "sequence":
            return self.path / f".{self.pattern}.frames"
        return self.path.parent / f".{self.path.name}.frames"


def is_pattern(out: str) -> bool:
    """Return whether a name has a place for a number: ``frame-%04d.png``."""
    return "%" in Path(out).name and _NUMBER.search(Path(out).name.replace("%%", "")) is not None


def is_animation(out: str) -> bool:
    """Return whether a name asks for an animation if the scene is one."""
    return is_pattern(out) or Path(out).suffix.lower() in FILM_FORMATS


def find_target(out: str, stem: str = "frame", digits: int = 4, *, film: bool = True) -> Target:
    """The target ``out``: a ``film`` if it may be, a pattern or a folder of ``stem``s; else `TargetError`."""
    path, folder = Path(out), out.endswith(("/", "\\"))
    if not film and not is_pattern(out) and not folder:
        if path.is_file() or (path.suffix and not path.is_dir()):
            fact = f"`{out}` is one file; many pictures go to a folder, or to files such as %05d.png"
            raise TargetError(fact)
        folder = True
    if is_pattern(out):
        bare = path.name.replace("%%", "")
        if len(_NUMBER.findall(bare)) != 1 or "%" in _NUMBER.sub("", bare):
            fact = "has more than one place for a number, or a stray `%` (write %%)"
            raise TargetError(f"`{path.name}` {fact}")
        try:
            image_format(path)
        except ValueError as error:
            raise TargetError(str(error)) from None
        target = Target("sequence", path.parent, path.name)
    elif folder or path.is_dir():
        if path.exists() and not path.is_dir():
            raise TargetError(f"`{out}` is a file")
        return Target("sequence", path, f"{stem.replace('%', '%%')}-%0{digits}d.png")
    elif (kind := FILM_FORMATS.get(path.suffix.lower())) is not None:
        target = Target(kind, path)
    else:
        raise TargetError(
            f"`{out}` holds one picture; an animation goes to a file with one of the suffixes "
            f"{', '.join(FILM_FORMATS)}, to "
            "numbered pictures such as frame-%04d.png, or to a folder, which ends in a slash"
        )
    if not path.parent.is_dir():
        raise TargetError(f"cannot write `{out}`: there is no folder `{path.parent}`")
    return target


_LOCK: Final = "lock"
_FRAME: Final = re.compile(r"[0-9a-f]{40}(\.\w+){1,3}")
_PASSING: Final = re.compile(r"film\.\w+|\.[0-9a-f]{40}(\.\w+){1,3}\.[0-9a-z]+\.part")
"""Names of files that a killed run left half-written."""
Pixels = npt.NDArray[np.uint8]
Box = tuple[int, int, int, int]  # left, top, right, bottom; the last two exclusive


def frame_key(*parts: object) -> str:
    """Digest, hex, of everything that determines a frame's pixels."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:40]


class FrameStore:
    """A folder of cached frames, locked while it is open; raises `RenderError` where another process has it.

    The folder may be a stranger's: no link in it is followed, and only files named like our own are removed.
    """

    def __init__(self, folder: Path, suffix: str = ".png") -> None:
        self.folder, self.suffix = folder, suffix
        self._made = [p for p in (folder, *folder.parents) if not p.exists()]
        for place in (folder, folder / _LOCK):
            if place.is_symlink():
                raise RenderError(f"cannot keep frames in `{folder}`: `{place.name}` is a link")
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = os.fdopen(open_own(folder / _LOCK), "rb")
        if lock(self._lock.fileno(), folder / _LOCK) is False:
            self._lock.close()
            raise RenderError(f"another process is drawing into `{folder}`")
        for part in self._named(_PASSING):
            part.unlink()

    def __enter__(self) -> FrameStore:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None and not self._named(_FRAME):
            self.remove()  # nothing worth keeping
        self._lock.close()

    def file(self, key: str) -> Path:
        return self.folder / f"{key}{self.suffix}"

    def beside(self, key: str, number: int, suffix: str) -> Path:
        """Path of a further file of the frame of a key and a number."""
        return self.folder / f"{key}.{number}{suffix}"

    def adopt(self, frame: Path, file: Path) -> None:
        """Link or copy a file from elsewhere as one of a frame."""
        if not frame.exists() and not file.is_symlink():
            try:
                os.link(file, frame)
            except OSError:  # the file system has no such links
                write_whole(frame, file.read_bytes())

    def has(self, key: str, size: tuple[int, int]) -> bool:
        """Return whether a whole frame of a size (width, height) is stored."""
        file = self.file(key)
        if file.is_symlink() or not file.is_file():
            return False
        # Pillow has no base class for what its readers raise
        with contextlib.suppress(Exception), pillow.open(file, formats=[image_format(file)]) as image:
            if image.size == size:
                image.load()
                return True
        return False

    def remove(self) -> None:
        """Delete our files, and folders that we created and that are empty then."""
        for file in (*self._named(_FRAME), *self._named(_PASSING), self.folder / _LOCK):
            with contextlib.suppress(OSError):
                file.unlink()
        self._lock.close()
        for folder in (self.folder, *self._made[1:]):
            with contextlib.suppress(OSError):
                folder.rmdir()

    def _named(self, pattern: re.Pattern[str]) -> list[Path]:
        with contextlib.suppress(FileNotFoundError):
            return [self.folder / name for name in os.listdir(self.folder) if pattern.fullmatch(name)]
        return []


def put_frame(files: Mapping[Path, bytes]) -> None:
    """Write the files of a frame, the first one last, so that it implies the others; links are replaced.

    They are not flushed: a frame that a power cut damaged is drawn again.
    """
    for file, data in reversed(list(files.items())):
        write_whole(file, data, flush=False)


class Film(Record):
    """Finished frames in the order in which they are shown; read from the disk one at a time."""

    files: Sequence[Path]  # one for each frame; equal frames have the same
    fps: float  # frames a second
    loop: bool  # whether it starts again at its end
    size: tuple[int, int]  # width and height in pixels
    alpha: bool  # whether the pictures are transparent

    def read(self, file: Path) -> Pixels:
        """The pixels (H, W, 3 or 4) of a frame; raises `OSError` where its file is damaged."""
        with pillow.open(file) as image:
            pixels = np.asarray(image.convert("RGBA" if self.alpha else "RGB"))
        if pixels.shape[:2] != (self.size[1], self.size[0]):
            raise OSError(f"{file} has another size")
        return pixels


def changed(before: Pixels | None, now: Pixels) -> Box:
    """The smallest box around all pixels that differ; one pixel where none does."""
    height, width = now.shape[:2]
    if before is None:
        return 0, 0, width, height
    differs = (before != now).any(axis=2)
    rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if not len(rows):
        return 0, 0, 1, 1
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


STILL = Animation(seconds=1.0, fps=1.0)
"""Animation of a scene without ``animate``: one frame."""


class Shot(Record):
    number: int  # from 0
    scene: Scene  # evaluated
    spans: SpanMap  # where its nodes were written


class Drawable(Record):
    number: int  # from 0
    key: str  # digest of all that determines its pixels
    shot: Shot  # the frame
    program: Program | None  # what the network draws; None for the reference
    place: str = "cpu"  # the renderer: numpy, or a torch device


class Clip:
    """A scene evaluated and compiled by frames, or Scenes as frames; a mistake in any frame ends it."""

    def __init__(
        self,
        source: Source | Evaluation | tuple[Scene, ...],
        diagnostics: Diagnostics | None = None,
        *,
        fps: float | None = None,
    ) -> None:
        self.diagnostics = diagnostics if diagnostics is not None else Diagnostics()
        if isinstance(source, Source):
            source = source.evaluation(self.diagnostics, replays=True)
        self._scenes = source if isinstance(source, tuple) else ()
        self._evaluation = None if isinstance(source, tuple) else source
        self._fps = fps  # of Scenes; None for those of the first one's animation
        self._last: tuple[Shot, Program] | None = None
        self._memory: Memory | None = Memory()
        # all files that it imports, also those that do not exist
        self.wanted = self._evaluation.wanted if self._evaluation is not None else ()

    @cached_property
    def first(self) -> Shot:
        """The first frame, which every scene has; raises `SceneError` if it has errors."""
        return self.shot(0)

    @property
    def animates(self) -> bool:
        return len(self._scenes) > 1 if self._evaluation is None else self._evaluation.animates

    @property
    def texts(self) -> tuple[str, ...]:
        return tuple(one.text for one in self._evaluation.sources) if self._evaluation is not None else ()

    @property
    def animation(self) -> Animation:
        """Length, rate and whether it is a loop; raises `ValueError` where Scenes do not say."""
        if self._evaluation is not None:
            return self.first.scene.animation or STILL
        if len({scene.canvas for scene in self._scenes}) > 1:
            raise ValueError("scenes with several canvases, where size says one for all")
        first, count = self._scenes[0].animation, len(self._scenes)
        fps = self._fps or (first.fps if first is not None else STILL.fps if count == 1 else None)
        if fps is None:
            raise ValueError("scenes without an animation, where fps says how fast they follow each other")
        return Animation(count / fps, fps, first.loop if first is not None else True)

    @property
    def frames(self) -> int:
        return len(self._scenes) or self.animation.frames

    def numbers(self, frames: FrameRange) -> range:
        """Numbers of the requested frames; raises `SceneError` where some do not exist."""
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
        if self._evaluation is None:
            return Shot(number, self._scenes[number], SpanMap())
        scene, spans = self._evaluation.run(number)
        if scene is None or self.diagnostics.errors:
            raise SceneError(self.diagnostics)
        return Shot(number, scene, spans)

    def program(self, shot: Shot) -> Program:
        """Compile a frame; raises `SceneError`, or `FileNotFoundError` where the model has no weights."""
        from scenelang.compiler.compile import compile_scene

        if self._last is not None and same_nodes(self._last[0].scene, shot.scene):
            return self._last[1]
        made = compile_scene(shot.scene, spans=shot.spans, diagnostics=self.diagnostics, memory=self._memory)
        self._last = shot, made
        return made

    def beside(self, frame: Drawable, store: FrameStore) -> Mapping[str, bytes]:
        """Files to write next to a frame's picture, by suffix; an exception ends the run."""
        return {}

    def failed(self, number: int, error: SceneError) -> None:
        """Raise the errors of a frame, or note them, and it is left out."""
        raise error
