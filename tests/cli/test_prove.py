"""`scenelang render --prove`: what is told, which files are written, and what is refused."""

from __future__ import annotations

import numpy as np
from PIL import Image

import scenelang as nsg
from scenelang.drawing.image import PROVED
from tests.cli.conftest import Folder
from tests.cli.test_outputs import said

RED = "material flat { color(#d33); }"
STARS = f"star {{ scale(0.8); twirl(0.7); {RED} }} smooth star {{ translate(0.3, 0.2); scale(0.7); }}"
TEXT = f"canvas(90, 60);\nchain {{ {STARS} }}\n"


def test_a_proof_is_told_and_written(folder: Folder) -> None:
    name = folder.write("a.nsg", TEXT)
    _, proof = nsg.prove(nsg.loads(TEXT))
    assert proof.share < 1
    plain = folder.run("render", name, "-o", "p.png")
    assert (plain.exit_code, plain.stderr) == (0, "")
    ran = folder.run("render", name, "-o", "q.png", "--prove")
    left = int((proof.bound > PROVED).sum())
    assert ran.stderr == f"q.png: {proof.told()}\n"
    assert f"{left} are not, by at most {255 * proof.worst:.0f}/255" in ran.stderr
    assert (folder.path / "q.png").read_bytes() == (folder.path / "p.png").read_bytes()
    ran = folder.run("render", name, "-o", "r.png", "--output", "proof", "--output", "alpha")
    assert (ran.exit_code, ran.stderr.count("\n")) == (0, 3)
    assert said("r.proof.png") == {"output": "proof", **proof.facts(), "stored": "65535 bound"}
    stored = np.asarray(Image.open("r.proof.png"), np.float64)
    np.testing.assert_array_equal(stored, np.ceil(65535.0 * proof.bound.astype(np.float64)))


def test_what_is_not_proved_is_drawn_again(folder: Folder) -> None:
    name = folder.write("a.nsg", TEXT)
    ran = folder.run("render", name, "-o", "p.png", "--redraw", "-v")
    assert ran.exit_code == 0
    assert "p.png: 100 % of pixels proved right to 1/255" in ran.stderr
    exact = nsg.render(nsg.loads(TEXT), backend="reference").to_uint8().astype(int)
    assert abs(np.asarray(Image.open("p.png"), int) - exact).max() <= 1
