"""Scenes as SVG, held to pictures, to the fold as the language has it, and to closed forms."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image, ImageDraw
from svgelements import SVG, Close, Line, Move
from svgelements import Path as Curve

import scenelang
from scenelang.cli.main import cli
from scenelang.compiler.groups import SMOOTH, SUBTRACT, UNION
from scenelang.output.svg import Operand, layers_of, operands, tokens_of
from tests.compiler.random_scenes import random_scene
from tests.groups import folded, random_tokens

EXAMPLES = Path(__file__).parents[2] / "examples"
FINER = 6  # samples along a side of a pixel


def drawn(text: str) -> np.ndarray:
    """The picture (H, W, 3) of an SVG of opaque paths, each by the parity of its own crossings."""
    svg = SVG.parse(io.StringIO(text))
    size = round(svg.width), round(svg.height)
    picture = np.ones((size[1] * FINER, size[0] * FINER, 3))
    for shape in svg.elements():
        if not hasattr(shape, "fill") or not hasattr(shape, "bbox") or isinstance(shape, SVG):
            continue
        inside = np.zeros(picture.shape[:2], bool)
        for part in Curve(shape).as_subpaths():
            points = []
            for piece in Curve(part):
                if not isinstance(piece, Move):
                    count = 2 if isinstance(piece, Line | Close) else 24
                    points += [piece.point(t) for t in np.linspace(0, 1, count)]
            mask = Image.new("1", picture.shape[1::-1])
            place = [(FINER * p.x - 0.5, FINER * p.y - 0.5) for p in points if p is not None]
            ImageDraw.Draw(mask).polygon(place, fill=1)
            inside ^= np.asarray(mask)
        picture[inside] = [c / 255 for c in (shape.fill.red, shape.fill.green, shape.fill.blue)]
    return picture.reshape(size[1], FINER, size[0], FINER, 3).mean((1, 3))


@pytest.mark.parametrize("name", ["logo", "fox", "gear"])
def test_an_svg_shows_what_the_picture_shows(name: str) -> None:
    scene = scenelang.load(EXAMPLES / f"{name}.nsg")
    text = scenelang.to_svg(scene)
    picture = np.asarray(scenelang.render(scene, samples="four"))
    if picture.shape[2] == 4:
        picture = picture[..., :3] * picture[..., 3:] + 1 - picture[..., 3:]
    off = drawn(text) - picture
    assert -10 * np.log10((off**2).mean()) > 32  # the rasteriser here, and four samples, cost some dB
    if name == "logo":
        assert len(text) < 2000
        assert text.count("<path") == 2


def test_a_square_is_four_lines() -> None:
    text = scenelang.to_svg(scenelang.loads("square { scale(0.7071067811865476); }"))
    (path,) = re.findall(r'd="([^"]*)"', text)
    assert set("Mlz") == {c for c in path if c.isalpha()}
    corners = [piece.end for piece in Curve(path) if not isinstance(piece, Close)]
    assert len(corners) == 4
    for x, y in corners:  # the half side is a half
        assert min(abs(x - 64), abs(x - 192)) < 0.3
        assert min(abs(y - 64), abs(y - 192)) < 0.3


def test_polygons_and_splines_are_as_they_are_written() -> None:
    star = "[for (i in 0..<5) [cos(i * 144deg), sin(i * 144deg)]]"
    text = f"""canvas(400, 400); polygon([[-1, -1], [0, -1], [0, 0.5]]) {{ translate(0.1, 0.2); material flat
        {{ color(#d33); }} }} polygon({star}); spline([[0, 0], [0.6, 0], [0.6, 0.6], [0, 0.6]]) {{
        rotate(90deg); }}
        subtract {{ polygon({star}) {{ scale(0.1); }} spline([[0, 0], [1, 0], [0, 1]]); }}"""
    svg = scenelang.to_svg(scenelang.loads(text))
    triangle, whole, smooth, cut = re.findall(r'<path d="([^"]*)"', svg)
    assert triangle == "M20 360L220 360L220 60z"
    assert smooth.startswith("M200 200C220 180 220 100 200 80C")
    assert whole.count("L") == 4  # whose middle SVG fills too, by the same rule
    assert "L" not in cut


def fold(stream: list[Operand], d: np.ndarray) -> tuple[float, int]:
    """Distance of a fold, and the row whose colour it has, by the rules of the language."""
    distance, shown = 0.0, -1
    for at, operand in enumerate(stream):
        own, row = fold(operand.inner, d) if operand.inner else (float(d[operand.rows[0]]), operand.rows[0])
        operator = operand.operator
        if not at:
            distance, shown = own, row
        elif operator == UNION:
            shown = row if own < max(distance, 0) else shown
            distance = min(distance, own)
        elif operator == SMOOTH:
            h = min(max(0.5 + 0.5 * (distance - own) / 0.15, 0), 1)
            shown = row if h > 0.5 else shown
            distance = distance + h * (own - distance) - 0.15 * h * (1 - h)
        else:
            distance = max(distance, -own if operator == SUBTRACT else own)
    return distance, shown


def test_layers_over_each_other_show_what_the_fold_shows() -> None:
    rng = np.random.default_rng(7)
    for _ in range(150):
        tokens = np.array(random_tokens(rng, int(rng.integers(1, 9))), np.int8)
        stream = operands(tokens)
        layers = layers_of(stream, list(range(len(tokens))))
        for d in rng.normal(0, 0.3, (20, len(tokens))):
            distance, row = fold(stream, d)
            seen = -1
            for layer in layers:
                inside = fold(layer.shape, d)[0] < 0
                for one, other, floor in layer.wins:
                    rest = fold(other, d)[0]
                    inside &= fold(one, d)[0] < (max(rest, 0) if floor else rest)
                seen = layer.row if inside else seen
            assert seen == (row if distance < 0 else -1)


def test_tokens_of_what_was_taken_from_groups_fold_the_same() -> None:
    rng = np.random.default_rng(11)
    for _ in range(150):
        stream = operands(np.array(random_tokens(rng, int(rng.integers(1, 9))), np.int8))
        for layer in layers_of(stream, range(9)):
            for part in (layer.shape, *(one for pair in layer.wins for one in pair[:2])):
                tokens, rows = tokens_of(part), [row for operand in part for row in operand.rows]
                d, c = rng.normal(0, 0.3, (9, 1)), np.zeros((1, 3))
                state = folded(d[rows], [c] * len(rows), tokens, [0.0] * len(rows))
                assert state is not None
                assert state[0][0] == pytest.approx(fold(list(part), d[:, 0])[0])


@pytest.mark.parametrize("seed", [16, 43, 46, 75])
def test_random_trees_show_what_their_pictures_show(seed: int) -> None:
    scene = random_scene(seed, warps=False).model_copy(update={"background": (0.2, 0.3, 0.4)})
    found = scenelang.Diagnostics()
    off = drawn(scenelang.to_svg(scene, diagnostics=found)) - scenelang.render(scene, samples="four")[..., :3]
    assert -10 * np.log10((off**2).mean()) > 30
    far = (abs(off) > 0.3).any(2)  # at outlines, and nowhere over nine pixels
    whole = np.lib.stride_tricks.sliding_window_view(far, (3, 3)).all((2, 3))
    assert not whole.any() or "W0550" in {d.code for d in found}


def test_holes_and_colours_and_what_lies_behind() -> None:
    scene = scenelang.loads(
        "canvas(64, 48); background(none); chain { square { material flat { color(#d33); } }"
        " subtract square { scale(0.5); } union star { scale(0.3); material bricks; } }"
    )
    text = scenelang.to_svg(scene)
    assert "<rect" not in text
    assert 'fill="#dd3333"' in text
    assert re.search(r'<pattern id="p1".*data:image/png;base64', text)
    assert 'fill="url(#p1)"' in text
    assert scenelang.to_svg(scenelang.loads("")).count("<path") == 0
    ramp = scenelang.loads("square { material linear { stop(0, #f00); stop(1, #00f); opacity(0.5); } }")
    text = scenelang.to_svg(ramp)
    assert '<linearGradient id="p1"' in text
    assert 'gradientTransform="matrix(128 0 0 -128 128 128)"' in text
    assert 'fill="url(#p1)" fill-opacity="0.5"' in text


def test_options_of_pictures_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text("star { scale(0.5); }")
    out = tmp_path / "a.svg"
    for options in ("--samples four", "--prove", "--jobs 2", "--resolution 64", "--backend reference"):
        call = ["render", str(tmp_path / "a.nsg"), "-o", str(out), *options.split()]
        result = CliRunner().invoke(cli, call)
        assert result.exit_code == 2
        assert options.split()[0] in result.output
        assert re.search(r"(is of|draws) (pictures|meshes)", result.output)
        assert not out.exists()


def test_the_command_writes_one_frame(tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text("animate(seconds = 1, fps = 4); star { scale(0.5); rotate(1turn * u); }")
    call = ["render", str(tmp_path / "a.nsg"), "-o", str(tmp_path / "a.svg")]
    refused = CliRunner().invoke(cli, call)
    assert (refused.exit_code, "E0550" in refused.output) == (1, True)
    assert CliRunner().invoke(cli, [*call, "--frame", "2", "--size", "100x50"]).exit_code == 0
    assert 'width="100" height="50" viewBox="0 0 256 128"' in (tmp_path / "a.svg").read_text()
