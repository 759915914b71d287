"""Scenes with numbers out of all proportion: refused where they are written, or drawn in bounded time."""

from __future__ import annotations

import time

import pytest

import scenelang as nsg
from scenelang.drawing.small import draw_small

MIST = """canvas(24, 24);
chain { sphere { material volumetric; } smooth torus { displace(1e6, 14.2); material volumetric; }
    scale(0.12, 0.57, 1); }"""
THIN = """intersect { triangle { bend(1e9); bend(-0.59);
    matrix([[-1e9, 1e9, 0, -0.2], [-0.450325, 0.852922, 0, 0.34], [0, 0, 1, 0], [0, 0, 0, 1]]);
    matrix([[0.528718, -0.40560837304466, 0, -0.4], [0.467313, 0.816853, 0, -0.1], [0, 0, 1, 0],
        [0, 0, 0, 1]]); } triangle { } }"""


def test_a_map_whose_float32_inverse_is_singular_is_refused() -> None:
    codes = [found.code for found in nsg.check_text(THIN) if found.severity == "error"]
    assert codes == ["E0406"]


def test_a_march_has_an_end() -> None:
    """Steps are counted, and no ray goes on in the light of rays that were lost."""
    program = nsg.compile(nsg.loads(MIST))
    start = time.process_time()
    work = draw_small(program, threads=1).work
    assert work is not None
    assert work.lost > 0
    assert time.process_time() - start < 30  # a second on an idle machine
    work = draw_small(
        nsg.compile(nsg.loads("canvas(24, 24); torus { material volumetric; }")), threads=1
    ).work
    assert work is not None
    assert work.lost == 0


def test_the_exact_march_has_an_end() -> None:
    with pytest.raises(nsg.RenderError, match="more than 5,000 steps"):
        nsg.render(nsg.loads(MIST), backend="reference")
