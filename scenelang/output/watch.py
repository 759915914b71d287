"""A watched scene, drawn again on each save, and its picture in the terminal.

Files are polled by size, time and identity, as notifications miss renamed files and network folders.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import shutil
import sys
import threading
import time
import warnings
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from scenelang.drawing.how import How, RenderError
from scenelang.language.diagnostics import Diagnostic, Diagnostics
from scenelang.language.evaluation import Source
from scenelang.language.reports import SceneError, render_text
from scenelang.language.session import Defines
from scenelang.output.animate import make
from scenelang.output.frames import Clip, FrameRange
from scenelang.output.painting import Painter

if TYPE_CHECKING:
    import PIL.Image

    from scenelang.drawing.image import Image
    from scenelang.output.frames import Target

Stamps = dict[Path, tuple[int, int, int] | None]

LOOK_S: Final = 0.03  # between two polls
CHECK_S: Final = 0.1  # between two polls while it draws
DRAFT_S: Final = 0.15  # a picture that takes longer is shown as a draft first
SETTLE_S: Final = 0.02  # time without a change after which files count as saved
PATIENCE_S: Final = 0.3  # the same for a missing or empty file, which may be being written


class Outdated(Exception):
    """A file was saved while the scene was drawn."""


@dataclass(slots=True)
class Outcome:
    """Result of a drawing."""

    image: Image | None = None  # a picture that was drawn
    good: bool = False  # the output file shows the scene
    draft: bool = False  # the picture is coarse, and a better one follows
    same: bool = False  # nothing was drawn: the picture is the previous one
    diagnostics: list[Diagnostic] = field(default_factory=list)  # of the scene
    seconds: dict[str, float] = field(default_factory=dict)  # time of each step
    files: list[Path] = field(default_factory=list)  # written files


@dataclass(slots=True)
class Easel:
    """Draws a scene again when it changes; caches the model, the last picture and its key."""

    source: Source  # the scene, with values of its params
    out: Path  # the picture, or the animation
    target: Target | None  # of an animation; None for a picture
    frames: FrameRange  # of an animation
    frame: int  # of a picture
    how: How  # how they are drawn
    drafted: Callable[[Outcome], None] = lambda _: None  # called with a draft, before the picture
    paths: tuple[Path, ...] = ()  # the files that the picture depends on, the scene first
    seen: Stamps = field(default_factory=dict)  # their stamps when their names were read
    _key: str | None = None
    _image: Image | None = None
    _took_s: float = float("inf")  # drawing time of the last picture

    def __post_init__(self) -> None:
        self.paths = (Path(os.path.abspath(self.file)),)

    @property
    def file(self) -> Path:
        return Path(self.source.path or "")

    def draw(self, before: Stamps) -> Outcome:
        """Read, compile, draw and save; raises `Outdated` where files differ from ``before`` meanwhile."""
        outcome = Outcome()
        diagnostics = Diagnostics()
        with contextlib.suppress(SceneError):  # its diagnostics are collected
            self._draw(diagnostics, outcome, before)
        outcome.diagnostics = diagnostics.items
        torch = "scenelang.drawing.torch_backend"
        if not outcome.good and self.how.backend == "neural" and torch not in sys.modules:
            # load it in the background, so that a corrected scene need not wait for it
            threading.Thread(target=importlib.import_module, args=(torch,), daemon=True).start()
        return outcome

    def _draw(self, diagnostics: Diagnostics, outcome: Outcome, before: Stamps) -> None:
        started = time.perf_counter()
        clip = self._open(diagnostics)
        numbers = clip.numbers(self.frames)
        painter = Painter(clip, self.how)
        if self.target is not None and self.target.kind == "video" and not clip.animates:
            diagnostics.add("E0337", f"`{self.out}` is for animations, and the scene has no animate(…)", None)
            raise SceneError(diagnostics)
        if self.target is not None and (clip.animates or self.target.kind == "sequence"):
            run = make(painter, self.target, numbers, progress=checking(before))
            outcome.good, outcome.files = True, run.files
            outcome.seconds = {"compile": run.compile_s, "draw": run.draw_s, "save": run.encode_s}
            return
        frame = painter.prepare(clip.shot(self.frame))
        outcome.seconds["compile"] = time.perf_counter() - started - painter.load_s
        if painter.load_s:
            outcome.seconds["load torch"] = painter.load_s
        if frame.key == self._key and self.out.exists():
            outcome.image, outcome.good, outcome.same = self._image, True, True
            return
        if self._took_s > DRAFT_S:
            started, draft = time.perf_counter(), replace(outcome, draft=True, seconds={**outcome.seconds})
            draft.image = painter.draft(frame)
            draft.seconds["draw"] = time.perf_counter() - started
            if draft.image is not None:
                self._save(draft, draft.image, None)  # the file is not the picture of a scene now
                self.drafted(draft)
        started = time.perf_counter()
        outcome.image = painter.draw(frame, checking(before))
        outcome.seconds["draw"] = self._took_s = time.perf_counter() - started
        self._image = outcome.image
        self._save(outcome, outcome.image, frame.key)

    def _save(self, outcome: Outcome, image: Image, key: str | None) -> None:
        started, self._key = time.perf_counter(), None
        image.save(self.out)
        outcome.seconds["save"] = time.perf_counter() - started
        outcome.good, outcome.files, self._key = True, [self.out], key

    def _open(self, diagnostics: Diagnostics) -> Clip:
        defines = Defines(self.source.values)
        clip = Clip(replace(self.source, params=defines), diagnostics)
        # a broken scene's imports are only partly known: go on watching the previous ones
        known = self.paths[1:] if diagnostics.errors else ()
        self.paths = tuple(dict.fromkeys((self.paths[0], *clip.wanted, *known)))
        self.seen = stamps(self.paths)
        defines.report_unused(diagnostics)
        _ = clip.first
        return clip


def checking(before: Stamps) -> Callable[[object], None]:
    """Return a function to call now and then; it raises `Outdated` once files differ from ``before``."""
    looked = time.monotonic()

    def check(_: object) -> None:
        nonlocal looked
        if time.monotonic() - looked > CHECK_S:
            looked = time.monotonic()
            if stamps(before) != before:
                raise Outdated

    return check


def stamps(paths: Collection[Path]) -> Stamps:
    """Time, size and identity of each file, which change with its contents; None without a file."""
    result: Stamps = dict.fromkeys(paths)
    for path in paths:
        with contextlib.suppress(OSError):
            stat = path.stat()
            result[path] = stat.st_mtime_ns, stat.st_size, stat.st_ino
    return result


def wait(before: Stamps) -> None:
    """Wait until a file differs from ``before`` and has stopped changing."""
    while stamps(before) == before:
        time.sleep(LOOK_S)
    settle(before)


def settle(paths: Collection[Path]) -> None:
    """Wait until files have stopped changing; longer where one is missing or empty, but not forever."""
    started = time.monotonic()
    last = stamps(paths)
    while True:
        time.sleep(SETTLE_S)
        now = stamps(paths)
        if now == last:
            first = next(iter(now.values()), None)
            if (first is not None and first[1] > 0) or time.monotonic() - started > PATIENCE_S:
                return
        last = now
        if time.monotonic() - started > 10 * PATIENCE_S:
            return  # something writes all the time


Show = Literal["auto", "never", "always"]

_CLEAR = "\x1b[2J\x1b[H"  # of the screen, not of lines that were scrolled off
_LINES = 5  # lines of text next to the picture


class Screen:
    """Standard output; pictures are shown if it can, never, or always: as coloured characters at least."""

    def __init__(self, show: Show, colour: bool) -> None:
        self.colour = colour
        self.terminal = sys.stdout.isatty()
        self.shows = _find(show) if show != "never" and (self.terminal or show == "always") else None

    def clear(self) -> None:
        if self.terminal:
            print(_CLEAR, end="", flush=True)

    def say(self, line: str) -> None:
        print(line, flush=True)

    def say_diagnostics(self, diagnostics: list[Diagnostic]) -> None:
        """Print diagnostics with carets."""
        print(render_text(diagnostics, self.colour), end="", flush=True)

    def show(self, picture: PIL.Image.Image) -> None:
        """Show a picture, no larger than the screen; after an error report it once and show no more."""
        if self.shows is None:
            return
        try:
            self._print(picture, self.shows)
        except (ArithmeticError, LookupError, OSError, RuntimeError, TypeError, ValueError) as error:
            self.shows = None
            self.say(f"cannot show pictures in this terminal: {error}")

    def _print(self, picture: PIL.Image.Image, shown: Any) -> None:
        from rich.console import Console
        from textual_image._terminal import get_cell_size

        columns, lines = shutil.get_terminal_size()
        console = Console(force_terminal=True, width=columns, color_system="truecolor", legacy_windows=False)
        room, cell = max(4, lines - _LINES), get_cell_size()
        wide, high = picture.width / cell.width, picture.height / cell.height
        scale = min(room / high, columns / wide)
        if not shown.__module__.endswith("halfcell"):  # coarse pictures are better large
            scale = min(1.0, scale)
        size = max(1, round(wide * scale)), max(1, round(high * scale))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # between two libraries
            console.print(shown(over_grey(picture), width=size[0], height=size[1]))
        sys.stdout.flush()


def _find(show: Show) -> Any:
    """The class that shows pictures in this terminal; None where none can, or the library is missing."""
    try:
        # asks the terminal, which answers through standard input
        if not sys.stdin.isatty() or not sys.stdout.isatty():
            from textual_image.renderable.halfcell import Image as Cells

            return Cells if show == "always" else None
        from textual_image.renderable import HalfcellImage, Image, UnicodeImage
    except ImportError:
        if show != "always":
            return None
        raise RenderError("showing pictures needs textual-image: pip install 'scenelang[watch]'") from None
    except Exception:  # whatever a terminal answers
        return None
    if Image in (HalfcellImage, UnicodeImage):
        truecolor = os.environ.get("COLORTERM", "").lower() in ("truecolor", "24bit")
        return HalfcellImage if show == "always" or truecolor else None
    return Image


def over_grey(picture: PIL.Image.Image) -> PIL.Image.Image:
    """A picture over a checkerboard where it is transparent."""
    if picture.mode != "RGBA":
        return picture
    from PIL import Image, ImageDraw

    board = Image.new("RGBA", picture.size, "#cccccc")
    draw = ImageDraw.Draw(board)
    for y in range(0, picture.height, 8):
        for x in range(8 * (y // 8 % 2), picture.width, 16):
            draw.rectangle((x, y, x + 7, y + 7), fill="#999999")
    return Image.alpha_composite(board, picture).convert("RGB")
