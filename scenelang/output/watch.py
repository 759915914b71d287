"""A watched scene, drawn again on each save, and what the terminal shows of it.

They are looked at often, by size, time and identity, which takes microseconds a file. So nothing is lost
when an editor renames a new file over the old one, when a folder comes into being, between two waits, or on
network folders, of whose changes the system gives no notice.
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
from scenelang.language.reports import SceneError
from scenelang.language.session import Defines
from scenelang.output.animate import make
from scenelang.output.frames import Clip, FrameRange
from scenelang.output.painting import Drawable, Painter

if TYPE_CHECKING:
    import PIL.Image

    from scenelang.drawing.image import Image
    from scenelang.drawing.neural.draw import Kept
    from scenelang.output.frames import Target


Stamps = dict[Path, tuple[int, int, int] | None]

LOOK_S: Final = 0.03  # between two looks
CHECK_S: Final = 0.1  # between two looks while it draws
DRAFT_S: Final = 0.15  # a picture that takes longer is shown as a draft first
SETTLE_S: Final = 0.02  # files must have been still for so long
PATIENCE_S: Final = 0.3  # a file that is gone, or empty, may be in the middle of being written


class Outdated(Exception):
    """A file was saved while the scene was drawn."""


@dataclass(slots=True)
class Outcome:
    """What came of a drawing."""

    image: Image | None = None  # a picture that was drawn
    good: bool = False  # whether the file that was asked for is as the scene says
    draft: bool = False  # the picture is coarse, and a better one follows
    same: bool = False  # nothing had to be drawn: the scene means the same picture as before
    diagnostics: list[Diagnostic] = field(default_factory=list)  # of the scene
    # where the time went; `load_s` is torch's import
    compile_s: float = 0.0
    load_s: float = 0.0
    draw_s: float = 0.0
    save_s: float = 0.0
    files: list[Path] = field(default_factory=list)  # what was written


@dataclass(slots=True)
class Easel:
    """Draws a scene as often as it changes; the model, the last picture and its key are kept."""

    source: Source  # the scene, with values of its params
    out: Path  # the picture, or the animation
    target: Target | None  # of an animation; None for a picture
    frames: FrameRange  # of an animation
    frame: int  # of a picture
    how: How  # how they are drawn
    drafted: Callable[[Outcome], None] = lambda _: None  # told of a draft, which the picture follows
    paths: tuple[Path, ...] = ()  # the files that the picture depends on, the scene first
    seen: Stamps = field(default_factory=dict)  # how they were when their names were found out
    _key: str | None = None
    _image: Image | None = None
    _kept: Kept | None = None
    _took_s: float = float("inf")  # to draw the last picture

    def __post_init__(self) -> None:
        self.paths = (Path(os.path.abspath(self.file)),)

    @property
    def file(self) -> Path:
        """The scene's."""
        return Path(self.source.path or "")

    def draw(self, before: Stamps) -> Outcome:
        """Read, compile, draw and save.

        Raises:
            Outdated: files are not as they were ``before``, which ends the drawing of an animation.
            RenderError: there is no such device, or no weights.
            OSError: the picture cannot be written, or the scene not be read.
        """
        outcome = Outcome()
        found = Diagnostics()
        with contextlib.suppress(SceneError):  # its diagnostics are `found`
            self._draw(found, outcome, before)
        outcome.diagnostics = found.items
        torch = "scenelang.drawing.torch_backend"
        if not outcome.good and self.how.backend == "neural" and torch not in sys.modules:
            # loaded in the background, so that a scene that is mended need not wait for it
            threading.Thread(target=importlib.import_module, args=(torch,), daemon=True).start()
        return outcome

    def _draw(self, found: Diagnostics, outcome: Outcome, before: Stamps) -> None:
        started = time.perf_counter()
        clip = self._open(found)
        numbers = clip.numbers(self.frames)
        painter = Painter(clip, self.how, self._kept)
        if self.target is not None and self.target.kind == "video" and not clip.animates:
            found.add("E0337", f"`{self.out}` is for animations, and the scene has no animate(…)", None)
            raise SceneError(found)
        if self.target is not None and (clip.animates or self.target.kind == "sequence"):
            self._film(painter, self.target, numbers, outcome, before)
            return
        frame = painter.prepare(clip.shot(self.frame), single=True)
        outcome.load_s = painter.load_s
        outcome.compile_s = time.perf_counter() - started - painter.load_s
        if frame.key == self._key and self.out.exists():
            outcome.image, outcome.good, outcome.same = self._image, True, True
            return
        if self._took_s > DRAFT_S:
            self._draft(painter, frame, replace(outcome, draft=True))
        started = time.perf_counter()
        outcome.image = painter.draw(frame, checking(before))
        outcome.draw_s = self._took_s = time.perf_counter() - started
        self._kept, self._image = painter.kept, outcome.image
        started = time.perf_counter()
        outcome.image.save(self.out)
        outcome.save_s = time.perf_counter() - started
        outcome.good, outcome.files, self._key = True, [self.out], frame.key

    def _draft(self, painter: Painter, frame: Drawable, outcome: Outcome) -> None:
        started = time.perf_counter()
        outcome.image = painter.draft(frame)
        outcome.draw_s = time.perf_counter() - started
        if outcome.image is not None:
            self._key = None  # what OUT shows is the picture of no scene
            started = time.perf_counter()
            outcome.image.save(self.out)
            outcome.save_s = time.perf_counter() - started
            outcome.good, outcome.files = True, [self.out]
            self.drafted(outcome)

    def _open(self, found: Diagnostics) -> Clip:
        defines = Defines(self.source.values)
        clip = Clip(replace(self.source, params=defines), found)
        # what a broken scene imports is half known: go on watching what it did
        known = self.paths[1:] if found.errors else ()
        self.paths = tuple(dict.fromkeys((self.paths[0], *clip.wanted, *known)))
        self.seen = stamps(self.paths)
        defines.report_unused(found)
        _ = clip.first
        return clip

    def _film(
        self, painter: Painter, target: Target, numbers: range, outcome: Outcome, before: Stamps
    ) -> None:
        made = make(painter, target, numbers, progress=checking(before))
        outcome.good, outcome.files = True, made.files
        outcome.compile_s, outcome.draw_s, outcome.save_s = made.compile_s, made.draw_s, made.encode_s


