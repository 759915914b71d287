"""The framed renderer: noise from random weights, shapes in codes, and shortcuts that change nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from lab.sets.plane import SETS, random_scene
from lab.training.network import Trainee
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program
from scenelang.drawing.metrics import psnr
from scenelang.drawing.neural.coverage import Coverage
from scenelang.drawing.neural.draw import draw
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.load import Framed, Model, load_model
from scenelang.drawing.neural.meetings import raster
from scenelang.drawing.neural.network import FramedConfig
from scenelang.language.scene import Object, Scale, Scene
from scenelang.output.plan import reference_of

GEOMETRIES = ("square", "triangle", "star", "pentagon")


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model("shapes2d")


def programs(name: str, count: int, canvas: tuple[int, int] = (64, 64)) -> list[Program]:
    rng = np.random.default_rng(list(name.encode()))
    return [
        compile_scene(random_scene(rng, SETS[name]).model_copy(update={"canvas": canvas}))
        for _ in range(count)
    ]


def picture(network: Framed, program: Program, **options: object) -> np.ndarray:
    return np.asarray(draw(network, program, **options).image)  # type: ignore[arg-type]


def one_object(geometry: str) -> Scene:
    node = Object(geometry=geometry, transforms=(Scale(x=0.8, y=0.8, z=1),))
    return Scene(canvas=(64, 64), background=(0, 0, 0), nodes=(node,))


def test_random_weights_draw_noise(model: Model) -> None:
    scenes = [random_scene(np.random.default_rng(i), SETS["unions"]) for i in range(8)]
    small = [s.model_copy(update={"canvas": (64, 64)}) for s in scenes]
    torch.manual_seed(0)
    trained, random = [], []
    for scene in small:
        program, reference = compile_scene(scene), reference_of(scene, model.manifest)
        network = Trainee(FramedConfig(), 4, 1).requires_grad_(False)
        trained.append(psnr(picture(model.network, program), reference))
        random.append(psnr(picture(network, program), reference))
    assert np.mean(random) < 15
    assert np.mean(trained) > 35


@pytest.mark.parametrize(("a", "b"), [(0, 1), (1, 2), (2, 3), (3, 0)])
def test_swapping_two_codes_swaps_the_shapes(model: Model, a: int, b: int) -> None:
    first, second = (compile_scene(one_object(GEOMETRIES[i])) for i in (a, b))
    swapped = first.vectors.copy()
    swapped[:, :4] = second.vectors[:, :4]
    got = draw(model.network, replace(first, vectors=swapped)).image
    np.testing.assert_array_equal(got, picture(model.network, second))
    assert psnr(got, picture(model.network, first)) < 25


def test_streaming_equals_the_network_it_was_trained_as(model: Model) -> None:
    """The inference path (channels first, folded weights, skipping off) against `Trainee.trace`."""
    network = Trainee(model.framed.config, 4, 1).requires_grad_(False)
    network.load_state_dict(model.network.state_dict())
    for program in programs("chains", 4):
        field, count = Field(network, program.vectors, program.tokens), len(program)
        canvas = (24, 16)
        grid = raster(canvas, range(16))
        tile = Coverage(field, skip=False).tile(canvas, range(16), "one")
        shown = torch.from_numpy(tile.picture.reshape(-1, 4).T.copy())
        p = torch.from_numpy(grid.centres((np.arange(24), np.zeros(24, int)), 16)[:, ::16].copy())
        p = p.reshape(2, -1)
        every = np.repeat(np.arange(count), p.shape[1])
        q = field.frames.local(field.xp, every, p.repeat(1, count)).reshape(2, count, -1).swapaxes(0, 1)
        scale = torch.from_numpy(field.frames.scale.astype(np.float32))
        codes = torch.from_numpy(program.vectors[:, :4].copy())
        colours = field.colours.T
        tokens = torch.from_numpy(program.tokens.astype(np.int64))
        trace = network.trace(q[None], scale[None], codes[None], colours[None], tokens[None])
        coverage = (0.5 - trace.margin[0, -1] / 4).clamp(0, 1)
        torch.testing.assert_close(shown[3], coverage, atol=2e-3, rtol=0)
        colour = trace.colour[0, -1] * coverage[:, None]
        torch.testing.assert_close(shown[:3].T, colour, atol=4e-3, rtol=0)
