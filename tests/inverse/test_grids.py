"""Outlines, pictures and meshes as grids: what is read, and the smallest that is near enough."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import ExifTags, Image, ImageCms

from scenelang.assets.picture import texels
from scenelang.assets.pyramid import finest
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.exact.mesh import FitError, Mesh, mesh_of
from scenelang.drawing.exact.outline import (
    NEAR_COLOUR,
    Outline,
    Picture,
    fit_picture,
    read_outline,
    read_picture,
    winding,
)
from scenelang.drawing.exact.outline import drawn as drawn_layers
from scenelang.drawing.neural.assets import GridShape
from scenelang.inverse import grids
from scenelang.inverse.grids import fit, measured, settled
from tests.assets.shapes import element, square, torus

pytest.importorskip("igl")
pytest.importorskip("svgelements")
trimesh = pytest.importorskip("trimesh")

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


def test_pictures(tmp_path: Path) -> None:
    y, x = np.mgrid[0:120, 0:200]
    cover = np.clip(40 - np.hypot(x - 99.5, y - 59.5) + 0.5, 0, 1)[..., None]
    full = np.ones((120, 200, 3))
    for channels in ([full * (1 - cover), full[..., :1]], [full / 2, cover]):  # dark on white, or opaque
        Image.fromarray((255 * np.dstack(channels)).astype(np.uint8), "RGBA").save(tmp_path / "a.png")
        shape = read_outline((tmp_path / "a.png").read_bytes(), ".png")
        assert shape.size == pytest.approx(40, abs=0.1)
        assert abs(shape.distances(POINTS) - disc(POINTS)).max() < 0.01


def test_what_is_no_outline() -> None:
    lines = ['<!ENTITY a0 "M0 0h1v1z ">'] + [f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10)]
    bomb = f"<!DOCTYPE svg [{''.join(lines)}]><svg><path d='&a9;'/></svg>"
    for suffix, data, words in (
        (".svg", b"", "damaged|draws nothing"),
        (".svg", b"<svg", "damaged|draws nothing"),
        (".svg", bomb.encode(), "damaged"),
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


def test_colours_of_drawings() -> None:
    for body, colours in (
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
    ):  # fmt: skip
        found = drawn(body.replace("@", 'width="10" height="10"'))
        assert [colour for colour, _ in found.painted()] == [pytest.approx(c, abs=0.01) for c in colours]


def test_what_of_a_drawing_is_not_read_is_said_with_its_lines() -> None:
    rect = '<rect width="9" height="9" '
    for body, note in (
        (f'{rect} clip-path="url(#c)"/>', "clip paths left out (line 2)"),
        (f'\n{rect} style="filter: url(#f); mask: none"/>', "filters left out (line 3)"),
        (f'<pattern id="p"/>{rect}/>', "patterns left out (line 2)"),
        (f'<path stroke="red" stroke-dasharray="4 2" d="M0 0h9"/>{rect}/>', "dashes drawn solid (line 2)"),
        (f'<style>rect {{\nstroke-linejoin: bevel }}</style>{rect}/>', "joins drawn round (line 2)"),
        (f'\n{rect}/>'.join(["<g>", *['<path stroke-linecap="butt" d="M0 0h9"/>'] * 7, "</g>"]),
         "ends drawn round (lines 3, 4, 5, 6, 7 and 2 more)"),
        (f'{rect} fill="oklch(0.7 0.1 50)"/>', "`oklch(0.7 0.1 50)` drawn black (line 2)"),
        (f'<style>g > rect {{ fill: red }}</style>{rect}/>', "the rule of `g > rect` left out (line 2)"),
        (f'{rect}/>\n<use href="#gone"/>', "a use of `gone`, which is not there, left out (line 3)"),
        ('<rect width="9" height="1em"/><image/>', "the unit of `1em` left out (line 2)"),
    ):  # fmt: skip
        layers, notes = drawn_layers(f'<svg xmlns="http://www.w3.org/2000/svg">\n{body}</svg>'.encode())
        assert layers
        assert note in notes, notes
    for plain in (
        f'{rect} style="stroke:none;stroke-linejoin:miter;stroke-dasharray:none;mix-blend-mode:normal"/>',
        f'{rect} fill="RED" stroke="#1234" color="blue" stroke-linejoin="round"/><clipPath/><mask/>',
        f'<style>.a, #b, rect.c {{ fill: currentColor !important }}</style>{rect} fill="inherit"/>',
        f'{rect} fill="rgb(1, 2, 3)" stroke="hsl(20deg 10% 5%)" stroke-width="3mm"/>',
    ):
        assert drawn_layers(f"<svg>{plain}</svg>".encode())[1][1:] == (), plain


def test_colours_with_spaces_between_their_numbers() -> None:
    for fill, colour in (
        ("rgb(0 128 255 / 50%)", (0.5, 0.75, 1)),
        ("RGB(0%, 50%, 100%)", (0, 0.5, 1)),
        ("rgba(0 128 255 / .5)", (0.5, 0.75, 1)),
        ("hsl(210deg 100% 50%)", (0, 0.5, 1)),
        ("hsla(210, 100%, 50%, 50%)", (0.5, 0.75, 1)),
    ):
        for said in (f'fill="{fill}"', f'style="fill: {fill}"'):
            (layer,), notes = drawn_layers(f'<svg><rect {said} width="9" height="9"/></svg>'.encode())
            assert layer.color == pytest.approx(colour, abs=0.01), fill
            assert len(notes) == 1
    gradient = '<linearGradient id="g"><stop stop-color="rgb(255 0 0)"/></linearGradient>'
    (layer,), _ = drawn_layers(f'<svg>{gradient}<rect fill="url(#g)" width="9" height="9"/></svg>'.encode())
    assert layer.color == (1, 0, 0)


def test_drawings_within_drawings_lie_where_their_views_say() -> None:
    square = '<rect width="10" height="10"/>'
    view, sized = 'viewBox="0 0 10 10"', 'x="5" width="20" height="20"'
    high = f'<svg width="20" height="40" {view}'
    for body, box in (
        (f'<svg x="50" y="50" width="20" height="20" {view}>{square}</svg>', (50, 50, 70, 70)),
        (f'<svg x="50" y="50" width="50%" height="20">{square}</svg>', (50, 50, 60, 60)),
        (f"{high}>{square}</svg>", (0, 10, 20, 30)),
        (f'{high} preserveAspectRatio="xMidYMax">{square}</svg>', (0, 20, 20, 40)),
        (f'{high} preserveAspectRatio="none">{square}</svg>', (0, 0, 20, 40)),
        (f'{high} preserveAspectRatio="xMinYMin slice">{square}</svg>', (0, 0, 40, 40)),
        (f'<svg viewBox="-10 -10 20 20">{square}</svg>', (50, 50, 100, 100)),
        (f'<svg x="10" {view}><svg width="50%" height="50%" {view}>{square}</svg></svg>', (10, 0, 60, 50)),
        (f'<g transform="scale(2)"><svg {sized} {view}>{square}</svg></g>', (10, 0, 50, 40)),
        (f'<symbol id="s" {view}>{square}</symbol><use href="#s" x="10" y="20" width="50" height="50"/>',
         (10, 20, 60, 70)),
    ):  # fmt: skip
        (layer,), _ = drawn_layers(f'<svg viewBox="0 0 100 100">{body}</svg>'.encode())
        (left, low), (right, high) = layer.box()
        assert (left, -high, right, -low) == pytest.approx(box, abs=1e-6), body


RAMP = np.linspace(20, 235, 12 * 8 * 3).reshape(12, 8, 3).astype(np.uint8)


def file(image: Image.Image, kind: str = "PNG", **options: Any) -> bytes:
    out = io.BytesIO()
    image.save(out, kind, **options)
    return out.getvalue()


def turned(orientation: int) -> bytes:
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    return file(Image.fromarray(RAMP), exif=exif)


def clear() -> Image.Image:
    """The ramp, opaque on the left and clear on the right."""
    image = Image.fromarray(RAMP).convert("RGBA")
    image.paste((0, 0, 0, 0), (4, 0, 8, 12))
    return image


OVER = np.where(np.arange(8)[:, None] < 4, RAMP, 255)
GREY = np.linspace(0, 65535, 96).astype(np.uint16).reshape(12, 8)


def test_what_is_read() -> None:
    for data, expected, said in (
        (file(Image.fromarray(RAMP)), RAMP, ()),
        (turned(6), np.rot90(RAMP, -1), ("turned as its EXIF says",)),
        (turned(3), RAMP[::-1, ::-1], ("turned as its EXIF says",)),
        (file(clear()), OVER, ("laid over white",)),
        (file(Image.fromarray(RAMP).convert("RGBA")), RAMP, ()),
        (file(Image.fromarray(GREY)), np.rint(GREY / 257)[..., None].repeat(3, 2), ("16 bits made 8",)),
        (file(Image.fromarray(RAMP[..., 0])), RAMP[..., :1].repeat(3, 2), ()),
        (file(Image.fromarray(RAMP).quantize(256)), RAMP, ()),
        (file(clear().quantize(97)), OVER, ("laid over white",)),
        (file(Image.new("1", (3, 2), 1)), np.full((2, 3, 3), 255), ()),
    ):
        found = read_picture(data)
        assert found.notes[1:] == said
        assert found.colours.dtype == np.uint8
        np.testing.assert_allclose(
            found.colours, expected, atol=12 if "P" in Image.open(io.BytesIO(data)).mode else 0
        )


def test_colours_of_ink_are_light() -> None:
    """Cyan ink is no red; the file is read as other programs do."""
    found = read_picture(file(Image.new("CMYK", (16, 16), (255, 0, 0, 0)), "JPEG", quality=100)).colours
    assert found[8, 8, 0] < 30
    assert found[8, 8, 1:].min() > 150


def test_colour_profiles() -> None:
    """sRGB's own changes nothing, one with red and blue exchanged exchanges them; damage is said."""
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    assert read_picture(file(Image.fromarray(RAMP), icc_profile=srgb)).notes == ("8 × 12 pixels",)
    other = srgb.replace("sRGB".encode("utf-16-be"), "xRGB".encode("utf-16-be"))
    other = other.replace(b"rXYZ", b"?XYZ").replace(b"bXYZ", b"rXYZ").replace(b"?XYZ", b"bXYZ")
    found = read_picture(file(clear(), icc_profile=other))
    assert found.notes[1].startswith("from the colour profile `xRGB")
    assert found.notes[2:] == ("laid over white",)
    assert abs(found.colours.astype(int) - OVER[..., ::-1]).max() <= 3
    damaged = read_picture(file(Image.fromarray(RAMP), icc_profile=srgb[:200]))
    assert damaged.notes[1:] == ("its colour profile cannot be read: taken as sRGB",)
    np.testing.assert_array_equal(damaged.colours, RAMP)


