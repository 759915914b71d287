"""What a picture takes is foretold from its Program, and too much is drawn coarser or not at all."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.program import Program
from scenelang.drawing import work
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import enlarged
from scenelang.drawing.kernel import Kernel
from scenelang.drawing.neural import draw
from scenelang.drawing.small import draw_small
from scenelang.drawing.solid import around
from scenelang.drawing.work import allowed_s, load_of, work_ms

BALL = "sphere { scale(0.5); }"
SKY = "sky(); " + BALL


def program(text: str, side: int = 24) -> Program:
    return nsg.compile(nsg.loads(f"nsg 1; canvas({side}, {side}); {text}"))


def discs(count: int) -> str:
    flat = "material flat { color(hsv(i / 9, 1, 1)); }"
    return f"for (i in 0..<{count}) {{ disc {{ scale(1 - i / {count}); {flat} }} }}"


def counted(drawn: Program, monkeypatch: pytest.MonkeyPatch) -> float:
    """Count the questions to the network while a picture is drawn, and some more for each ray and pixel."""
    count = around.EACH_PIXEL * float(np.prod(drawn.canvas))
    field, rays, gathered = Kernel.field, Kernel.rays, Kernel.around

    def met(self: Kernel, *given: Any, **named: Any) -> Any:
        nonlocal count
        result = field(self, *given, **named)
        count += result.met
        return result

    def followed(self: Kernel, *given: Any, **named: Any) -> Any:
        nonlocal count
        result = rays(self, *given, **named)
        count += result.met + around.EACH_RAY * len(result.hit)
        return result

    def received(self: Kernel, *given: Any, **named: Any) -> Any:
        nonlocal count
        light, asked, pairs = gathered(self, *given, **named)
        count += pairs + around.EACH_RAY * asked
        return light, asked, pairs

    with monkeypatch.context() as patch:
        patch.setattr(Kernel, "around", received)
        patch.setattr(Kernel, "field", met)
        patch.setattr(Kernel, "rays", followed)
        draw_small(drawn, patient=True)
    return count


@pytest.mark.parametrize(
    "text",
    [
        SKY,
        "sky(); box { twist(2); scale(0.4); } torus;",
        "sky(); for (i in 0..5) { sphere { scale(0.2); translate(i / 3 - 1, 0, 0); material metal; } }",
    ],
)
def test_light_from_everywhere_is_foretold(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Within a factor of what a drawing counts; without a sky there is none."""
    drawn = program(text, 20)
    load = load_of(drawn)
    assert 1 / 4 < load.light / counted(drawn, monkeypatch) < 4
    assert load_of(drawn) == load
    assert (load_of(replace(drawn, samples=16)).light > load.light) == ("metal" in text)
    assert load_of(program(BALL)).light == 0


def test_warps_and_walls_take_longer() -> None:
    plain, warped = (f"sky(); torus {{ shell(0.03); {warp} }}" for warp in ("", "twist(6); twirl(3);"))
    walls = "sky(); for (i in 1..6) { torus { shell(0.03); scale(i / 3); } }"
    each = [work_ms(program(text)) for text in (SKY, plain, warped, walls)]
    assert each[0] < each[1] < min(each[2:])


def test_overlaps_are_foretold_as_they_are_drawn() -> None:
    """Twice as many discs in each other are four times as many meetings of samples with objects."""
    few, many = (program(discs(count), 64) for count in (20, 80))
    grown = draw_small(many).pairs / draw_small(few).pairs
    assert grown / 2 < work_ms(many) / work_ms(few) < 2 * grown
    apart = program(
        "for (i in 0..<80) { disc { scale(0.05); translate(i % 10 / 5 - 0.9, floor(i / 10) / 5 - 0.9); } }",
        96,
    )
    assert load_of(apart).outline < load_of(many).outline / 4


