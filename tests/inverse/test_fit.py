"""Params from pictures: the search, its box and soft pictures, and fits of scenes whose values are known."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image as pillow
from PIL import ImageDraw, ImageFilter
from scipy import ndimage

import scenelang
from scenelang.cli.main import cli
from scenelang.drawing.exact.mesh import FitError
from scenelang.drawing.image import Image, decoded, encoded
from scenelang.drawing.metrics import psnr
from scenelang.inverse import search
from scenelang.inverse.fit import Fit, problems_of
from scenelang.inverse.problem import FitProblem, Moment
from scenelang.inverse.search import (
    Axis,
    Blur,
    Found,
    Knob,
    SearchBox,
    TargetPicture,
    blurred,
    space_of,
    target_of,
)
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source, rewritten
from scenelang.language.parser import parse

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


def swings() -> dict[int, Image]:
    """Two frames of a swing of 60 degrees."""
    values = {"wide": "60deg", "lag": 0.1}
    scenes = {frame: scenelang.loads(SWING, params=values, frame=frame) for frame in (0, 3)}
    return {frame: scenelang.render(scene, backend="reference") for frame, scene in scenes.items()}


def test_two_frames_tell_what_one_does_not() -> None:
    """How far a pendulum swings and where it is in its swing: one picture shows only both."""
    targets = swings()
    one, two = fitted(SWING, targets[3], frame=3), fitted(SWING, targets)
    assert one.tied or one.others
    assert not two.tied
    assert not two.others
    assert near(two, "wide", np.radians(60.0), 0.02)
    assert near(two, "lag", 0.1, 0.02)
    assert two.target.shape == (64, 32, 3)
    assert np.abs(two.target[32:] - targets[3]).max() < 1e-6
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
    for frame, picture in swings().items():
        picture.save(tmp_path / f"f{frame:02}.png")
    given = [
        ["--to", f"{tmp_path}/f%02d.png"],
        ["--to", f"0={tmp_path}/f00.png", "--to", f"3={tmp_path}/f03.png"],
    ]
    texts = []
    for to in given:
        arguments = ["fit", str(scene), *to, "-o", str(out), "--animate", str(way), "-D", "lag=0.1"]
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


TEXT = """
canvas(64, 64); background(#ffffff); param size = 0.3 in 0.2..0.8;
square { scale(size); rotate(20deg); translate(0.1, -0.1); material flat { color(#202080); } }
"""


def test_a_picture_goes_through_a_gaussian_and_to_larger_pixels() -> None:
    """As scipy has it."""
    picture = np.random.default_rng(1).random((12, 16, 3))
    for sigma, finer, light in ((0.7, 1, True), (2.3, 1, False), (1.1, 2, True), (0.0, 2, True)):
        expected = decoded(picture) if light else picture
        if sigma:
            by = {"mode": "nearest", "axes": (0, 1), "radius": int(np.ceil(3 * sigma * finer))}
            expected = ndimage.gaussian_filter(expected, sigma * finer, **by)
        means = ndimage.uniform_filter(expected, (finer, finer, 1), origin=(-(finer > 1), -(finer > 1), 0))
        expected = encoded(means[::finer, ::finer]) if light else means[::finer, ::finer]
        np.testing.assert_allclose(blurred(picture, Blur(sigma, light), finer), expected, atol=1e-9)


def test_a_blur_is_found_with_the_size_that_would_make_up_for_it() -> None:
    """The target is of eight times as many pixels along each side, blurred in light or not, and averaged."""
    for light in (True, False):
        sharp = scenelang.loads(TEXT.replace("64, 64", "512, 512"), params={"size": 0.5})
        seen = np.asarray(scenelang.render(sharp), float)
        soft = ndimage.gaussian_filter(decoded(seen) if light else seen, (9.6, 9.6, 0))
        mean = soft.reshape(64, 8, 64, 8, 3).mean((1, 3))
        found = scenelang.fit(SourceFile("a.nsg", TEXT), encoded(mean) if light else mean)
        assert found.blur.sigma == pytest.approx(1.2, abs=0.05)
        assert found.blur.light == light
        assert found.blurred_psnr > 45 > found.psnr
        assert float(found.values["size"]) == pytest.approx(0.5, abs=0.003)
        assert any("after a blur of 1.2" in line for line in found.told())


SLIDES = """
canvas(40, 40); background(#ffffff); animate(seconds = 1s, fps = 4); param x = 0 in -0.5..0.5;
square { scale(0.5); translate(x, u); material flat { color(#000000); } }
"""


def problem(targets: dict[int, np.ndarray]) -> FitProblem:
    """The last comparison with targets by frame."""
    source = Source(text=SourceFile("a.nsg", SLIDES)).parsed(Diagnostics())
    moments = [Moment(source, frame) for frame in targets]
    evaluation, scene = moments[0].evaluated({})
    goals = [target_of(target, scene.canvas) for target in targets.values()]
    return problems_of(moments, goals, space_of(evaluation), scene.canvas)[-1]


def test_blur_and_noise_are_told() -> None:
    """Noise as large as the blur's error; a blot of 3 x 3 pixels is not noise."""
    u, random = np.array([0.3]), np.random.default_rng(3)
    pictures = problem({0: np.ones((40, 40, 3))}).pictures(u)
    assert pictures is not None
    for blot in (0, 3):
        target = pictures[0] + random.normal(0.0, 0.03, (40, 40, 3))
        target[20 : 20 + blot, 30 : 30 + blot] = 0.5
        assert problem({0: target}).noise(u) is (blot == 0)
    for sigma in (0.0, 1.0, 2.0):
        seen = encoded(ndimage.gaussian_filter(decoded(pictures[0]), (sigma, sigma, 0), mode="nearest"))
        target = seen + random.normal(0.0, 0.05, (40, 40, 3))
        assert problem({0: target}).blur(pictures) == pytest.approx(sigma, abs=0.51 * sigma)


def box(*wraps: bool) -> SearchBox:
    axes = tuple(Axis(f"p{at}", wraps=one) for at, one in enumerate(wraps))
    return SearchBox([Knob(None, 0.0, axes, True)])  # type: ignore[arg-type]


def two_things(u: np.ndarray) -> np.ndarray:
    """Two things in one picture, each with a valley at 0.2 that is not the one at 0.8."""
    each = np.where(u < 0.5, 0.1 + abs(u - 0.2), abs(u - 0.8))
    return np.append(each, 0.0)


def test_a_fine_descent_ends_where_a_coarse_one_is_drawn_aside() -> None:
    """What never comes to nothing draws forward differences aside, here by as much as half a step."""

    def residuals(u: np.ndarray) -> np.ndarray:
        return np.array([0.1 * (u[0] - 0.8), 0.3 + 2 * (u[0] - 0.8) ** 2])

    def worst(fine: bool) -> float:
        starts = (np.array([u]) for u in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7))
        ends = (search.descend(residuals, box(False), u, step=0.05, fine=fine) for u in starts)
        return max(abs(end.point[0] - 0.8) for end in ends if end is not None)

    assert worst(fine=True) < 0.004 < 0.015 < worst(fine=False)


def test_a_scan_names_the_other_valley_of_each_axis() -> None:
    for wraps in (False, True):
        known = Found(np.array([0.8, 0.2]), 0.01)
        found = search.scanned(two_things, box(wraps, wraps), known)
        best = min(found, key=lambda one: one.cost)
        assert best.point == pytest.approx([0.8, 0.8], abs=1 / search.SCANS)
        assert all(np.count_nonzero(one.point != known.point) == 1 for one in found)


GROWS = """
canvas(32, 32); background(#ffffff); param x = 0 in -0.5..0.5; param s = 0.5 in 0.2..0.8;
square { scale(s); translate(x, 0); material flat { color(#000000); } }
"""


def test_covered_area_changes_as_the_square_does() -> None:
    """A square of radius s covers s² / 2 of the canvas, whose sides are 2; corners are cut a little."""
    moment, size = Moment(Source(text=SourceFile("a.nsg", GROWS)).parsed(Diagnostics())), 0.2 + 0.52 * 0.6
    white, space = TargetPicture(np.ones((32, 32, 3)), np.ones((32, 32))), space_of(moment.evaluated({})[0])
    drawn = FitProblem([moment], space, [white], (32, 32), soft=True, samples="four")
    low, high = (drawn.pictures(np.array([0.43, 0.52 + step])) for step in (-0.02, 0.02))
    assert low is not None
    assert high is not None
    assert (low[0] - high[0]).mean() / 0.04 == pytest.approx(0.6 * size, rel=0.06)


PARAMS = """\
nsg 1;  // all kinds of params
param k =  0.5  in -1..1;   /* a number */
param a = PI * 1rad / 3 in 0rad..PI * 1rad;
param turn = 10deg in -180deg..180deg; param n = 3 in 1..9 step 2;
param word = "ä" in ["ä", "b\\"c"]; param on = true;
param ink = #204060; param soft = [0.1, 0.2] in 0..0.25;
param open = 0.2 in 0..<0.3;
square { translate(k, soft[0]); rotate(a + turn); }
"""
EVERY = ("k", "a", "turn", "n", "word", "on", "ink", "soft", "open")


def source(text: str = PARAMS) -> Moment:
    return Moment(Source(text=SourceFile("a.nsg", text)).parsed(Diagnostics()))


def box_of(text: str = PARAMS, names: tuple[str, ...] = ()) -> SearchBox:
    return space_of(source(text).evaluated({})[0], names)


def test_params_with_a_range_are_searched_unless_named() -> None:
    assert tuple(knob.name for knob in box_of().knobs) == ("k", "a", "turn", "n", "word", "soft", "open")
    assert [axis.wraps for axis in box_of(names=("turn", "a")).axes] == [True, False]
    assert [axis.label for axis in box_of(names=("ink",)).axes] == ["ink.1", "ink.2", "ink.3"]


@pytest.mark.parametrize("seed", range(4))
def test_a_scene_is_written_with_what_was_found_and_nothing_else_changes(seed: int) -> None:
    rng, space = np.random.default_rng(seed), box_of(names=EVERY)
    u = rng.random(len(space.axes)) if seed else np.ones(len(space.axes))
    u = np.where(space.smooth, u, np.floor(u * 0.999 * (space.most + 1)))
    literals = space.literals(u)
    text = rewritten(source().tree, literals)
    found = space_of(source(text).evaluated({})[0], EVERY)  # in its range, or this would be an error
    gap = space.gap(found.point({}), u)
    inks = np.array([axis.label.startswith("ink") for axis in space.axes])
    assert (gap[~inks] <= 1e-4).all()
    assert (gap[inks] <= 0.5 / 255 + 1e-9).all()
    again = parse(SourceFile("a.nsg", text), Diagnostics())
    assert "/* a number */" in rewritten(again, space.literals(space.point({})))
    lines = zip(PARAMS.splitlines(), text.splitlines(), strict=True)
    assert [a.partition("=")[0] for a, _ in lines] == [b.partition("=")[0] for b in text.splitlines()]
    assert "deg" in literals["turn"]
    assert literals["ink"].startswith("#")
    assert literals["a"].endswith("rad")


def test_what_cannot_be_searched_is_said() -> None:
    for names, text, fact in (
        (("kk",), PARAMS, "no param `kk`"),
        (("free",), "param free = 2; square { scale(free); }", "param `free` has no range"),
        ((), "square { }", "no param to fit"),
        (("n",), "param n = 0 in 0..1000000 step 1; square { rotate(n * 1deg); }", "more than 1,000 steps"),
    ):
        with pytest.raises(FitError, match=fact):
            box_of(text, names)