def test_larger_pictures_are_made_smaller() -> None:
    wide = Image.linear_gradient("L").resize((1000, 300))
    found = read_picture(file(wide), side=100)
    assert found.colours.shape == (30, 100, 3)
    assert found.notes == ("1000 × 300 pixels", "made 100 × 30")
    true = np.asarray(wide, float).reshape(30, 10, 100, 10).mean((1, 3))
    assert abs(found.colours[2:-2, 2:-2, 0] - true[2:-2, 2:-2]).max() < 3


def test_what_is_not_read() -> None:
    for data, words in (
        (b"", "neither a PNG nor a JPEG"),
        (b"no picture", "neither a PNG nor a JPEG"),
        (file(Image.fromarray(RAMP))[:-40], "damaged or not a picture"),
        (file(Image.fromarray(RAMP), "GIF"), "neither a PNG nor a JPEG"),
        (file(Image.new("1", (9000, 9000))), "more than 50,000,000 pixels"),
        (file(Image.new("1", (20000, 20000))), "damaged or not a picture: Image size"),
    ):
        with pytest.raises(FitError, match=words):
            read_picture(data)


def photo() -> np.ndarray:
    """Smooth, with noise, as photographs are."""
    y, x = np.mgrid[:64, :64] / 64
    waves = np.stack([np.sin(6 * x + 3 * y), np.cos(5 * y), np.sin(9 * x * y)], -1)
    return np.rint(128 + 80 * waves + np.random.default_rng(1).normal(0, 6, waves.shape)).astype(np.uint8)


