"""What a watcher says, and the picture where the terminal can show it. All goes to standard output."""

from __future__ import annotations

import os
import shutil
import sys
import warnings
from typing import TYPE_CHECKING, Any, Literal

from scenelang.backend.options import RenderError
from scenelang.diagnostics.diagnostic import Diagnostic

if TYPE_CHECKING:
    import PIL.Image

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
        from scenelang.diagnostics.render_text import render_text

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
