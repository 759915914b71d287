"""The cell of the framed renderer: the fold it can express, shut gates, and the network it was trained as."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from lab.folds import fold
from lab.sets.plane import SETS, random_scene
from lab.training.network import Trainee
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.load import Model, load_model
from scenelang.drawing.neural.network import TOKENS, FramedConfig
from scenelang.language.words import BLEND

STEEP = 1e7


def ideal() -> Trainee:
    """A cell whose lines are written down rather than learned: the fold of the language."""
    network = Trainee(FramedConfig(), 4, 1).double().requires_grad_(False)
    k = 1 / (2 * BLEND)
    # rows of d and D; columns of take and of the two lines of paint
    lines = [
        [[-STEEP, -STEEP, -STEEP], [STEEP, STEEP, 0]],
        [[-k, -k, -k], [k, k, k]],
        [[-STEEP, 0, 0], [-STEEP, 0, 0]],
        [[STEEP, 0, 0], [-STEEP, 0, 0]],
    ]
    network.cell_lines.copy_(torch.tensor(lines))
    network.cell_gain.zero_()
    network.cell_bias.copy_(torch.tensor([[0.5, 0.5, 0.5]] * 2 + [[0.5, 0, 0]] * 2))
    network.candidate.copy_(torch.tensor([1.0, 1, -1, 1]).view(TOKENS, 1, 1))
    network.bump.copy_(torch.tensor([0, BLEND, 0, 0]).view(TOKENS, 1))
    return network


def stream(network: Trainee, d: Tensor, colours: Tensor, tokens: Tensor) -> tuple[Tensor, Tensor]:
    """State and register after objects at distances d (N, P) of colours (N, 3)."""
    weights = network.cell_weights()
    state, colour = d[0][None, None], colours[0][:, None].expand(1, 3, d.shape[1])
    for i in range(1, len(d)):
        t = tokens[i : i + 1]
        state, colour = network.step(
            d[i][None, None], state, colour, colours[i].view(1, 3, 1), tuple(w[t] for w in weights)
        )
    return state[0, 0], colour[0].T


def test_lines_express_the_whole_fold() -> None:
    """Streams of every operator at random distances, against the reference, in float64."""
    network, g = ideal(), torch.Generator().manual_seed(4)
    for _ in range(20):
        d = torch.randn(6, 500, generator=g, dtype=torch.float64) * 0.3
        colours = torch.rand(6, 3, generator=g, dtype=torch.float64)
        tokens = torch.randint(0, TOKENS, (6,), generator=g)
        state, colour = stream(network, d, colours, tokens)
        steps = fold(d.unbind(0), colours[:, None].unbind(0), tokens[:, None])
        depth, exact = list(steps)[-1]
        torch.testing.assert_close(state, depth, rtol=0, atol=1e-6)
        torch.testing.assert_close(colour, exact.expand(500, 3), rtol=0, atol=1e-5)


def test_a_shut_gate_is_shut_and_asks_for_nothing() -> None:
    """Outside its interval a gate is 0 or 1 exactly, and no gradient comes through it."""
    network = Trainee(FramedConfig(), 4, 1)
    levels = torch.tensor([[[-0.01, 1.01], [-3.0, 0.3], [-0.2, 7.0]]], requires_grad=True)
    state, colour = torch.full((1, 1, 2), 0.25), torch.zeros(1, 3, 2)
    bump, shown = torch.full((1, 1, 1), 0.1), torch.ones(1, 3, 1)
    new, painted = network.update(levels, torch.full((1, 1, 2), -0.5), bump, state, colour, shown)
    assert new.flatten().tolist() == [0.25, -0.5]
    assert painted[0, 0].tolist() == [0.0, 1.0]
    (new.sum() + painted.sum()).backward()
    assert not levels.grad.any()  # type: ignore[union-attr]


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model("shapes2d", weights="bb3fe72417a92d611df31e12529f9ca7527d73717b8b521820ddc1520656629b")


def programs(name: str, count: int, canvas: tuple[int, int] = (64, 64)) -> list[Program]:
    rng = np.random.default_rng(list(name.encode()))
    return [
        compile_scene(random_scene(rng, SETS[name]).model_copy(update={"canvas": canvas}))
        for _ in range(count)
    ]


def test_streaming_equals_the_network_it_was_trained_as(model: Model) -> None:
    """The inference path (channels first, folded weights, skipping off) against `Trainee.trace`."""
    network = Trainee(FramedConfig(), len(model.manifest.geometries), 1).requires_grad_(False)
    network.load_state_dict(model.network.state_dict())
    for program in programs("chains", 4):
        field, count = Field(network, program.vectors, program.tokens), len(program)
        axes = torch.linspace(-1.5, 1.5, 24), torch.linspace(-1, 1, 16)
        p = torch.stack(torch.meshgrid(*axes, indexing="ij")).reshape(2, -1)
        shown = field.picture(field.folded(p)[0])
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
