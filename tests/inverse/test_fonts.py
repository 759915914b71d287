"""Fonts that fontTools writes: what is made of them against closed forms, and hostile ones."""

from __future__ import annotations

import hashlib
import io
import math
from pathlib import Path
from random import Random

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.element_file import Font, FontError, element_file_bytes, load_element_file, read_zoo
from scenelang.assets.tensors import TensorError
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.exact.mesh import FitError
from scenelang.drawing.exact.outline import drawn
from scenelang.drawing.neural.outlines import OutlineShapes
from scenelang.inverse.learn import ranges_of, read_font
from scenelang.language import library
from tests.assets.shapes import ball, element

pytest.importorskip("uharfbuzz")
builder = pytest.importorskip("fontTools.fontBuilder")

from fontTools.feaLib.builder import addOpenTypeFeaturesFromString
from fontTools.pens.t2CharStringPen import T2CharStringPen
from fontTools.pens.ttGlyphPen import TTGlyphPen

from tests.inverse.hostile_fonts import font_of, fonts, nested, taken, zigzag

NAMES = {0x41: "A", 0x42: "B", 0x20: "space"}
ADVANCES = {".notdef": 500, "A": 700, "B": 640, "space": 250}
ROUND = 0.5522847498


def boxes(pen: object) -> None:
    """Two squares of 400 that overlap in one of 200."""
    for x in (100, 300):
        first, *rest = (x, x - 100), (x + 400, x - 100), (x + 400, x + 300), (x, x + 300)
        pen.moveTo(first)  # type: ignore[attr-defined]
        for corner in rest:
            pen.lineTo(corner)  # type: ignore[attr-defined]
        pen.closePath()  # type: ignore[attr-defined]


def disc(pen: object, x: float = 320, y: float = 300, r: float = 300) -> None:
    """A circle of four cubic curves, off by 1/4000 of its radius."""
    pen.moveTo((x + r, y))  # type: ignore[attr-defined]
    for k in range(4):
        c, s = math.cos(k * math.pi / 2), math.sin(k * math.pi / 2)
        points = ((1, ROUND), (ROUND, 1), (0, 1))
        pen.curveTo(*((x + r * (c * u - s * v), y + r * (s * u + c * v)) for u, v in points))  # type: ignore[attr-defined]
    pen.closePath()  # type: ignore[attr-defined]


def made(cubic: bool, kern: int = -80) -> bytes:
    """A font of a square pair, a disc (only with cubic curves) and a space."""
    font = builder.FontBuilder(1000, isTTF=not cubic)
    font.setupGlyphOrder([".notdef", "A", "B", "space"])
    font.setupCharacterMap(NAMES)
    draw = {"A": boxes, "B": disc if cubic else boxes}
    glyphs = {}
    for name in ADVANCES:
        pen = T2CharStringPen(ADVANCES[name], None) if cubic else TTGlyphPen(None)
        draw.get(name, lambda pen: None)(pen)
        glyphs[name] = pen.getCharString() if cubic else pen.glyph()
    if cubic:
        font.setupCFF("Test", {}, glyphs, {})
    else:
        font.setupGlyf(glyphs)
    font.setupHorizontalMetrics(
        {name: (width, 100 * (name == "A" or not cubic)) for name, width in ADVANCES.items()}
    )
    font.setupHorizontalHeader(ascent=800, descent=-200)
    font.setupOS2()
    font.setupPost()
    addOpenTypeFeaturesFromString(font.font, f"feature kern {{ pos A B {kern}; }} kern;")
    file = io.BytesIO()
    font.save(file)
    return file.getvalue()


def distances(font: Font, letter: str, p: np.ndarray) -> np.ndarray:
    """Distances (M,), em, of points (M, 2) of the line that the letter begins, as they are drawn."""
    shown = font.metrics[font.letters[letter]]
    shape = OutlineShapes(NUMPY, [font.glyphs[f"u{ord(letter):04x}"]], np.zeros(1, np.float32))
    q = ((p - [shown.x, shown.y]) / shown.radius).T.astype(np.float32)
    return shape.distance(q, np.zeros(len(p), np.intp)) * shown.radius


def box(p: np.ndarray, low: float, high: float, bottom: float, top: float) -> np.ndarray:
    """The exact distance of a rectangle."""
    x = np.maximum(low - p[:, 0], p[:, 0] - high)
    y = np.maximum(bottom - p[:, 1], p[:, 1] - top)
    return np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0)


