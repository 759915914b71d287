"""The plane by the kernel against the network as it is written, every object at every sample."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.program import Program
from scenelang.drawing.closed import field_of
from scenelang.drawing.kernel import load_kernel
from scenelang.drawing.neural import draw as drawing
from scenelang.drawing.neural.draw import draw, program_outputs
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.tables import page_row, tables_of
from scenelang.language.reports import SceneError
from tests.pictures import premultiplied, psnr_db

ROOT = Path(__file__).parents[2]
EXAMPLES = "chart", "deformations", "fern", "hello", "lava", "letters", "tree", "venn", "whirl"
FILES = sorted(ROOT.glob("tests/conformance/cases/*.nsg"))
FILES += [ROOT / "examples" / f"{name}.nsg" for name in EXAMPLES]
RUNNING = 0.04
"""Of a channel: what one look at a pixel's centre misses of a colour that runs across the pixel."""


@lru_cache
def programs() -> dict[str, Program]:
    """Programs of the plane of some examples and all conformance files, on small canvases of odd sizes."""
    found = {}
    for at, path in enumerate(FILES):
        try:
            program = nsg.compile(nsg.load(path).sized((39 + at % 5, 34 + at % 3)))
        except SceneError:
            continue
        if program.stage is None and len(program):
            found[f"{path.parent.name} {path.stem}"] = program
    return found


def field_at(program: Program) -> Field:
    rows = program.vectors, program.tokens, program.brought(), program.paints()
    return Field(field_of(program, False), *rows)  # type: ignore[arg-type]


@pytest.mark.parametrize("part", range(4))
def test_pictures_and_owners_are_the_network_s(part: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(programs()) > 40
    for at, (name, program) in enumerate([*programs().items()][part::4]):
        network = field_of(program, False)
        shown = [
            premultiplied(np.asarray(draw(network, program, **how).image))  # type: ignore[arg-type]
            for how in ({"samples": "four"}, {}, {"skip": False})
        ]
        every, some, exact = shown
        assert psnr_db(every, exact) > 80, name
        assert (abs(every - exact).max(-1) > 1 / 255).sum() <= 1, name
        assert abs(some - exact).max() < RUNNING, name
        if at % 2:
            continue  # half of them tell owners
        owners = program_outputs(network, program).object
        with monkeypatch.context() as patch:
            patch.setattr(drawing, "draws", lambda field: False)
            assert (program_outputs(network, program).object == owners).mean() > 0.98, name


def test_variants_and_strips_give_the_same_bytes() -> None:
    kernel = load_kernel()
    variants = [2, 1] if kernel.variant == 2 else [kernel.variant]
    for name in ("examples hello", "examples letters", "examples whirl", "cases glass", "cases skins"):
        program = programs()[name]
        tables = tables_of(field_at(program))
        page = page_row(program.canvas, program.samples, "adaptive")
        width, height = program.canvas
        found = []
        for variant, cuts in [*((v, [0, height]) for v in variants), (variants[0], [0, 16, height])]:
            kernel_, out = type(kernel).__new__(type(kernel)), np.empty((height, width, 4), np.float32)
            kernel_.__dict__.update(kernel.__dict__, variant=variant)
            for top, bottom in pairwise(cuts):
                kernel_.plane(tables, page, range(top, bottom), out[top:bottom])
            found.append(out)
        assert all(np.array_equal(found[0], other) for other in found[1:]), name


def test_states_at_points() -> None:
    """Those of all objects, also with room around points."""
    program, rng = programs()["examples whirl"], np.random.default_rng(1)
    field = field_at(program)
    p = rng.uniform(-1, 1, (2, 999)).astype(np.float32)
    found, exact = load_kernel().states(tables_of(field), p), field.folded(p)[0][0]
    near = abs(exact) < 0.02
    assert near.sum() > 50
    np.testing.assert_allclose(found[near], exact[near], rtol=0, atol=1e-5)
    wide = load_kernel().states(tables_of(field), p, 3.0)
    np.testing.assert_allclose(wide, exact, rtol=0, atol=1e-4)


def test_sixteen_samples() -> None:
    program = replace(programs()["examples tree"], samples=16)
    network = field_of(program, False)
    found, exact = (np.asarray(draw(network, program, skip=skip).image) for skip in (True, False))  # type: ignore[arg-type]
    assert psnr_db(found, exact) > 60