def flag() -> np.ndarray:
    return np.kron(np.random.default_rng(2).integers(0, 2, (8, 8, 3)) * 255, np.ones((8, 8, 1))).astype(
        np.uint8
    )


def test_the_smallest_that_is_near_enough() -> None:
    for colours, coding in ((photo(), "av1"), (flag(), "webp")):
        element, tried = fit_picture(Picture(colours), "a")
        off = np.sqrt(((texels(element) * 255.0 - colours) ** 2).mean()) / 255
        assert element.coding == coding
        assert element.about["error"] == pytest.approx(off, abs=1e-6)
        assert off <= NEAR_COLOUR
        enough = [coded.bytes for coded in tried if coded.error <= NEAR_COLOUR]
        assert len(element.data) == min(enough)
        assert element.about["steps"] == len(tried)


def test_steps_give_the_same_bytes_as_the_budget_that_took_them() -> None:
    picture = Picture(photo())
    for given in ({"budget_s": 0.0}, {"steps": 3}):
        element, tried = fit_picture(picture, "a", **given)
        assert element.about["ended"] == "steps"
        again, _ = fit_picture(picture, "a", steps=len(tried))
        assert again == element


@pytest.fixture(scope="module")
def ring() -> Mesh:
    made = trimesh.creation.torus(0.7, 0.3, major_sections=96, minor_sections=48)  # about z
    vertices = np.asarray(made.vertices)[:, [1, 2, 0]]
    return mesh_of(vertices, np.asarray(made.faces, np.int64))


