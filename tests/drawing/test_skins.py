"""Leaves that grow and shells: against formulas, other scenes that show the same, and one way of another."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.program import ProgramError, parse_program, program_bytes
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural.assets import GrownShape
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.files import load_arrays
from tests.pictures import psnr_db

LOOK = "material flat { color(#222); }"
Array = np.ndarray


def drawn(text: str, **how: str) -> Array:
    return np.asarray(nsg.render(nsg.loads(f"nsg 1; {text}"), **how))  # type: ignore[arg-type]


def covered(inside: object, side: int = 96) -> Array:
    """The picture of a dark shape, by whether points (2, M) are inside: four samples a pixel."""
    x = (np.arange(2 * side) + 0.5) / side - 1
    p = np.stack(np.meshgrid(x, -x))
    share = inside(p).reshape(side, 2, side, 2).mean((1, 3))  # type: ignore[operator]
    return 1 - share[..., None] * (1 - np.full(3, 0x22 / 255))


def box(p: Array, half: float) -> Array:
    """The distance of a square, by formula."""
    q = abs(p) - half
    return np.hypot(*q.clip(0)) + q.max(0).clip(None, 0)


R, S = 0.5, np.sqrt(0.5)
FLAT = {
    f"square {{ grow(0.6); scale({R}); {LOOK} }}": lambda p: box(p / R, S) < 0.6,
    f"square {{ grow(-0.3); scale({R}); {LOOK} }}": lambda p: box(p / R, S) < -0.3,
    f"square {{ shell(0.3); scale({R}); {LOOK} }}": lambda p: abs(box(p / R, S)) < 0.15,
    f"square {{ grow(0.2); shell(0.3); scale({R}); {LOOK} }}": lambda p: abs(box(p / R, S) - 0.2) < 0.15,
    f"square {{ shell(0.3); grow(0.2); scale({R}); {LOOK} }}": lambda p: abs(box(p / R, S)) < 0.35,
    f"square {{ shell(0.5); grow(-0.1); scale({R}); {LOOK} }}": lambda p: abs(box(p / R, S)) < 0.15,
}


@pytest.mark.parametrize("text", FLAT)
def test_squares_are_those_of_a_formula(text: str) -> None:
    text = f"canvas(96, 96); {text}"
    assert psnr_db(drawn(text, backend="reference"), covered(FLAT[text.partition("; ")[2]])) > 60
    assert psnr_db(drawn(text), covered(FLAT[text.partition("; ")[2]])) > 42
    assert psnr_db(drawn(text, backend="exact"), covered(FLAT[text.partition("; ")[2]])) > 60


HOLLOW = "subtract { sphere { scale(0.66); } sphere { scale(0.54); } }"
CUT = "subtract sphere { scale(0.5); translate(0.1, 0.4, 0.4); }"
SAME = {
    "a ball": ("sphere { grow(0.5); scale(0.4); }", "sphere { scale(0.6); }"),
    "a small ball": ("sphere { grow(-0.3); }", "sphere { scale(0.7); }"),
    "a bowl": (f"chain {{ sphere {{ shell(0.2); scale(0.6); }} {CUT} }}", f"chain {{ {HOLLOW} {CUT} }}"),
    "mist": (
        "sphere { shell(0.2); scale(0.6); material volumetric; }",
        HOLLOW.replace("sphere { scale(0.66); }", "sphere { scale(0.66); material volumetric; }"),
    ),
    "light inside": (
        f"light(position = [0.1, 0, 0]); chain {{ sphere {{ shell(0.2); scale(0.6); }} {CUT} }}",
        f"light(position = [0.1, 0, 0]); chain {{ {HOLLOW} {CUT} }}",
    ),
}


@pytest.mark.parametrize("name", SAME)
def test_bodies_are_those_of_other_scenes(name: str) -> None:
    one, other = (f"canvas(40, 40); camera(eye = [0, 1, 4]); {text}" for text in SAME[name])
    assert psnr_db(drawn(one, backend="exact"), drawn(other, backend="exact")) > 50
    assert psnr_db(drawn(one), drawn(other, backend="exact")) > 36


def test_a_camera_in_a_hollow_sees() -> None:
    text = "nsg 1; camera(eye = [0, 0, 0.2], target = [0, 0, -1]); sphere { shell(0.2); scale(2); }"
    assert not [*nsg.check_text(text)]
    found = nsg.check_text(text.replace("0, 0, 0.2", "0, 0, 1.95"))
    assert [problem.code for problem in found] == ["E0408"]


def test_a_shell_hides_nothing_in_its_middle() -> None:
    """Nor does a leaf that has shrunk what is around it."""
    for skin in ("shell(0.2);", "grow(-0.3);"):
        text = f"nsg 1; square {{ scale(0.5); {LOOK} }} square {{ {skin} }}"
        assert len(nsg.compile(nsg.loads(text))) == 2
    assert len(nsg.compile(nsg.loads(f"nsg 1; square {{ {LOOK} }} square {{ grow(0.5); }}"))) == 1


def test_a_program_keeps_skins_and_their_order() -> None:
    texts = ["grow(0.3); shell(0.2);", "shell(0.2); grow(0.3);", "shell(0.2);", "grow(0.3);"]
    numbers = []
    for text in texts:
        program = nsg.compile(nsg.loads(f"nsg 1; star {{ {text} scale(0.5); }}"))
        again = parse_program(data := program_bytes(program))
        assert b'\\"format\\":5' in data
        assert again.digest() == program.digest()
        colour = program.vectors[0, 40:52]
        numbers.append(colour[[1, 2, 4]].tolist())
    wanted = [[0.3, 0.2, 0], [0.3, 0.2, 1], [0, 0.2, 0], [0.3, 0, 0]]
    assert numbers == np.array(wanted, np.float32).tolist()
    plain = program_bytes(nsg.compile(nsg.loads("nsg 1; star { scale(0.5); }")))
    assert b'\\"format\\":1' in plain
    solid = nsg.compile(nsg.loads("nsg 1; sphere { shell(0.2); displace(0.1, 4); grow(0.3); }"))
    places = load_arrays("solids3d").network.layout.places
    assert solid.vectors[0, [places.grow, places.shell, places.order]].tolist() == pytest.approx(
        [0.3, 0.2, 3]
    )


@pytest.mark.parametrize(("place", "value"), [("grow", 1.5), ("grow", -1.0), ("shell", -0.1), ("order", 4.0)])
def test_damaged_skins_are_refused(place: str, value: float) -> None:
    network = load_arrays("shapes2d").network
    program = nsg.compile(nsg.loads("nsg 1; star { grow(0.1); }"))
    vectors = program.vectors.copy()
    vectors[0, getattr(network.layout.places, place)] = value
    with pytest.raises(ProgramError, match="beyond"):
        Field(network, vectors, program.tokens)  # type: ignore[arg-type]


@pytest.mark.parametrize("d", [2, 3])
def test_grids_of_what_grows_go_on_outside_of_their_cube(d: int) -> None:
    axis = np.linspace(-1, 1, 129 if d == 2 else 49)
    nodes = np.stack(np.meshgrid(*[axis] * d, indexing="ij")).reshape(d, -1)
    ball = GrownShape(NUMPY, (np.linalg.norm(nodes, axis=0) - 0.95).astype(np.float32), len(axis), d)
    q = np.random.default_rng(1).uniform(-2, 2, (d, 3000)).astype(np.float32)
    length = np.linalg.norm(q, axis=0)
    found = ball.field(q, gradient=True)
    assert abs(found[0] - (length - 0.95))[length > 0.3].max() < 1e-2
    outside = abs(q).max(0) > 1
    assert (found[1:] * q / length).sum(0)[outside].min() > 0.998
