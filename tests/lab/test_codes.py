"""Forms and codes of textures and meshes: what so many numbers hold, and that scenes are drawn with it."""

from __future__ import annotations

import json
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from lab.codes import decoder
from lab.codes.decoder import decoded
from lab.codes.forms import Array, balls, best_form, cosines, nodes, off
from lab.codes.study import drawn, random_pictures
from lab.codes.world import ERRORS, World, world
from scenelang.cli.main import cli
from scenelang.elements.pyramid import unpacked
from scenelang.measure.metrics import psnr
from scenelang.models.load import load_model


def waves(*terms: tuple[int, int]) -> Array:
    """A grey picture (16, 16, 3) of a mean and a cosine for each term."""
    at = (np.arange(16) + 0.5) / 16
    grey = sum(np.outer(np.cos(np.pi * a * at), np.cos(np.pi * b * at)) for a, b in terms) / 8 + 0.5
    return np.repeat(np.asarray(grey, np.float32)[..., None], 3, 2)


def test_a_cosine_takes_two_numbers() -> None:
    """A mean and two waves are three cosines; with five numbers the least of them is lost."""
    true = waves((3, 0), (2, 5))
    assert off(cosines(true, 6), true) < 1e-6
    assert off(cosines(true, 5), true) == pytest.approx(1 / 16, rel=0.01)  # a product of cosines is less


def test_nodes_hold_what_is_linear_between_them() -> None:
    """Eight numbers are the corners of a cube; of twelve numbers of a picture four colours."""
    axis = np.linspace(-1, 1, 9, dtype=np.float32)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    true = x * y * z + 0.3 * x
    assert abs(nodes(true, 26) - true).max() < 1e-5  # as 8: 27 are the next cube
    colours = np.stack([x[..., 0] * y[..., 0], x[..., 0], y[..., 0]], 2)
    assert abs(nodes(colours, 12) - colours).max() < 1e-5
    assert np.ptp(nodes(colours, 11), axis=2).max() == 0  # greys


def ball(radius: float, centre: tuple[float, float, float] = (0, 0, 0), n: int = 25) -> Array:
    """Distances (n, n, n) of a ball."""
    at = np.stack(np.meshgrid(*[np.linspace(-1, 1, n)] * 3, indexing="ij"), -1)
    return np.asarray(np.linalg.norm(at - centre, axis=-1) - radius, np.float32)


@pytest.mark.parametrize(("d", "true"), [(1, ball(0.6)), (4, ball(0.4, (0.2, -0.1, 0.3)))])
def test_a_ball_is_one_number_or_four(d: int, true: Array) -> None:
    assert off(balls(true, d), true) < 0.004
    assert best_form(true, d)[0] == "balls"


def test_a_shared_decoder_tells_its_things_apart_by_one_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three flat pictures, 200 steps: what is learned is nearer to each than their mean is."""
    clock = count(step=0.01)
    monkeypatch.setattr(decoder, "time", SimpleNamespace(process_time=lambda: next(clock)))
    true = np.stack([np.full((8, 8, 3), grey, np.float32) for grey in (0.1, 0.5, 0.9)])
    found, said = decoded(true, 1, 1, 2.0, pitch=1.0)
    assert [off(a, b) < 0.1 for a, b in zip(found, true, strict=True)] == [True] * 3
    assert 190 < said["steps"] <= 200


def test_distances_are_drawn_as_they_are() -> None:
    """A grid given as an element is off by at most half a step of its pyramid: a 16th of it."""
    true = ball(0.7, n=49)
    drawn = unpacked(World("meshes", load_model("solids3d"), {}, {}, {}).element("ball", true))[::2, ::2, ::2]
    assert abs(drawn - true)[abs(true) < 0.1].max() < 0.1 / 16 / 2


@pytest.mark.slow
def test_what_ships_is_drawn_exactly_and_one_number_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole command; what was trained and measured is not done again."""
    monkeypatch.setitem(ERRORS, "textures", ())
    line = ["lab", "codes", "textures", "--scenes", "2", "--side", "32", "--sizes", "1", "--seconds", "0.5"]
    line += ["-o", str(tmp_path)]
    for _ in range(2):
        ran = CliRunner().invoke(cli, line)
        assert ran.exit_code == 0, ran.output
    found = json.loads((tmp_path / "codes-textures.json").read_text("utf-8"))
    psnr = {row["kind"]: row["psnr"]["mean"] for row in found["rows"]}
    assert psnr["elements"] > 45 > psnr["forms"] > 10
    assert {row["seed"] for row in found["rows"] if row["kind"] == "codes"} == {1, 2}
    with Image.open(tmp_path / "codes-textures.png") as strip:
        assert strip.width > strip.height / 6


def test_scenes_are_drawn_with_what_stands_in_for_their_textures() -> None:
    found = world("textures", Path("unused"))
    ((program, exact),) = random_pictures(found, 1, 5, 48, None)
    greys = {name: found.element(name, np.full((2, 2, 3), 0.5, np.float32)) for name in found.true}
    assert psnr(drawn(program, found, found.shipped), exact) > 40
    assert np.isin(np.rint(255 * drawn(program, found, greys)).min(), (127, 128))
