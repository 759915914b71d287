"""The cell of the framed renderer: what its gates can express, and how it is taught."""

from __future__ import annotations

import torch
from torch import Tensor

from lab.training.network import Trainee
from scenelang.drawing.exact.field import fold
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
        steps = fold(d.unbind(0), colours[:, None].unbind(0), tokens.tolist())
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


def test_a_narrower_gate_blends_less() -> None:
    network = Trainee(FramedConfig(), 4, 1).requires_grad_(False)
    network.bump.fill_(0.5)
    wide = network.cell_weights()[3]
    network.cell_gain.fill_(2.0)
    torch.testing.assert_close(network.cell_weights()[3], wide * torch.tensor(-2.0).exp())


def test_a_given_state_replaces_the_network_s_own() -> None:
    """Given what it answers itself a stream is unchanged; given something else, one step follows from it."""
    torch.manual_seed(1)
    network, g = Trainee(FramedConfig(), 4, 1).requires_grad_(False), torch.Generator().manual_seed(2)
    q = torch.randn(2, 4, 2, 30, generator=g)
    scale, code, colours = (
        torch.ones(2, 4),
        torch.randn(2, 4, 4, generator=g),
        torch.rand(2, 4, 3, generator=g),
    )
    tokens = torch.tensor([[0, 1, 2, 3], [0, 0, 1, 1]])
    own = network.trace(q, scale, code, colours, tokens)
    again = network.trace(q, scale, code, colours, tokens, (own.depth, own.colour))
    torch.testing.assert_close(again.depth, own.depth)
    torch.testing.assert_close(again.colour, own.colour)
    depth, shown = torch.randn(2, 4, 30, generator=g), torch.rand(2, 4, 30, 3, generator=g)
    given = network.trace(q, scale, code, colours, tokens, (depth, shown))
    torch.testing.assert_close(given.depth[:, 0], own.depth[:, 0])
    weights = tuple(w[tokens[:, 3]] for w in network.cell_weights())
    state, colour = network.step(
        own.distance[:, 3, None], depth[:, 2, None], shown[:, 2].mT, colours[:, 3, :, None], weights
    )
    torch.testing.assert_close(given.depth[:, 3], state[:, 0])
    torch.testing.assert_close(given.colour[:, 3], colour.mT)