@pytest.mark.parametrize("cubic", [False, True])
def test_letters_have_the_distances_of_what_their_contours_cover(cubic: bool) -> None:
    font = read_font(made(cubic), {})[0]
    p = np.random.default_rng(3).uniform(-0.5, 1.5, (4000, 2))
    union = np.minimum(box(p, 0.1, 0.5, 0, 0.4), box(p, 0.3, 0.7, 0.2, 0.6))
    outside = union > 0  # inside, the least of both is no distance where they overlap
    found = distances(font, "A", p)
    assert ((found < 0) == (union < 0))[abs(union) > 1e-4].all()
    assert abs(found - union)[outside].max() < 2e-4
    corner = distances(font, "A", np.array([[0.4, 0.3], [0.45, 0.25]]))  # to the concave corners of the union
    assert abs(corner + np.hypot([0.1, 0.05], [0.1, 0.05])).max() < 2e-4
    if cubic:
        away = np.hypot(p[:, 0] - 0.32, p[:, 1] - 0.3) - 0.3
        assert abs(distances(font, "B", p) - away).max() < 3e-4


def test_advances_and_kerning_are_those_of_the_font() -> None:
    font = read_font(made(True, kern=-80), {})[0]
    line, width = font.line("AB A")
    assert width == pytest.approx((700 - 80 + 640 + 250 + 700) / 1000, abs=1e-6)
    assert [round(letter.x - font.metrics[font.letters["A"]].x, 4) for letter in line][::2] == [0.0, 1.51]
    assert font.line("")[1] == 0
    for text, at in (("AxB", 1), ("A\nB", 1)):
        with pytest.raises(FontError) as error:
            font.line(text)
        assert error.value.at == at


def test_a_font_goes_into_a_file_beside_elements_and_is_not_read_twice(tmp_path: Path) -> None:
    source, out, said = tmp_path / "Test.otf", tmp_path / "mine.safetensors", list[str]()
    source.write_bytes(made(True))
    nsg.learn(source, out, letters="U+41-42", license="OFL", say=said.append)
    first = out.read_bytes()
    nsg.learn(source, out, letters="U+41-42", license="OFL", say=said.append)
    assert said[-1] == "Test: made before of this file"
    assert out.read_bytes() == first
    font = load_element_file(out).font
    assert font is not None
    assert [*font.letters] == ["A", "B"]
    assert font.about["license"] == "OFL"
    scene = nsg.loads('import "mine.safetensors" as f; f.text("AB", size = 0.5);', root=tmp_path)
    assert [child.geometry for child in scene.nodes[0].children] == ["f.u0041", "f.u0042"]
    assert nsg.loads(scene.to_nsg(), root=tmp_path) == scene == nsg.Scene.from_json(scene.to_json(), tmp_path)


def test_what_is_not_a_font_is_a_clear_word() -> None:
    data, random = made(False), np.random.default_rng(5)
    for wrong in (b"", b"wOF2" + data, b"no font at all", data[:200]):
        with pytest.raises(FitError):
            read_font(wrong, {})
    for _ in range(60):  # any damage is a word or a font, never a crash
        damaged = np.frombuffer(data, np.uint8).copy()
        damaged[random.integers(0, len(data), 12)] = random.integers(0, 256, 12)
        try:
            read_font(damaged.tobytes(), {})
        except FitError:
            continue
    with pytest.raises(ValueError, match="range"):
        ranges_of("A-Z")


def test_composites_that_hold_themselves_end() -> None:
    from fontTools.ttLib import TTFont
    from fontTools.ttLib.tables._g_l_y_f import GlyphComponent

    font = TTFont(io.BytesIO(made(False)))
    glyph, part = font["glyf"]["A"], GlyphComponent()
    part.glyphName, part.x, part.y, part.flags = "A", 0, 0, 0x4
    glyph.numberOfContours, glyph.components = -1, [part] * 8
    file = io.BytesIO()
    font.recalcBBoxes = False
    font.save(file)
    font, _ = read_font(file.getvalue(), {})
    assert len(font.letters) >= 1


def test_letters_of_too_many_points_are_left_out_and_too_many_of_them_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """50 letters of 5,000 zigzags took 500 s, and 2,000 of 100 took 91 s."""
    font, notes = read_font(font_of([zigzag(4), zigzag(5000, 8000, 8000), zigzag(4990, 8000, 8000)]), {})
    assert [*font.letters] == ["\u4e00"]
    assert "left out, as they are of too many points: U+4E01, U+4E02" in notes
    with pytest.raises(FitError, match="all of these letters are damaged or of too many points"):
        read_font(font_of([zigzag(5000, 8000, 8000)]), {})
    many = font_of([zigzag(30, random=Random(k)) for k in range(4)])
    read_font(many, {})
    monkeypatch.setattr("scenelang.inverse.learn._FONT_WORK", 1000)
    with pytest.raises(FitError, match="more than the usual work on its first 1 letter; --letters"):
        read_font(many, {})
    read_font(many, {}, patient=True)


