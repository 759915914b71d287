"""Fonts of strangers as outlines and tables, read by HarfBuzz in the sandbox.

Contours may overlap or run either way round. What is kept are the parts of curves that have the inside on one
side alone, turned so that it lies on their left: the outline of their union, by the rule of nonzero winding.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, Final
from unicodedata import category

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import GRAIN, MOST_CURVES, Facts
from scenelang.assets.element_file import MOST_CLASSES, MOST_LETTERS, TENSORS, UNIT, Font
from scenelang.assets.tensors import TensorError
from scenelang.drawing.exact.mesh import FitError, needed
from scenelang.drawing.exact.outline import winding
from scenelang.drawing.neural.outlines import MEET
from scenelang.language.diagnostics import plural
from scenelang.output.roots import crossed

MOST_OF_FONT: Final = dict.fromkeys((".ttf", ".otf", ".ttc"), 32 << 20)  # bytes of a file
_CUBIC: Final = 2e-5  # em: how far quadratic curves may be off a cubic one
_MOST_CURVES: Final = 1_000_000  # of all letters
_KERNED: Final = 3000  # letters whose pairs are asked
_ALPHABETS: Final = 0x2E80  # where those end that fonts kern
_SAMPLES: Final = 8, 64  # edges of a curve, to see whether contours overlap, and where they do
_BESIDE: Final = 1e-7  # of a radius: from a curve to where its sides are asked
_MEET: Final = 1e-5  # of a radius: so near each other curves meet
_CLOSE: Final = 50_000  # pairs of curves of a letter that may meet
_LEAST: Final = 1e-6  # em: the least radius of what shows
Curves = npt.NDArray[np.float64]  # (n, 3, 2) start, control point, end


def read_font(
    data: bytes, about: Facts, letters: str | None = None, say: Callable[[str], None] = lambda line: None
) -> tuple[Font, list[str]]:
    """Read the letters of a font that lie in ranges, by default all, and lines about it; raises `FitError`.

    ``say`` is called when the file is known to be a font, before its letters are read.
    """
    with needed("uharfbuzz"):
        import uharfbuzz
    if data[:4] in (b"wOF2", b"wOFF"):
        raise FitError("a packed font for the web: unpack it to .ttf or .otf first")
    face = uharfbuzz.Face(uharfbuzz.Blob(data))
    if not face.glyph_count or not 16 <= face.upem <= 1 << 14:
        raise FitError("damaged or not a TrueType or OpenType font")
    font = uharfbuzz.Font(face)
    codes = [int(code) for code in face.unicodes if category(chr(code)) not in ("Cc", "Cs")]
    held = {code: glyph for code in codes if (glyph := font.get_nominal_glyph(code))}
    if letters is not None:
        ranges = ranges_of(letters)
        held = {code: glyph for code, glyph in held.items() if any(code in some for some in ranges)}
    if not 0 < len(held) <= MOST_LETTERS:
        raise FitError(f"{len(held):,} of these letters, where 1 to {MOST_LETTERS:,} are allowed")
    say(plural(len(held), "letter"))
    codes, numbers, ends, parts = list[int](), list[float](), list[int](), list[bytes]()
    left_out, count = list[str](), 0
    for code, glyph in sorted(held.items()):
        advance = font.get_glyph_h_advance(glyph) / face.upem
        disc, outline = _outline(_contours(font, glyph) / face.upem)
        if not abs(advance) < 50 or len(outline) > MOST_CURVES or not _closed(outline):
            left_out.append(f"U+{code:04X}")
            continue
        count += len(outline)
        if count > _MOST_CURVES:
            raise FitError(f"letters of more than {_MOST_CURVES:,} curves")
        parts.append(outline.tobytes())
        codes.append(code)
        numbers += (advance, *disc)
        ends.append(count)
    glyphs = [held[code] for code in codes]
    classes, kerning, columns = _kerning(uharfbuzz, font, codes, glyphs, face.upem)
    values: list[Any] = [codes, numbers, ends, classes, kerning, b"".join(parts)]
    tables = {name: array(TENSORS[name][1], value) for name, value in zip(TENSORS, values, strict=True)}
    try:
        result = Font(tables, columns, about)
    except TensorError as error:
        raise FitError(str(error)) from None
    notes = [plural(len(codes), "letter"), plural(count, "curve"), f"{len(kerning):,} pairs of classes"]
    notes += [f"left out, as they are damaged: {', '.join(left_out[:20])}"] if left_out else []
    return result, notes


def ranges_of(text: str) -> list[range]:
    """Code points of ranges as style sheets have them: ``U+20-7E, U+2190-2193``; raises `ValueError`."""
    result = []
    for part in text.replace(" ", "").split(","):
        if (match := re.fullmatch(r"[Uu]\+([0-9A-Fa-f]{1,6})(?:-([0-9A-Fa-f]{1,6}))?", part)) is None:
            raise ValueError(f"`{part[:40]}` is not a range of letters such as U+20-7E")
        result.append(range(int(match[1], 16), int(match[2] or match[1], 16) + 1))
    return result


def _contours(font: Any, glyph: int) -> Curves:
    """Closed contours of a glyph, in font units; cubic curves as quadratic ones that are near enough."""
    drawn, begin = list[tuple[Any, ...]](), (0.0, 0.0)
    draw = dict.fromkeys(("lineTo", "qCurveTo", "curveTo"), lambda *points: drawn.append(points))
    end = dict.fromkeys(("closePath", "endPath"), lambda: None)
    pen = SimpleNamespace(moveTo=lambda point: drawn.append((None, point)), **draw, **end)
    font.draw_glyph_with_pen(glyph, pen)
    found, at = [np.zeros((0, 3, 2))], begin
    for first, *rest in [*drawn[: 4 * MOST_CURVES], (None, begin)]:
        closes = first is None
        points = np.array([at, begin] if closes else [at, first, *rest], float)
        at = (first, *rest)[-1]
        begin = at if closes else begin
        if len(points) == 2:
            points = np.stack([points[0], points.mean(0), points[1]])
        found.append(_quadratics(points, _CUBIC * font.face.upem) if len(points) == 4 else points[None])
    result = np.concatenate(found)
    return np.asarray(result[(result != result[:, :1]).any((1, 2))])


def _quadratics(p: Curves, near: float) -> Curves:
    """Curves (n, 3, 2) that are near enough to a cubic one (4, 2)."""
    a, u, v, w = p[0], 3 * (p[1] - p[0]), 3 * (p[2] - 2 * p[1] + p[0]), p[3] - 3 * p[2] + 3 * p[1] - p[0]
    n = int(np.clip(np.ceil((np.hypot(*w) * 3**0.5 / 36 / near) ** (1 / 3)), 1, 32))
    t = np.linspace(0, 1, n + 1)[:, None]
    point, way = a + t * (u + t * (v + t * w)), u + t * (2 * v + 3 * t * w)
    by = (point[:-1] + point[1:]) / 2 + (way[:-1] - way[1:]) / (4 * n)
    return np.stack([point[:-1], by, point[1:]], 1)


def _edges(curves: Curves, count: int) -> Curves:
    """Edges (n, count, 2, 2) along curves."""
    t = np.linspace(0, 1, count + 1)[:, None]
    a, b, c = (curves[:, k, None] for k in range(3))
    points = (1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c
    return np.stack([points[:, :-1], points[:, 1:]], 2)


def _part(curve: Curves, s: float, e: float) -> Curves:
    """A curve (3, 2) from a parameter to another."""
    a, u, w = curve[0], 2 * (curve[1] - curve[0]), curve[0] - 2 * curve[1] + curve[2]
    return np.stack([a + s * (u + s * w), a + u * (s + e) / 2 + w * s * e, a + e * (u + e * w)])


def _outline(curves: Curves) -> tuple[tuple[float, float, float], npt.NDArray[np.int16]]:
    """The disc of contours, and the outline of what they cover in it (n, 3, 2), in steps of `GRAIN`."""
    nothing = (0.0, 0.0, 0.0), np.zeros((0, 3, 2), np.int16)
    if not len(curves) or not abs(curves).max() < 50:
        return nothing
    kept = _boundary(curves)
    if not len(kept):
        return nothing
    points = _edges(kept, _SAMPLES[1]).reshape(-1, 2)
    middle = (points.min(0) + points.max(0)) / 2
    radius = float(np.hypot(*(points - middle).T).max())
    if radius < _LEAST:
        return nothing
    steps = np.rint((kept - middle) / radius * (GRAIN - 1)).clip(-GRAIN, GRAIN).astype("<i2")
    steps = steps[(steps != steps[:, :1]).any((1, 2))]
    return (float(middle[0]), float(middle[1]), radius * GRAIN / (GRAIN - 1)), steps


def _boundary(curves: Curves) -> Curves:
    """Parts of closed contours that have the inside on one side alone, turned to have it on their left."""
    size, few = abs(curves - curves.mean((0, 1))).max(), _edges(curves, _SAMPLES[0])
    side = _sides(few, winding(few.reshape(-1, 2, 2), odd=False), size)
    if (side == 1).all() or (side == -1).all():
        return curves if side[0, 0] == 1 else curves[::-1, ::-1]
    parts, count = _apart(curves, size), _SAMPLES[1]
    many = _edges(parts, count)
    side = _sides(many[:, count // 2], winding(many.reshape(-1, 2, 2), odd=False), size)
    return np.asarray(np.where(side[:, None, None] > 0, parts, parts[:, ::-1])[side != 0])


def _apart(curves: Curves, size: float) -> Curves:
    """Parts of curves, cut where they cross others or end on them; whole ones where that is too much work."""
    low, high, n = curves.min(1) - _MEET * size, curves.max(1) + _MEET * size, _SAMPLES[0]
    close = (low[:, None] <= high).all(2) & (low <= high[:, None]).all(2)
    pairs = np.nonzero(np.triu(close, 1))
    if len(pairs[0]) > _CLOSE:
        return curves
    edges = _edges(curves, n)
    start, way = edges[:, :, 0], edges[:, :, 1] - edges[:, :, 0]
    between = start[pairs[1]][:, None] - start[pairs[0]][:, :, None]  # (pairs, n, n, 2)
    one, other = way[pairs[0]][:, :, None], way[pairs[1]][:, None]
    turn = crossed(one, other)
    shares = [crossed(between, w) / np.where(turn, turn, 1e-30) for w in (other, one)]
    pair, *place = np.nonzero((abs(np.array(shares) - 0.5) < 0.6).all(0))
    curve = np.array(pairs)[:, pair]
    t = np.array([(k + share[pair, *place]) / n for k, share in zip(place, shares, strict=True)])
    for _ in range(8):  # Newton's method
        (a, u), (b, v) = (_moving(curves[which], x) for which, x in zip(curve, t, strict=True))
        turn = crossed(u, v)
        t = t + np.stack([crossed(b - a, v), crossed(b - a, u)]) / np.where(turn, turn, np.inf)
        t = t.clip(-0.1, 1.1)
    met = (abs(t - 0.5) <= 0.5 + _MEET).all(0) & (np.hypot(*(a - b).T) < _MEET * size)
    result = []
    for at, one in enumerate(curves):
        cuts = np.unique([0, *np.round(t[:, met][curve[:, met] == at].clip(0, 1), 6), 1])
        result += [_part(one, s, e) for s, e in pairwise(cuts)]
    return np.array(result)


def _moving(curves: Curves, t: Curves) -> tuple[Curves, Curves]:
    """Points and derivatives (n, 2) of curves at parameters."""
    u, w, t = 2 * (curves[:, 1] - curves[:, 0]), curves[:, 0] - 2 * curves[:, 1] + curves[:, 2], t[:, None]
    return curves[:, 0] + t * (u + t * w), u + 2 * t * w


def _sides(edges: Curves, inside: Any, size: float) -> npt.NDArray[np.int8]:
    """1 for edges (…, 2, 2) with the inside on the left alone, -1 on the right alone, else 0."""
    flat = edges.reshape(-1, 2, 2)
    way, middle = flat[:, 1] - flat[:, 0], flat.mean(1)
    beside = np.stack([-way[:, 1], way[:, 0]], 1) / np.maximum(np.hypot(*way.T), 1e-12)[:, None]
    beside *= _BESIDE * size
    left, right = inside(middle + beside).astype(np.int8), inside(middle - beside).astype(np.int8)
    return np.asarray((left - right).reshape(edges.shape[:-2]))


def _closed(outline: npt.NDArray[np.int16]) -> bool:
    """Return whether every curve of an outline ends where one begins."""
    from scipy.spatial import cKDTree

    starts, ends = outline[:, 0].astype(float), outline[:, 2].astype(float)
    return not len(outline) or bool(cKDTree(starts).query(ends)[0].max() <= MEET * GRAIN)


def _kerning(
    uharfbuzz: Any, font: Any, codes: list[int], glyphs: list[int], upem: int
) -> tuple[list[int], list[int], int]:
    """Classes of letters on the left and on the right of pairs, the table of these, and its columns."""
    asked = [at for at, code in enumerate(codes) if code < _ALPHABETS and category(chr(code))[0] != "M"]
    del asked[_KERNED:]
    advances = np.array([font.get_glyph_h_advance(glyphs[at]) for at in asked], np.int64)
    wanted = [glyphs[at] for at in asked]
    rows: dict[bytes, int] = {np.zeros(len(asked), np.int16).tobytes(): 0}
    classes = np.zeros((2, len(codes)), np.int64)
    plain = dict.fromkeys(("liga", "clig", "calt", "rlig", "dlig"), False) | {"kern": True}
    for at, advance in zip(asked, advances.tolist(), strict=True):
        buffer = uharfbuzz.Buffer()  # the letter before each of all others
        buffer.add_codepoints([code for other in asked for code in (codes[at], codes[other])])
        buffer.guess_segment_properties()
        buffer.direction = "ltr"
        uharfbuzz.shape(font, buffer, plain)
        own = np.zeros(len(asked), np.int64)
        infos = [(info.cluster, info.codepoint) for info in buffer.glyph_infos]
        neighbours = zip(infos, infos[1:], buffer.glyph_positions, strict=False)
        for (first, left), (second, right), place in neighbours:
            k, odd = divmod(first, 2)
            if not odd and second == first + 1 and (left, right) == (glyphs[at], wanted[k]):
                own[k] = place.x_advance - advance  # others join, or become other glyphs
        row = np.rint(own * (UNIT / upem)).clip(-32767, 32767).astype(np.int16)
        if (len(rows) + 1) * len(asked) > MOST_CLASSES:
            break
        classes[0, at] = rows.setdefault(row.tobytes(), len(rows))
    table = np.array([np.frombuffer(row, np.int16) for row in rows])
    columns: dict[bytes, int] = {np.zeros(len(table), np.int16).tobytes(): 0}
    for at, column in zip(asked, table.T, strict=True):
        classes[1, at] = columns.setdefault(np.ascontiguousarray(column).tobytes(), len(columns))
    table = np.array([np.frombuffer(column, np.int16) for column in columns]).T
    return classes.reshape(-1).tolist(), table.reshape(-1).tolist(), len(columns)
