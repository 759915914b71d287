"""Ways to draw a Program: samples of a pixel, and skipping."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import scenelang
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.weights import Codes
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import enlarged
from scenelang.drawing.neural.load import Model
from scenelang.drawing.neural.paper import Streaming, StreamingConfig
from scenelang.drawing.torch_backend import draw_program, open_model
from scenelang.language.scene import Object, Rotate, Scale, Scene

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


def test_sampling_is_counted() -> None:
    program = compile_scene(scene())
    model = open_model("shapes2d")
    drawn = {s: draw_program(program, model, threads=1, samples=s) for s in ("adaptive", "four", "one")}
    assert drawn["one"].refined == 0
    assert 0 < drawn["four"].refined == drawn["four"].met < 64 * 64  # the others have one colour
    assert 0 < drawn["adaptive"].refined < 64 * 64 / 4
    assert drawn["one"].pairs < drawn["adaptive"].pairs < drawn["four"].pairs
    quick = draw_program(program, model, threads=1, samples="quick")
    assert np.array_equal(quick.image, drawn["adaptive"].image)  # the plane knows no quicker way to refine
    draft = scenelang.render(scene(), samples="draft")
    assert draft.shape == (64, 64, 3)
    assert np.array_equal(draft, enlarged(scenelang.render(scene(), samples="one", size=(32, 32)), (64, 64)))


def test_unknown_samples_are_refused() -> None:
    with pytest.raises(ValueError, match="unknown samples `two`; there are `adaptive`, `four`, `quick`, "):
        scenelang.render(scene(), samples="two")  # type: ignore[arg-type]


def test_the_reference_draws_in_one_way() -> None:
    with pytest.raises(RenderError, match="the reference always takes four samples a pixel"):
        scenelang.render(scene(), backend="reference", samples="one")


def test_streaming_samples_in_one_way() -> None:
    manifest = replace(
        load_manifest("shapes2d"), name="small", renderer="streaming", sizes=((SIDE, SIDE),), white=True
    )
    small = Model(manifest, Streaming(StreamingConfig(64, SIDE, 1 / 16)), Codes({}, {}, DIGEST), {})
    program = replace(compile_scene(scene((SIDE, SIDE), (1, 1, 1))), model="small", weights=DIGEST)
    with pytest.raises(RenderError, match="model `small` samples pixels in one way only, not `four`"):
        draw_program(program, small, samples="four")