def test_letters_within_letters_and_long_kerning_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenelang.inverse.learn.MOST_CURVES", 30)
    font, notes = read_font(nested(12, 2), {})
    assert "\u4e00" in font.letters
    assert any("of too many points" in note and "U+4E0A" in note for note in notes)
    monkeypatch.setattr("scenelang.inverse.learn._KERNED_S", -1.0)
    assert "kerning of the first 0 letters alone, as it takes long" in read_font(made(True), {})[1]


@pytest.mark.slow
def test_no_hostile_font_takes_long() -> None:
    for name, data in fonts(300, 1):
        seconds, megabytes, status = taken(data)
        assert (seconds < 20, megabytes < 1000, status) == (True, True, 0), (name, seconds, megabytes)


def test_files_of_fonts_are_read_as_a_strangers() -> None:
    font = read_font(made(True), {"license": "OFL"})[0]
    data = element_file_bytes([], font=font)
    assert read_zoo(data).font is not None
    random = np.random.default_rng(2)
    for _ in range(150):
        damaged = np.frombuffer(data, np.uint8).copy()
        damaged[random.integers(0, len(data), 4)] = random.integers(0, 256, 4)
        try:
            read_zoo(damaged.tobytes())
        except TensorError:
            continue
    for table, value in (("font.ends", 10**9), ("font.letters", math.nan), ("font.classes", 99)):
        broken = dict(font.tables)
        broken[table] = broken[table][:]
        broken[table][0] = value
        with pytest.raises(TensorError):
            Font(broken, font.columns, {})


@pytest.mark.parametrize("name", ["text", "width", "u0043"])
def test_names_of_a_font_are_its_own(name: str) -> None:
    font = read_font(made(True), {})[0]
    with pytest.raises(TensorError, match="beside a font"):
        read_zoo(element_file_bytes([element(ball, name, d=2, levels=2)], font=font))


def test_texts_of_drawings_are_set_in_the_font_that_ships() -> None:
    pytest.importorskip("svgelements")
    text = """<svg xmlns="http://www.w3.org/2000/svg"><text x="50" y="20" font-size="10" text-anchor="middle"
        font-family="Arial, sans-serif" transform="translate(5 0)">il</text>
        <text font-family="Times">x</text><text>\u6f22</text></svg>"""
    layers, notes = drawn(text.encode())
    assert notes[1] == "text left out: `times` is not at hand, --font brings it"
    assert notes[2] == "text left out: the font has no `\u6f22` (U+6F22)"
    low, high = layers[0].box()
    font = load_element_file(library.find("std/letters") or "").font
    assert font is not None
    width = 10 * font.line("il")[1]
    assert 55 - width / 2 < low[0] < 55 < high[0] < 55 + width / 2
    assert low[1] == pytest.approx(-20, abs=0.1)  # y up: the baseline
    assert high[1] == pytest.approx(-20 + 7.4, abs=0.4)


def test_texts_of_drawings_are_set_in_a_font_that_is_given(tmp_path: Path) -> None:
    pytest.importorskip("svgelements")
    drawing, font, zoo = tmp_path / "sign.svg", tmp_path / "mine.ttf", tmp_path / "zoo.safetensors"
    drawing.write_text(
        """<svg xmlns="http://www.w3.org/2000/svg"><text x="30" y="20" font-size="10" text-anchor="end"
        font-family="Times">A&#x41;</text><text>\u6f22</text></svg>"""
    )
    said = list[str]()

    def learn(name: str) -> None:
        nsg.learn(drawing, zoo, font=tmp_path / name, steps=1, parts=False, say=said.append)

    font.write_bytes(made(False))
    learn("mine.ttf")
    assert "text left out: the font has no `\u6f22` (U+6F22)" in said[0]
    # two letters that advance by 700 of 1,000 and reach from 100, 0 to 700, 600; kerning is of A and B alone
    assert "sign_centre is [23.5, -17]" in said[1]
    sign = load_element_file(zoo).elements[0]
    assert sign.about["font"] == hashlib.sha256(font.read_bytes()).hexdigest()
    assert float(sign.about["size"]) == pytest.approx(math.hypot(13, 6) / 2, rel=1e-3)
    del said[:]
    learn("mine.ttf")
    assert said == ["sign: made before of this file"]
    (tmp_path / "other.ttf").write_bytes(made(True))
    learn("other.ttf")
    assert "sign: made before of this file" not in said[1:]
    (tmp_path / "none.ttf").write_bytes(b"no font")
    with pytest.raises(FitError, match=r"sign.svg: the font `.*none.ttf`: damaged or not a TrueType"):
        learn("none.ttf")
    with pytest.raises(FitError, match=r"lost.ttf: no such file"):
        learn("lost.ttf")
    with pytest.raises(nsg.RenderError, match="its texts are in a font of their own"):
        nsg.render(nsg.loads(f'import "{zoo.name}" as z; z.sign();', root=tmp_path), backend="reference")