def test_errors_are_those_of_the_shape(ring: Mesh) -> None:
    """A true torus lies as far from the mesh of one as chords lie from arcs."""
    rung = measured(element(torus, levels=5), *ring.surface(5000))
    assert 0.0001 < rung.error < 0.0006
    larger = measured(element(lambda *p: torus(*p) - 0.01, levels=5), *ring.surface(5000))
    assert larger.error == pytest.approx(0.01, abs=0.001)


def test_the_first_that_is_near_enough_is_kept(ring: Mesh) -> None:
    loose, tried = fit(ring, "ring", max_error=2e-3)
    near, more = fit(ring, "ring", max_error=5e-4)
    assert near.about["error"] <= 5e-4 < loose.about["error"] <= 2e-3  # type: ignore[operator]
    assert len(loose.data) < len(near.data) < 6000
    assert [rung.side for rung in more[: len(tried)]] == [rung.side for rung in tried]
    assert more == sorted(more, key=lambda rung: rung.side)


def test_what_would_take_too_long_is_not_begun(ring: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was reached till then is kept; steps that are asked for are tried all the same."""
    monkeypatch.setattr(grids, "LONG_S", 0.0)
    ended = [fit(ring, "ring", max_error=1e-9, **asked) for asked in ({}, {"steps": 2})]
    assert [element.about["ended"] for element, _ in ended] == ["time", "steps"]
    assert len(ended[0][1]) == 1


def test_only_what_is_lost_is_too_thin() -> None:
    """Edges are rounded by less than a cell; fins fall between nodes, or have no inside to ask for."""
    box, ball = trimesh.creation.box((1, 1, 1)), trimesh.creation.icosphere(3, 0.5)
    solids = [(box, False), (ball, False)]
    for thick in (0.001, 0.006):
        fin = trimesh.creation.box((2, thick, 0.4))
        fin.apply_transform(trimesh.transformations.rotation_matrix(0.4, (1, 0, 2)))
        solids.append((trimesh.util.concatenate([ball, fin]), True))
    for solid, lost in solids:
        mesh = mesh_of(np.asarray(solid.vertices, float), np.asarray(solid.faces, np.int64))
        thin = fit(mesh, "x", max_error=1e-9, steps=4)[1][-1].thin
        assert thin > grids.THIN if lost else thin < 0.001


HALF = 0.53  # of a cube's side: no node lies on a face


def cube(*p: np.ndarray) -> np.ndarray:
    q = np.stack(p) - HALF * np.sign(p)
    away = q * np.sign(p)
    return np.linalg.norm(np.maximum(away, 0), axis=0) + np.minimum(away.max(0), 0)


def surface(random: np.random.Generator, count: int, d: int) -> np.ndarray:
    points = random.uniform(-HALF, HALF, (count, d))
    points[np.arange(count), random.integers(d, size=count)] = HALF * random.choice((-1, 1), count)
    return points


def test_a_cube_has_its_edges() -> None:
    axis = np.linspace(-1, 1, 33)
    grid = cube(*np.meshgrid(*[axis] * 3, indexing="ij")).astype(np.float32)
    random = np.random.default_rng(1)
    made = settled(grid, surface(random, 60_000, 3))
    asked = surface(random, 20_000, 3).T.astype(np.float32)

    def off(of: np.ndarray) -> np.ndarray:
        drawn = finest(of)
        return abs(GridShape(NUMPY, drawn.reshape(-1), len(drawn), 3).distance(asked))

    assert off(made).mean() < 0.6 * off(grid).mean()
    assert np.quantile(off(made), 0.99) < 0.6 * np.quantile(off(grid), 0.99)
    far = abs(grid) > 3 * 2 / 32
    np.testing.assert_array_equal(made[far], grid[far])
    assert abs(made - grid).max() < 2 / 32
