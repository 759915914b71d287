"""Letters: distances against a slow loop over curves, pictures against the exact ones, lines, forms."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.element_file import load_element_file
from scenelang.assets.pyramid import curves_of
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import parse_program, program_bytes
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.metrics import psnr
from scenelang.drawing.neural.outlines import LAST, OutlineShapes
from scenelang.language import library
from tests.drawing.slow import distances_of_edges

PATH = library.find("std/letters")
assert PATH is not None
FONT = load_element_file(PATH).font
assert FONT is not None
IMPORT = 'import "std/letters" as abc; '


def slow(name: str, p: np.ndarray) -> np.ndarray:
    """Distances (M,) at points (M, 2) from 200 edges of each curve, and signs by turns about a point."""
    a, b, c = curves_of(FONT.glyphs[name])[:, :, None].swapaxes(0, 1)
    t = np.linspace(0, 1, 201)[:, None]
    curves = (1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c  # (n, 201, 2)
    return distances_of_edges(curves[:, :-1].reshape(-1, 2), curves[:, 1:].reshape(-1, 2), p)


@pytest.mark.parametrize("letter", ["A", "g", "@", "ß", "Ω", "→", ":"])
def test_distances_are_those_of_the_curves(letter: str) -> None:
    name, random = f"u{ord(letter):04x}", np.random.default_rng(ord(letter))
    p = np.concatenate([random.uniform(-1.1, 1.1, (150, 2)), random.normal(0, 8, (30, 2))])
    others = [FONT.glyphs["u0061"], FONT.glyphs[name]]
    shape = OutlineShapes(NUMPY, others, np.zeros(1, np.float32))
    found = shape.distance(p.T.astype(np.float32), np.ones(len(p), np.intp))
    exact = slow(name, p)
    assert abs(found - exact)[np.hypot(*p.T) < LAST].max() < 2e-5  # farther points are asked there
    steps = p[:, None] + random.normal(0, 1e-3, (len(p), 8, 2))
    ends = shape.distance(steps.reshape(-1, 2).T.astype(np.float32), np.ones(8 * len(p), np.intp))
    moved = abs(ends.reshape(-1, 8) - found[:, None])
    assert (moved <= 1.05 * np.hypot(*np.moveaxis(steps - p[:, None], 2, 0)) + 1e-3).all()


@pytest.mark.torch
def test_pictures_are_those_of_the_exact_outlines() -> None:
    scene = nsg.loads(
        f"""{IMPORT} background(#fed);
        abc.text("Twirl", size = 0.6, align = "center") {{ twirl(0.7); translate(0, 0.5); }}
        chain {{ square {{ scale(0.6); translate(0, -0.4); material flat {{ color(#148); }} }}
          subtract abc.text("ga", size = 0.7, align = "right") {{ translate(0.2, -0.4); }}
          smooth abc.text("ï", size = 0.5) {{ translate(0.3, -0.6); material flat {{ color(#c40); }} }} }}"""
    )
    scene = scene.sized((96, 96))
    found, exact = nsg.render(scene), nsg.render(scene, backend="reference")
    assert psnr(found, exact) > 46
    by_torch, all_samples = nsg.render(scene, device="cpu"), nsg.render(scene, samples="four")
    assert abs(np.asarray(by_torch) - all_samples).max() < 1 / 255


def test_lines_are_set_as_the_font_says() -> None:
    text, size = "AV To", 0.5
    placed, width = FONT.line(text)
    advances = sum(FONT.metrics[FONT.letters[letter]].advance for letter in text)
    assert width < advances - 0.1  # A and V, T and o are drawn together
    for align, left in (("left", 0.0), ("center", width / 2), ("right", width)):
        scene = nsg.loads(f'{IMPORT} abc.text("{text}", size = {size}, align = "{align}");')
        children = scene.nodes[0].children
        assert len(children) == 4  # a space shows nothing
        for child, letter in zip(children, placed, strict=True):
            scale, move = child.transforms
            assert scale.x == pytest.approx(size * letter.radius)
            assert (move.x, move.y) == pytest.approx((size * (letter.x - left), size * letter.y))
    wide = nsg.loads(f'{IMPORT} square {{ scale(abc.width("{text}", {size})); }}').nodes[0]
    assert wide.transforms[0].x == pytest.approx(size * width)


def test_a_text_is_its_letters_in_every_form() -> None:
    scene = nsg.loads(
        f'{IMPORT} chain {{ square; subtract abc.text("Ag"); }} abc.text(""); abc.text("x") {{ scale(2); }}'
    )
    assert nsg.loads(scene.to_nsg()) == scene == nsg.Scene.from_json(scene.to_json())
    program = compile_scene(scene)
    assert program.objects == ("square", "abc.u0041", "abc.u0067", "abc.u0078")
    assert parse_program(program_bytes(program)).digest() == program.digest()


def test_letters_grow_and_become_shells() -> None:
    for skin in ("", "grow(0.1);", "shell(0.08);", "grow(-0.03); shell(0.06);"):
        scene = nsg.loads(f"{IMPORT} abc.u0067 {{ {skin} scale(0.7); material flat {{ color(#148); }} }}")
        scene = scene.sized((96, 96))
        found, exact = nsg.render(scene), nsg.render(scene, backend="reference")
        assert psnr(found, exact) > 46
