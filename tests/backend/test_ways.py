"""Ways to draw a Program: samples of a pixel, precision, and what a model has no form for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import scenelang
from scenelang.backend import onnx_draw, onnx_session
from scenelang.backend.errors import RenderError
from scenelang.backend.neural import draw_program, open_model
from scenelang.backend.onnx_calibrate import calibrate, save_ranges
from scenelang.backend.onnx_framed import EightBitStream
from scenelang.evaluation.metrics import psnr
from scenelang.evaluation.sets import SETS, random_scene
from scenelang.models.load import Model
from scenelang.models.manifest import available, load_manifest
from scenelang.program.compile import compile_scene
from scenelang.program.program import Program
from scenelang.renderers.draw import draw
from scenelang.renderers.streaming import Streaming, StreamingConfig
from scenelang.scene.schema import Object, Rotate, Scale, Scene

SIDE = 16
DIGEST = "ab" * 32


def scene(canvas: tuple[int, int] = (64, 64), background: Any = (0, 0, 0)) -> Scene:
    node = Object(geometry="star", transforms=(Scale(x=0.7, y=0.5, z=1), Rotate(angle=0.4)))
    return Scene(canvas=canvas, background=background, nodes=(node,))


def test_one_sample_is_the_centre_of_every_pixel() -> None:
    """At three times the size, the middle one of 3 x 3 pixels is the same sample."""
    small = scenelang.render(scene((40, 40)), samples="one")
    large = scenelang.render(scene((120, 120)), samples="one")
    np.testing.assert_allclose(small, large[1::3, 1::3], atol=2 / 255)
    colours = {tuple(c) for c in np.round(np.asarray(small).reshape(-1, 3), 2).tolist()}
    assert len(colours) <= 4  # the object, the background, and what lies within float32 of the outline


def test_four_samples_are_what_adaptive_ones_look_like() -> None:
    four, adaptive = (scenelang.render(scene(), samples=s) for s in ("four", "adaptive"))
    one = scenelang.render(scene(), samples="one")
    assert psnr(four, adaptive) > 45
    assert psnr(four, one) < 40


def test_sampling_is_counted() -> None:
    program = compile_scene(scene())
    model = open_model("shapes2d")
    drawn = {s: draw_program(program, model, threads=1, samples=s) for s in ("adaptive", "four", "one")}
    assert drawn["one"].refined == 0
    assert drawn["four"].refined == 64 * 64
    assert 0 < drawn["adaptive"].refined < 64 * 64 / 4
    assert drawn["one"].pairs < drawn["adaptive"].pairs < drawn["four"].pairs


def test_nothing_skipped_is_the_same_picture() -> None:
    program = compile_scene(scene())
    model = open_model("shapes2d")
    all_met = draw_program(program, model, threads=1, skip=False)
    skipped = draw_program(program, model, threads=1)
    assert psnr(all_met.image, skipped.image) > 45
    assert all_met.pairs > skipped.pairs


def test_eight_bits_in_the_decoder_cost_accuracy() -> None:
    program = compile_scene(scene((128, 128)))
    network = open_model("shapes2d").framed
    wanted = draw(network, program.vectors, program.tokens, program.canvas, program.background).image
    found = draw(
        network,
        program.vectors,
        program.tokens,
        program.canvas,
        program.background,
        make_stream=EightBitStream,
    ).image
    assert 25 < psnr(found, wanted) < 49


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"precision": "int4"}, "unknown precision 'int4'; there are 'float32' and 'int8'"),
        ({"samples": "two"}, "unknown samples 'two'; there are 'adaptive', 'four' and 'one'"),
    ],
)
def test_unknown_ways_are_refused(options: dict[str, Any], error: str) -> None:
    with pytest.raises(ValueError, match=error):
        scenelang.render(scene(), **options)


@pytest.mark.parametrize("options", [{"precision": "int8"}, {"samples": "one"}])
def test_the_reference_draws_in_one_way(options: dict[str, Any]) -> None:
    with pytest.raises(RenderError, match="neither a precision nor a choice of samples"):
        scenelang.render(scene(), backend="reference", **options)


def test_a_model_without_an_int8_form_says_so() -> None:
    with pytest.raises(RenderError, match=r"model `shapes2d` has no int8 form: .*gain nothing"):
        scenelang.render(scene(), precision="int8")


# ---------------------------------------------------------------- a small streaming model


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Model:
    """An untrained streaming model with ranges for 8 bits."""
    torch.manual_seed(2)
    network = Streaming(StreamingConfig(64, SIDE, 1 / 16)).requires_grad_(False)
    last = network.stages[str(SIDE)].pixels[4]  # which begins white
    torch.nn.init.normal_(last.weight, std=2.0)
    last.bias.fill_(0.5)
    manifest = replace(
        load_manifest("shapes2d"), name="small", renderer="streaming", sizes=((SIDE, SIDE),), white=True
    )
    model = Model(manifest, network, DIGEST, {})
    monkeypatch.setattr(onnx_draw, "ranges_path", lambda name: tmp_path / "int8.safetensors")
    monkeypatch.setattr(onnx_draw, "_opened", {})
    return model


def program_of(canvas: tuple[int, int] = (SIDE, SIDE), background: Any = (1, 1, 1)) -> Program:
    return replace(compile_scene(scene(canvas, background)), model="small", weights=DIGEST)


def calibrated(model: Model) -> None:
    program = program_of()
    assert isinstance(model.network, Streaming)
    ranges = calibrate(model.network, [(program.vectors, program.tokens)])
    save_ranges(onnx_draw.ranges_path("small"), ranges, DIGEST, {})


def test_a_calibrated_model_draws_in_eight_bits(small: Model) -> None:
    calibrated(small)
    eight = draw_program(program_of(), small, threads=1, precision="int8")
    plain = draw_program(program_of(), small, threads=1)
    assert eight.image.shape == (SIDE, SIDE, 3)
    np.testing.assert_allclose(eight.image, plain.image, atol=0.02)
    assert (np.asarray(eight.image) != np.asarray(plain.image)).any()
    np.testing.assert_allclose(
        np.asarray(eight.image) * 255, np.rint(np.asarray(eight.image) * 255), atol=1e-4
    )


def test_nothing_to_draw_is_white(small: Model) -> None:
    calibrated(small)
    empty = compile_scene(Scene(canvas=(SIDE, SIDE), nodes=()))
    program = replace(empty, model="small", weights=DIGEST)
    assert (np.asarray(draw_program(program, small, precision="int8").image) == 1).all()


@pytest.mark.parametrize(
    ("canvas", "background", "error"),
    [
        ((SIDE, 2 * SIDE), (1, 1, 1), "draws 16 x 16 pixels, not 16 x 32"),
        ((SIDE, SIDE), (1, 1, 0.5), "draws on white only"),
        ((SIDE, SIDE), None, "draws on white only"),
    ],
)
def test_other_canvases_and_backgrounds_are_refused(
    small: Model, canvas: tuple[int, int], background: Any, error: str
) -> None:
    calibrated(small)
    with pytest.raises(RenderError, match=error):
        draw_program(program_of(canvas, background), small, precision="int8")


def test_missing_ranges_and_packages_are_told(small: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(RenderError, match="has no int8 form: no ranges were found for its weights"):
        draw_program(program_of(), small, precision="int8")
    calibrated(small)
    monkeypatch.setattr(onnx_session.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RenderError, match=r"pip install 'scenelang\[int8\]'"):
        draw_program(program_of(), small, precision="int8")


def test_streaming_samples_in_one_way(small: Model) -> None:
    with pytest.raises(RenderError, match="model `small` samples pixels in one way only, not `four`"):
        draw_program(program_of(), small, samples="four")


@pytest.mark.parametrize("name", [name for name in available() if onnx_draw.has_int8(name)])
def test_shipped_int8_forms_fit_their_weights_and_lose_little(name: str) -> None:
    """On scenes that calibration did not see."""
    model = open_model(name)
    gaps = []
    for index in range(6):
        made = random_scene(np.random.default_rng([77, index]), SETS[model.manifest.set])
        made = made.model_copy(update={"canvas": model.manifest.sizes[0]})
        program = compile_scene(made, model=name)
        eight = draw_program(program, model, threads=1, precision="int8").image
        plain = draw_program(program, model, threads=1).image
        gaps.append(float(np.square(np.asarray(eight) - np.asarray(plain)).mean()))
    # a tenth of the error of a picture of 26 dB, which is more than any shipped model of this kind reaches
    assert np.mean(gaps) < 10**-2.6 / 10