# ---------------------------------------------------------------- waiting for changes


def checking(before: Stamps) -> Callable[[object], None]:
    """What raises `Outdated`, called now and then, as soon as files are not as they were ``before``."""
    looked = time.monotonic()

    def check(_: object) -> None:
        nonlocal looked
        if time.monotonic() - looked > CHECK_S:
            looked = time.monotonic()
            if stamps(before) != before:
                raise Outdated

    return check


def stamps(paths: Collection[Path]) -> Stamps:
    """What tells each file's contents apart without reading them; None where there is no file."""
    found: Stamps = dict.fromkeys(paths)
    for path in paths:
        with contextlib.suppress(OSError):
            stat = path.stat()
            found[path] = stat.st_mtime_ns, stat.st_size, stat.st_ino
    return found


def wait(before: Stamps) -> None:
    """Return as soon as any file is not as it was before it was read, and has come to rest."""
    while stamps(before) == before:
        time.sleep(LOOK_S)
    settle(before)


def settle(paths: Collection[Path]) -> None:
    """Wait until files have stopped changing; longer for one that is gone or empty, but not for ever."""
    started = time.monotonic()
    last = stamps(paths)
    while True:
        time.sleep(SETTLE_S)
        now = stamps(paths)
        if now == last:
            first = next(iter(now.values()), None)
            whole = first is not None and first[1] > 0
            if whole or time.monotonic() - started > PATIENCE_S:
                return
        last = now
        if time.monotonic() - started > 10 * PATIENCE_S:
            return  # something writes all the time


Show = Literal["auto", "never", "always"]

_CLEAR = "\x1b[2J\x1b[H"  # the screen, not what was scrolled off it
_LINES = 5  # of text, beside the picture


class Screen:
    """Standard output; pictures are shown if it can, never, or always: as coloured characters at least."""

    def __init__(self, show: Show, colour: bool) -> None:
        self.colour = colour
        self.terminal = sys.stdout.isatty()
        self._shown = _find(show) if show != "never" and (self.terminal or show == "always") else None

    @property
    def shows(self) -> bool:
        """Whether pictures are shown."""
        return self._shown is not None

    def clear(self) -> None:
        """Begin anew on a terminal, so that what stands there is what is so."""
        if self.terminal:
            self._write(_CLEAR)

    def say(self, line: str) -> None:
        """Print a line."""
        self._write(line + "\n")

    def say_diagnostics(self, found: list[Diagnostic]) -> None:
        """Print diagnostics with carets."""
        from scenelang.language.reports import render_text

        self._write(render_text(found, self.colour))

    def show(self, picture: PIL.Image.Image) -> None:
        """Show a picture, no larger than the screen; where a terminal misbehaves, say so once and go on."""
        if self._shown is None:
            return
        try:
            self._print(picture, self._shown)
        except (ArithmeticError, LookupError, OSError, RuntimeError, TypeError, ValueError) as error:
            self._shown = None
            self.say(f"cannot show pictures in this terminal: {error}")

    def _print(self, picture: PIL.Image.Image, shown: Any) -> None:
        from rich.console import Console

        columns, lines = shutil.get_terminal_size()
        console = Console(force_terminal=True, width=columns, color_system="truecolor", legacy_windows=False)
        room = max(4, lines - _LINES)
        cell_width, cell_height = _cell()
        wide, high = picture.width / cell_width, picture.height / cell_height
        scale = min(room / high, columns / wide)
        if not shown.__module__.endswith("halfcell"):  # coarse pictures are better large
            scale = min(1.0, scale)
        size = max(1, round(wide * scale)), max(1, round(high * scale))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # between two libraries
            console.print(shown(over_grey(picture), width=size[0], height=size[1]))
        sys.stdout.flush()

    def _write(self, text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()


def _find(show: Show) -> Any:
    """How this terminal shows pictures; None where it cannot, or the library is missing."""
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


def _cell() -> tuple[int, int]:
    """Pixels of a character."""
    from textual_image._terminal import get_cell_size

    size = get_cell_size()
    return size.width, size.height


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
