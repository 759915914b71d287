"""Outlines of drawings and pictures, against formulas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("svgelements")
pytest.importorskip("scipy")

from scenelang.drawing.exact.mesh import FitError
from scenelang.drawing.exact.outline import Outline, read_outline, winding
from scenelang.inverse.grids import fit
from tests.assets.shapes import square

POINTS = np.random.default_rng(0).uniform(-1, 1, (2000, 2))


def drawn(body: str) -> Outline:
    text = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{body}</svg>'
    return read_outline(text.encode(), ".svg")


def disc(p: np.ndarray, radius: float = 1.0) -> np.ndarray:
    return np.linalg.norm(p, axis=1) - radius


def tile(p: np.ndarray) -> np.ndarray:
    return square(*p.T)


def frame(p: np.ndarray) -> np.ndarray:
    return np.maximum(tile(p), -tile(2 * p) / 2)


def test_drawings() -> None:
    for body, formula in (
        ('<circle cx="30" cy="40" r="20"/>', disc),
        ('<path d="M10 40 A 20 20 0 0 0 50 40 A 20 20 0 0 0 10 40"/>', disc),
        ('<g transform="translate(9 9) scale(3)"><rect width="10" height="10"/></g>', tile),
        ('<path d="M0 0h10v10h-10z M0 0h10v10h-10z"/>', tile),  # twice the same way round
        ('<circle r="15" fill="none" stroke="red" stroke-width="10"/>', lambda p: abs(disc(p, 0.75)) - 0.25),
        ('<path fill-rule="evenodd" d="M0 0h8v8h-8z M2 2h4v4h-4z"/>', frame),
        ('<path d="M0 0h8v8h-8z M2 2h4v4h-4z"/>', tile),
        ('<path d="M0 0h8v8h-8z M2 2v4h4v-4z"/>', frame),
    ):
        shape = drawn(body)
        true, found = formula(POINTS), shape.distances(POINTS)
        outside = true > 0  # inside of an unfilled corner a formula of maxima says less than the distance
        assert abs(found - true)[outside].max() < 0.003
        assert ((found < 0) == (true < 0))[abs(true) > 0.003].all()


def test_up_is_up_and_layers_are_a_union() -> None:
    shape = drawn('<rect width="10" height="2"/><rect x="4" width="2" height="10" fill="#0f0"/>')
    stem, bar = shape.distances(np.array([[0, -0.5], [0.5, 0.6]])), shape.distances(np.array([[0.5, -0.5]]))
    assert (stem < 0).all()
    assert bar > 0
    assert shape.distances(np.array([[0, 0.6]])) < -0.05  # where both lie there is no edge between


def test_only_lines_that_are_lost_are_too_thin() -> None:
    """A disc and a square that are drawn as near as is asked were said to be."""
    for body, lost in (
        ('<circle cx="1.5" cy="1.5" r="1.2"/>', False),
        ('<rect width="80" height="80" transform="rotate(17)"/>', False),
        ('<path d="M5 5 L95 61" stroke="#000" stroke-width="0.05"/><circle cx="50" cy="50" r="5"/>', True),
    ):
        thin = fit(drawn(body), "x", steps=8)[1][-1].thin
        assert thin > 0.3 if lost else thin == 0


def test_inside_agrees_with_a_loop() -> None:
    """Also at the heights of corners, where an edge counts at one of its ends."""
    for odd in (False, True):
        random = np.random.default_rng(0)
        corners = random.integers(0, 12, (40, 2)).astype(float)
        edges = np.stack([corners, np.roll(corners, -1, 0)], 1)
        points = np.concatenate([random.uniform(-1, 13, (300, 2)), random.integers(0, 12, (100, 2))])
        counts = []
        for x, y in points:
            turns = 0
            for (ax, ay), (bx, by) in edges:
                if (ay <= y) != (by <= y):
                    left = (bx - ax) * (y - ay) - (x - ax) * (by - ay) > 0
                    turns += (1 if left else 0) if by > ay else (0 if left else -1)
            counts.append(turns)
        found = winding(edges, odd)(points)
        assert found.tolist() == [turns % 2 != 0 if odd else turns != 0 for turns in counts]


@pytest.mark.parametrize("opaque", [False, True])
def test_pictures(opaque: bool, tmp_path: Path) -> None:
    y, x = np.mgrid[0:120, 0:200]
    cover = np.clip(40 - np.hypot(x - 99.5, y - 59.5) + 0.5, 0, 1)
    pixels = np.zeros((120, 200, 4))
    pixels[..., :3] = (1 - cover)[..., None] if not opaque else 0.5
    pixels[..., 3] = cover if opaque else 1
    Image.fromarray((255 * pixels).astype(np.uint8), "RGBA").save(tmp_path / "a.png")
    shape = read_outline((tmp_path / "a.png").read_bytes(), ".png")
    assert shape.size == pytest.approx(40, abs=0.1)
    assert abs(shape.distances(POINTS) - disc(POINTS)).max() < 0.01


def test_what_is_no_outline() -> None:
    for suffix, data, words in (
        (".svg", b"", "damaged|draws nothing"),
        (".svg", b"<svg", "damaged|draws nothing"),
        (".svg", b'<svg><rect width="1" height="1" fill="none"/></svg>', "draws nothing"),
        (".svg", b'<svg><path d="M1 1z"/></svg>', "draws nothing|one point|covers nothing"),
        (".svg", b'<svg><path d="M0 0h5"/></svg>', "covers nothing"),
        (".svg", b'<svg><path d="M0 0h1e999v5z"/></svg>', "finite|damaged"),
        (
            ".svg",
            b'<svg><path d="M0 0h9" fill="none" stroke="red" stroke-width="1e-9"/></svg>',
            "nowhere thicker",
        ),
        (".png", b"no picture", "neither a PNG nor a JPEG"),
    ):
        with pytest.raises(FitError, match=words):
            read_outline(data, suffix).surface(100)


def test_an_entity_bomb_ends() -> None:
    lines = ['<!ENTITY a0 "M0 0h1v1z ">'] + [f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10)]
    bomb = f"<!DOCTYPE svg [{''.join(lines)}]><svg><path d='&a9;'/></svg>"
    with pytest.raises(FitError, match="damaged"):
        read_outline(bomb.encode(), ".svg")


@pytest.mark.parametrize(
    ("body", "colours"),
    [
        ('<style>.a { fill: #0a0 } #b { fill: blue }</style><rect class="a" @/><circle id="b" r="9"/>',
         [(0, 2 / 3, 0), (0, 0, 1)]),
        ('<g fill="red"><rect @/></g><use href="#a"/><defs><rect id="a" fill="#00f" @/></defs>',
         [(1, 0, 0), (0, 0, 1)]),
        ('<rect fill="red" fill-opacity=".5" @/>', [(1, 0.5, 0.5)]),
        ('<g opacity="0.5"><g style="opacity: 50%"><rect @/></g></g>', [(0.75, 0.75, 0.75)]),
        ('<rect opacity="0" @/><rect fill="red" @/>', [(1, 0, 0)]),
        ('<rect visibility="hidden" @/><rect fill="red" @/>', [(1, 0, 0)]),
        ('<mask id="m"><rect @/></mask><marker><rect @/></marker><rect fill="red" mask="url(#m)" @/>',
         [(1, 0, 0)]),
        ('<symbol id="s"><rect fill="red" @/></symbol><use href="#s"/>', [(1, 0, 0)]),
        ('<rect fill="#123" stroke="red" stroke-width="2" @/>', [(1 / 15, 2 / 15, 0.2), (1, 0, 0)]),
        ('<linearGradient id="g"><stop offset="0" stop-color="#f00"/><stop offset="1" '
         'style="stop-color: #00f"/></linearGradient><rect fill="url(#g) red" @/>', [(0.5, 0, 0.5)]),
        ('<linearGradient id="g"><stop offset="50%" stop-color="#f00"/><stop offset="50%" stop-color="#00f"'
         ' stop-opacity="0"/></linearGradient><radialGradient id="h" href="#g"/>'
         '<style>rect { fill: url(#h); stroke: none }</style><rect @/>', [(1, 0.5, 0.5)]),
        ('<rect fill="red" @/><rect x="40" fill="red" width="9" height="9"/>', [(1, 0, 0)]),
        ('<rect fill="red" @/><rect fill="blue" x="40" width="9" height="9"/><rect fill="red" x="80" @/>',
         [(1, 0, 0), (0, 0, 1)]),
        ('<rect fill="red" @/><rect fill="blue" x="5" width="9" height="9"/><rect fill="red" x="9" @/>',
         [(1, 0, 0), (0, 0, 1), (1, 0, 0)]),
    ],
)  # fmt: skip
def test_colours_of_drawings(body: str, colours: list[tuple[float, float, float]]) -> None:
    body = body.replace("@", 'width="10" height="10"')
    found = read_outline(f'<svg xmlns="http://www.w3.org/2000/svg">{body}</svg>'.encode(), ".svg")
    assert [colour for colour, _ in found.painted()] == [pytest.approx(c, abs=0.01) for c in colours]


def test_what_of_a_drawing_is_lost_is_said() -> None:
    body = '<text>a</text><clipPath id="c"><rect/></clipPath><pattern id="p"/><rect width="9" height="9"/>'
    found = read_outline(f"<svg>{body}<filter/></svg>".encode(), ".svg")
    assert [f"{what} left out" in found.notes for what in ("text", "clip paths", "patterns", "filters")] == [
        True
    ] * 4
