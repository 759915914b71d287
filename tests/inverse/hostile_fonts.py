"""Fonts that mean harm; ``python -m tests.inverse.hostile_fonts COUNT SEED`` says what reading them takes."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Iterator
from random import Random
from typing import Any

from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib.tables._g_l_y_f import Glyph, GlyphComponent

from scenelang.drawing.exact.mesh import FitError
from scenelang.inverse.learn import make

Draw = Callable[[Any], None]


def zigzag(points: int, width: int = 1000, height: int = 1000, *, random: Random | None = None) -> Draw:
    """A contour that goes up and down across its width, or anywhere at random."""

    def draw(pen: Any) -> None:
        for k in range(points):
            place = (width * k // points, height * (k % 2))
            at = place if random is None else (random.randrange(width), random.randrange(height))
            (pen.lineTo if k else pen.moveTo)(at)
        pen.closePath()

    return draw


def font_of(draws: list[Draw | list[str]], per_em: int = 1000) -> bytes:
    """A font of letters from U+4E00 on: drawn, or put together of others, which are called g0, g1, ..."""
    names = [f"g{k}" for k in range(len(draws))]
    font = FontBuilder(per_em, isTTF=True)
    font.setupGlyphOrder([".notdef", *names])
    font.setupCharacterMap({0x4E00 + k: name for k, name in enumerate(names)})
    glyphs = {".notdef": TTGlyphPen(None).glyph()}
    for name, draw in zip(names, draws, strict=True):
        pen = TTGlyphPen(None)
        if callable(draw):
            draw(pen)
        glyphs[name] = pen.glyph() if callable(draw) else _composed(draw)
    font.font.recalcBBoxes = False
    font.setupGlyf(glyphs, calcGlyphBounds=False)
    for glyph in glyphs.values():
        for side in ("xMin", "yMin", "xMax", "yMax"):
            setattr(glyph, side, getattr(glyph, side, 0))
    font.setupHorizontalMetrics(dict.fromkeys(glyphs, (500, 0)))
    font.setupHorizontalHeader(ascent=800, descent=-200)
    font.setupOS2()
    font.setupPost()
    file = io.BytesIO()
    font.save(file)
    return file.getvalue()


def _composed(parts: list[str]) -> Glyph:
    glyph = Glyph()
    glyph.numberOfContours, glyph.components = -1, []
    for at, name in enumerate(parts):
        part = GlyphComponent()
        part.glyphName, part.x, part.y, part.flags = name, 7 * at, 3 * at, 0x4
        glyph.components.append(part)
    return glyph


def nested(levels: int, parts: int, points: int = 4) -> bytes:
    """Each letter is put together of several of the one before."""
    return font_of([zigzag(points), *([f"g{k}"] * parts for k in range(levels))])


def fonts(count: int, seed: int) -> Iterator[tuple[str, bytes]]:
    """Fonts by construction, and as many of these damaged as make up the count."""
    random = Random(seed)
    built = {
        "50 letters of 5,000 zigzags": font_of([zigzag(5000, 8000, 8000)] * 50),
        "50 letters of 5,000 points anywhere": font_of([zigzag(5000, 8000, 8000, random=random)] * 50),
        "2,000 letters of 100 zigzags": font_of([zigzag(100)] * 2000),
        "2,000 letters of 100 points anywhere": font_of([zigzag(100, random=random)] * 2000),
        "300 letters of 1,000 points anywhere": font_of([zigzag(1000, random=random)] * 300),
        "6,000 letters of 20 points anywhere": font_of([zigzag(20, random=random)] * 6000),
        "extreme widths": font_of([zigzag(4999, 32_767, high) for high in (1, 30, 32_767)] * 20, 16),
        "extreme widths in the em": font_of(
            [zigzag(4999, 32_767, high) for high in (1, 30, 900)] * 20, 16_384
        ),
        "one em of 16": font_of([zigzag(400, 700, 700, random=random)] * 50, 16),
    }
    for levels, parts, points in ((12, 2, 4), (12, 4, 4), (12, 12, 4), (4, 20, 4), (3, 60, 3), (1, 500, 5)):
        built[f"{levels} levels of {parts} parts"] = nested(levels, parts, points)
    yield from list(built.items())[:count]
    listed = sorted(built.items(), key=lambda item: len(item[1]))
    for at in range(count - len(built)):
        name, data = random.choice(listed)
        yield f"{name}, damaged {at}", damaged(data, random)


def damaged(data: bytes, random: Random) -> bytes:
    """Numbers of tables exchanged, most of them at the beginning of one; or cut off."""
    result = bytearray(data)
    tables = [int.from_bytes(data[at + 8 : at + 12]) for at in range(12, 12 + 16 * data[5], 16)]
    for _ in range(random.choice((1, 2, 5, 30))):
        at = random.choice((random.randrange(len(data) - 4), random.choice(tables) + random.randrange(60)))
        size = random.choice((1, 2, 4))
        value = random.choice((0, 1, 0x7F, 0x7FFF, 0xFFFF, 0x80000000, random.getrandbits(32)))
        result[at : at + size] = (value % (1 << 8 * size)).to_bytes(size)
    return bytes(result[: random.randrange(len(data))] if random.random() < 0.05 else result[: len(data)])


def read(data: bytes) -> str:
    """What is said of a font, as `learn` reads it."""
    told: list[str] = []
    request = {"suffix": ".ttf", "name": "x", "options": {}, "about": {}, "files": {}}
    try:
        make(request, data, lambda kind, *what: told.append(" ".join(map(str, what))))
    except FitError as error:
        return str(error)
    return told[-1]


def taken(data: bytes) -> tuple[float, float, int]:
    """Seconds of processor time and MB of memory that reading a font takes, and the status of the process."""
    if (child := os.fork()) == 0:
        try:
            read(data)
        except BaseException:
            os._exit(1)
        os._exit(0)
    _, status, spent = os.wait4(child, 0)
    return spent.ru_utime + spent.ru_stime, spent.ru_maxrss / 1024, status


def main(count: int = 300, seed: int = 1) -> int:
    """Print what each takes; the status says whether one takes over 20 s or 1 GB, or fails."""
    worst = (0.0, 0.0, 0)
    for name, data in fonts(count, seed):
        found = taken(data)
        worst = tuple(map(max, worst, found))  # type: ignore[assignment]
        print(f"{found[0]:6.2f} s {found[1]:6.0f} MB  status {found[2]}  {name}", flush=True)
    print(f"at most {worst[0]:.2f} s and {worst[1]:.0f} MB")
    return int(worst[0] > 20 or worst[1] > 1000 or worst[2] != 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
