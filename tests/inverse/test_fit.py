"""Params from pictures, against scenes whose values are known."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image as pillow
from PIL import ImageDraw, ImageFilter

import scenelang
from scenelang.cli.main import cli
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import psnr
from scenelang.inverse import search
from scenelang.inverse.fit import Fit
from scenelang.language.diagnostics import SourceFile

SCENE = """\
// where is it?
nsg 1; canvas(40, 40); background(#ffffff);
param x = -0.5 in -0.8..0.8; param y = 0.5 in -0.8..0.8;  // here
star { scale(0.4); translate(x, y); material flat { color(#d33333); } }
"""


@pytest.fixture(autouse=True)
def _fewer_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is looked for here is found sooner."""
    monkeypatch.setattr(search, "LOOKS", 16)
    monkeypatch.setattr(search, "ROUNDS", 2)


def drawn(text: str, **values: object) -> Image:
    """By the exact definition, not by what fits."""
    return scenelang.render(scenelang.loads(text, params=values), backend="reference")


def fitted(text: str, picture: Image, **options: object) -> Fit:
    return scenelang.fit(SourceFile("a.nsg", text), picture, **options)  # type: ignore[arg-type]


def near(found: Fit, name: str, value: float, share: float = 0.01) -> bool:
    number = next(number for number in found.numbers if number.label == name)
    return abs(number.value - value) <= share * (number.high - number.low)


def test_outlines_that_do_not_meet_are_found_and_the_scene_is_written() -> None:
    """And the way leads from the start to what was found."""
    target = drawn(SCENE, x=0.3, y=-0.4)
    found = fitted(SCENE, target)
    assert found.done
    assert near(found, "x", 0.3)
    assert near(found, "y", -0.4)
    assert found.psnr > 35 > 20 > found.start_psnr
    again = scenelang.render(scenelang.loads(found.text))
    assert psnr(again, target, 100.0) == pytest.approx(found.psnr, abs=0.1)
    assert found.text.startswith("// where is it?\nnsg 1; canvas(40, 40);")
    first, *between, last = [scenelang.render(scene) for scene in found.way]
    assert between
    assert np.array_equal(first, scenelang.render(scenelang.loads(SCENE)))
    assert psnr(last, target, 100.0) == pytest.approx(found.psnr, abs=0.2)


def test_choices_are_found_with_numbers() -> None:
    text = SCENE.replace("// here", "param n = 1 in 1..4 step 1; param dark = true;") + (
        "for (i in 0..<n) { square { scale(0.1); translate(-0.6 + 0.4 * i, -0.7); "
        "material flat { color(dark ? #111111 : #99bb99); } } }"
    )
    found = fitted(text, drawn(text, x=0.3, y=0.5, n=3, dark=False), params=["x", "n", "dark"])
    assert found.values["n"] == "3"
    assert found.values["dark"] == "false"
    assert near(found, "x", 0.3)


def test_mask_crop_size_and_background() -> None:
    picture = np.asarray(drawn(SCENE.replace("#ffffff", "none"), x=0.3, y=-0.4)).repeat(2, 0).repeat(2, 1)
    large = np.zeros((110, 130, 4), np.float32)
    large[10:90, 20:100] = picture
    large[10:30, 20:60] = (0.0, 1.0, 0.0, 1.0)  # a blot
    mask = np.ones((110, 130, 3))
    mask[10:30, 20:60] = 0
    found = fitted(
        SCENE.replace("#ffffff", "none"),
        large.view(Image),
        mask=mask,
        crop=(20, 10, 80, 80),
        background=(0.2, 0.2, 0.2),
    )
    assert near(found, "x", 0.3)
    assert near(found, "y", -0.4)
    assert found.target[35, 2] == pytest.approx([0.2, 0.2, 0.2], abs=0.01)


def test_what_explains_the_same_is_said_and_what_is_not_seen() -> None:
    """x and z only show as their sum, and w hides behind the canvas."""
    text = (
        SCENE.replace("translate(x, y)", "translate((x + z) / 2, y)").replace(
            "// here", "param z = 0.1 in -0.8..0.8; param w = 0.5 in 0..1;"
        )
        + "square { scale(0.1); translate(5 + w, 5); }"
    )
    found = fitted(text, drawn(text, x=0.3, z=0.2, y=-0.4))
    assert [pair[:2] for pair in found.tied] == [("x", "z")]
    assert found.tied[0][2] == pytest.approx(-1.0, abs=0.02)
    assert any("does not show `w`" in note for note in found.notes)


def test_sensitivity_is_that_of_a_closed_form() -> None:
    """A grey that fills the canvas changes all of it: 1/255 of it is 1/255 of its range."""
    text = "canvas(32, 32); param v = 0.2 in 0..1; square { scale(9); material flat { color([v, v, v]); } }"
    found = fitted(text, drawn(text, v=0.6))
    assert found.numbers[0].felt == pytest.approx(1 / 255, rel=0.02)
    assert near(found, "v", 0.6, 0.002)


def test_two_places_that_look_the_same_are_both_told() -> None:
    text = (
        "canvas(32, 32); param v = 0.1 in -0.8..0.8; square { scale(0.2); translate(v * v, 0); "
        "material flat { color(#203040); } }"
    )
    found = fitted(text, drawn(text, v=0.7))
    values = [float(found.values["v"]), *(float(other["v"]) for other in found.others)]
    assert sorted(values) == pytest.approx([-0.7, 0.7], abs=0.02)


def test_a_solid_and_its_light() -> None:
    text = (
        "canvas(32, 32); param x = -1 in -1..1; param power = 12 in 10..50; light(power = power);"
        "sphere { scale(0.6); translate(x, 0, 0); }"
    )
    found = fitted(text, drawn(text, x=0.4, power=35))
    assert near(found, "x", 0.4)
    assert near(found, "power", 35.0, 0.03)


SWING = """\
canvas(32, 32); background(#ffffff); animate(seconds = 1s, fps = 12);
param wide = 20deg in 10deg..80deg; param lag = 0 in -0.2..0.2;
let swing = wide * sin((u + lag) * 1turn);
star { scale(0.4); translate(0, -0.5); rotate(swing); material flat { color(#d33333); } }
"""


def frames_of(text: str, *frames: int, **values: object) -> dict[int, Image]:
    return {
        frame: scenelang.render(scenelang.loads(text, params=values, frame=frame), backend="reference")
        for frame in frames
    }


def test_two_frames_tell_what_one_does_not() -> None:
    """How far a pendulum swings and where it is in its swing: one picture shows only both."""
    targets = frames_of(SWING, 0, 3, wide="60deg", lag=0.1)
    one, two = fitted(SWING, targets[3], frame=3), fitted(SWING, targets)
    assert one.tied or one.others
    assert not two.tied
    assert not two.others
    assert near(two, "wide", np.radians(60.0), 0.02)
    assert near(two, "lag", 0.1, 0.02)
    assert two.target.shape == (64, 32, 3)
    assert np.abs(two.target[32:] - targets[3]).max() < 1e-6


def test_the_frame_and_place_that_do_not_fit_are_named() -> None:
    targets = frames_of(SWING, 0, 3, wide="60deg", lag=0.1)
    targets[3] = targets[3].copy()
    targets[3][1:9, 1:9] = (0.0, 0.0, 1.0)
    note = next(note for note in fitted(SWING, targets).notes if "differs from the target most" in note)
    place = re.search(r"at pixel (\d+), (\d+) of 32 × 32 of frame 3", note)
    assert place is not None
    assert all(1 <= int(at) < 9 for at in place.groups())


def test_what_does_not_fit_is_refused() -> None:
    picture = drawn(SCENE)
    for options, fact in (
        ({"crop": (30, 0, 40, 40)}, "leaves the target"),
        ({"crop": (0, 0, 40, 20)}, "40 × 20 pixels for a canvas of 40 × 40"),
        ({"mask": np.zeros((40, 40, 3))}, "no pixel counts"),
        ({"mask": np.zeros((6, 40, 3))}, "40 × 6 pixels for a target"),
        ({"start": {"x": 0.1}, "params": ["y"]}, "a start for `x`"),
    ):
        with pytest.raises(scenelang.FitError, match=fact):
            fitted(SCENE, picture, **options)


def test_the_command_writes_scene_and_pictures(tmp_path: Path) -> None:
    scene, target, out = (tmp_path / name for name in ("a.nsg", "target.png", "b.nsg"))
    scene.write_text(SCENE)
    drawn(SCENE, x=0.3, y=0.5).save(target)
    arguments = ["fit", str(scene), "--to", str(target), "-o", str(out), "-D", "y=0.5"]
    run = CliRunner().invoke(cli, [*arguments, "--params", "x", "--compare", str(tmp_path / "c.png")])
    assert run.exit_code == 0, run.output
    assert (told := re.search(r"PSNR to the target (\d+\.\d) dB, before (\d+\.\d) dB", run.output))
    assert float(told[1]) > float(told[2])
    assert abs(float(out.read_text().split("x = ")[1].split()[0]) - 0.3) < 0.016
    assert (tmp_path / "c.png").exists()
    for wrong in (["--params", "z"], ["--crop", "3x3"], ["--background", "red"], ["--to", "b.png"]):
        assert CliRunner().invoke(cli, [*arguments, *wrong]).exit_code == 2


def test_the_command_takes_frames_and_shows_the_way(tmp_path: Path) -> None:
    scene, out, way = (tmp_path / name for name in ("a.nsg", "b.nsg", "way.gif"))
    scene.write_text(SWING)
    for frame, picture in frames_of(SWING, 0, 3, wide="60deg", lag=0.1).items():
        picture.save(tmp_path / f"f{frame:02}.png")
    given = [
        ["--to", f"{tmp_path}/f%02d.png"],
        ["--to", f"0={tmp_path}/f00.png", "--to", f"3={tmp_path}/f03.png"],
    ]
    texts = []
    for to in given:
        arguments = ["fit", str(scene), *to, "-o", str(out), "--animate", str(way)]
        run = CliRunner().invoke(cli, arguments)
        assert run.exit_code == 0, run.output
        texts.append(out.read_text())
    assert texts[0] == texts[1] != SWING
    with pillow.open(way) as film:
        assert film.n_frames > 2  # type: ignore[attr-defined]
        assert film.size == (32, 32)


def test_a_noisy_picture_by_another_program() -> None:
    """A square that Pillow draws, blurred and with noise, as a photograph would be."""
    text = SCENE.replace("star { scale(0.4)", "square { scale(s); rotate(turn)").replace(
        "// here", "param s = 0.3 in 0.2..0.6; param turn = 0deg in -45deg..45deg;"
    )
    angles = np.pi / 4 + np.pi / 2 * np.arange(4) + np.radians(20.0)
    corners = [(320 + 400 * (0.3 + 0.5 * np.cos(a)), 400 - 400 * (-0.2 + 0.5 * np.sin(a))) for a in angles]
    sheet = pillow.new("RGB", (800, 800), "white")
    ImageDraw.Draw(sheet).polygon([(x + 80, y) for x, y in corners], fill="#d33333")
    small = sheet.resize((80, 80), pillow.Resampling.BOX).filter(ImageFilter.GaussianBlur(0.7))
    noise = np.random.default_rng(5).normal(0.0, 0.03, (80, 80, 3))
    found = fitted(text, np.clip(np.asarray(small) / 255 + noise, 0, 1).astype(np.float32).view(Image))
    for name, value in (("x", 0.3), ("y", -0.2), ("s", 0.5), ("turn", np.radians(20.0))):
        assert near(found, name, value, 0.02), found.told()
