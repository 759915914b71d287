"""Fonts: letters as outlines, their advances and kerning, and lines of text. Needs no numpy.

A letter is an element of the form ``outline`` in a disc of its own; `Letter` says where that lies on the
line. Kerning is a table of classes: of a pair, the row of the left letter's class and the column of the right
one's. Nothing here is learned, as curves are exact and small.
"""

from __future__ import annotations

import re
import sys
from array import array
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Final, NamedTuple

from scenelang.assets.element import MOST_CURVES, ROOM, Element, Facts
from scenelang.assets.tensors import Tensor, TensorError

MOST_LETTERS: Final = 40_000
MOST_CLASSES: Final = 1 << 22  # entries of a table of kerning
RESERVED: Final = frozenset(("text", "width"))  # what a font brings to a scene
ALIGNED: Final = {"left": 0.0, "center": 0.5, "right": 1.0}
"""Shares of a line's width that lie left of the origin, by how it is aligned."""
UNIT: Final = 10_000  # of kerning, in an em
_FAR: Final = 100.0  # em: farthest that a letter may reach, and widest that it may be
_SMALL: Final = 1e-6  # em: the least radius of a letter that shows
TENSORS: Final = {
    "font.codes": ("I32", "i"),  # (L,) code points, rising
    "font.letters": ("F32", "f"),  # (4 L,) advance, x, y and radius of each, em
    "font.ends": ("I32", "i"),  # (L,) where the curves of each end, in curves
    "font.classes": ("I32", "i"),  # (2 L,) class of each on the left and on the right of a pair
    "font.kerning": ("I16", "h"),  # (rows columns,) 1 / `UNIT` em
    "font.curves": ("U8", "B"),
}
"""Types of a font's tensors in a file, and as the standard library calls them."""


class Letter(NamedTuple):
    """A letter: how far it advances, and its disc; em, from where it begins on the baseline."""

    advance: float
    x: float
    y: float
    radius: float  # 0 of one that shows nothing


class Placed(NamedTuple):
    """A letter of a line: its element, and middle and radius of its disc."""

    name: str
    x: float
    y: float
    radius: float


class FontError(ValueError):
    """A text that cannot be set; ``at`` is the place of the character, None where it is not one's."""

    def __init__(self, message: str, at: int | None = None) -> None:
        super().__init__(message)
        self.at = at


class Font:
    """A font, by its tables as `TENSORS` has them; raises `TensorError` where they do not fit together."""

    def __init__(self, tables: Mapping[str, Any], columns: int, about: Facts) -> None:
        self.tables, self.columns, self.about = dict(tables), columns, about
        codes, numbers, ends, classes, self._kerning, curves = (tables[name] for name in TENSORS)
        count = len(codes)
        if not 0 < count <= MOST_LETTERS or any(a >= b for a, b in pairwise(codes)):
            raise TensorError(f"a font of {count:,} letters, or of letters out of order")
        fit = len(numbers) == 4 * count == 2 * len(classes) and len(ends) == count
        if not (fit and codes[0] >= 0 and codes[-1] <= sys.maxunicode):
            raise TensorError("a font whose tables do not fit together")
        rows = len(self._kerning) // columns if type(columns) is int and columns > 0 else 0
        if rows * columns != len(self._kerning) or not 0 < rows * columns <= MOST_CLASSES:
            raise TensorError("a font with a damaged table of kerning")
        if not (min(classes) >= 0 and max(classes[:count]) < rows and max(classes[count:]) < columns):
            raise TensorError("a font with letters of unknown classes")
        if not all(-_FAR < number < _FAR for number in numbers):
            raise TensorError("a font with letters beyond all measure")
        self._left, self._right = classes[:count], classes[count:]
        self.letters: dict[str, int] = {chr(code): at for at, code in enumerate(codes)}
        """Places of letters in the tables, by character."""
        self.metrics = [Letter(*numbers[4 * at : 4 * at + 4]) for at in range(count)]
        self.glyphs: dict[str, Element] = {}
        """Elements of the letters that show, by name."""
        first, data = 0, bytes(curves)
        for code, end, letter in zip(codes, ends, self.metrics, strict=True):
            if not first <= end <= first + MOST_CURVES or (end > first) != (letter.radius > _SMALL):
                raise TensorError(f"a font with a damaged letter U+{code:04X}")
            if end > first:
                name = name_of(chr(code))
                curves = data[ROOM * first : ROOM * end]
                self.glyphs[name] = Element(name, "outline", (end - first,), "plain", curves, about)
            first = end
        if ROOM * first != len(data):
            raise TensorError("a font with curves of no letter")

    def line(self, text: str) -> tuple[list[Placed], float]:
        """The letters of a line that begins at the origin, and its width, em; raises `FontError`."""
        pen, placed = 0.0, list[Placed]()
        for place, character in enumerate(text):
            at = self.letters.get(character, -1)
            if character in "\n\r\v\f\x85\u2028\u2029":
                raise FontError("a line break in a text, which is one line", place)
            if at < 0:
                code = f"U+{ord(character):04X}"
                shown = f"`{character}` ({code})" if character.isprintable() else code
                raise FontError(f"the font has no {shown}", place)
            if place:
                pen += self.kerning(text[place - 1], character)
            letter = self.metrics[at]
            if letter.radius > _SMALL:
                placed.append(Placed(name_of(character), pen + letter.x, letter.y, letter.radius))
            pen += letter.advance
        return placed, pen

    def kerning(self, left: str, right: str) -> float:
        """By how much a letter goes farther from another than that advances, em."""
        row, column = self._left[self.letters[left]], self._right[self.letters[right]]
        return float(self._kerning[row * self.columns + column]) / UNIT


GLYPH: Final = re.compile("u[0-9a-f]{4,}")
"""Names that elements of letters may have."""


def name_of(character: str) -> str:
    """Name of a letter's element: ``u0041``."""
    return f"u{ord(character):04x}"


def read_font(columns: int, about: Facts, tensors: Mapping[str, Tensor], body: memoryview) -> Font:
    """The font of a file of tensors; raises `TensorError`."""
    tables: dict[str, Any] = {}
    for name, (kind, code) in TENSORS.items():
        if (tensor := tensors.get(name)) is None or tensor.type != kind or len(tensor.shape) != 1:
            raise TensorError(f"a font without its table `{name}`")
        table = array(code, bytes(body[tensor.first : tensor.last]))
        if sys.byteorder == "big":
            table.byteswap()
        tables[name] = table
    return Font(tables, columns, about)