def test_a_picture_of_too_much_is_drawn_coarser(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the same one of fewer pixels, enlarged, with a warning, and whole for who is patient."""
    drawn = program(discs(40), 64)
    whole, less = nsg.render(drawn), nsg.render(replace(drawn, canvas=(32, 32)))
    monkeypatch.setattr(work, "LEAST_S", 1.2 * work_ms(replace(drawn, canvas=(32, 32))) / 1e3)
    monkeypatch.setattr(work, "BOUND_S", work.LEAST_S)
    monkeypatch.setattr(work, "SURE", 1.0)
    monkeypatch.setattr(draw, "until_s", lambda *_: float("inf"))
    with pytest.warns(
        UserWarning, match=r"s of work, and .* are allowed: drawn at 32 x 32; --patient draws all"
    ):
        coarse = nsg.render(drawn)
    assert np.array_equal(coarse, enlarged(less, (64, 64)))
    assert np.array_equal(nsg.render(drawn, patient=True), whole)


def test_too_much_light_from_everywhere_is_even(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = program("sky(); for (i in 1..4) { sphere { scale(0.2 * i); material metal; } }")
    load = load_of(drawn)
    monkeypatch.setattr(work, "LEAST_S", work_ms(drawn, load=load._replace(light=0.5 * load.light)) / 1e3)
    monkeypatch.setattr(work, "BOUND_S", work.LEAST_S)
    monkeypatch.setattr(work, "SURE", 1.0)
    monkeypatch.setattr(draw, "until_s", lambda *_: float("inf"))
    with pytest.warns(UserWarning, match="drawn at 24 x 24, by even light in place of the sky's"):
        coarse = nsg.render(drawn)
    assert np.isfinite(coarse).all()
    assert abs(coarse - nsg.render(drawn, patient=True)).max() > 0.05


def test_what_cannot_be_drawn_in_time_is_refused_before_it_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "BOUND_S", 1e-6)
    monkeypatch.setattr(work, "LEAST_S", 1e-6)
    monkeypatch.setattr(draw, "_drawn", None)
    for text in (discs(20), SKY):
        with pytest.raises(RenderError, match="s of work, and 0 are allowed at 24 x 24; draw it smaller"):
            nsg.render(program(text))


@pytest.mark.parametrize("text", [discs(5), BALL, SKY])
def test_the_clock_ends_what_was_foretold_wrongly(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = program(text)
    with monkeypatch.context() as patch:
        patch.setattr(draw, "until_s", lambda canvas, patient, part: float("inf") if patient else -1.0)
        with pytest.raises(RenderError, match=r"more work than was foretold.*--patient"):
            nsg.render(drawn)
        with pytest.raises(RenderError, match="more work than was foretold"):
            nsg.render_outputs(drawn, ["alpha"])
        patient = nsg.render(drawn, patient=True)
    assert np.array_equal(nsg.render(drawn), patient)


@pytest.mark.parametrize("text", [discs(5), BALL, SKY])
def test_a_picture_that_takes_longer_than_foretold_is_drawn_coarser(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was refused when its time was over."""
    drawn = program(text)
    with monkeypatch.context() as patch:
        patch.setattr(draw, "until_s", lambda _, __, part: -1.0 if part == work.FIRST else float("inf"))
        with pytest.warns(UserWarning, match="more work than was foretold: drawn at 6 x 6.*--patient draws"):
            coarse = nsg.render(drawn)
    assert coarse.shape == (24, 24, 3)
    if text != SKY:
        assert np.array_equal(coarse, enlarged(nsg.render(replace(drawn, canvas=(6, 6))), (24, 24)))


def test_exact_pictures_and_proofs_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = nsg.loads("nsg 1; canvas(16, 16); disc;")
    monkeypatch.setattr(work, "allowed_s", lambda _: -1.0)
    with pytest.raises(RenderError, match="more work than was foretold"):
        nsg.render(scene, backend="reference")
    with pytest.raises(RenderError, match="more work than was foretold"):
        nsg.prove(scene, nsg.render(scene, patient=True))
    nsg.prove(scene, nsg.render(scene, backend="reference", patient=True), patient=True)


def test_the_time_allowed_grows_with_the_pixels() -> None:
    sizes = (32, 32), (128, 128), (256, 256), (512, 512)
    seconds = [allowed_s(size) for size in sizes]
    assert seconds == sorted(seconds)
    assert seconds[0] < 60
    assert seconds[2] == 300
