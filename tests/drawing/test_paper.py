"""The paper's renderers against loops in float64, their shapes against its Table 3, and what they draw."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
import torch
from torch import nn

from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.neural.paper import (
    ConvLSTM,
    Reading,
    ReadingConfig,
    Streaming,
    StreamingConfig,
    draw_whole,
)
from tests.drawing.copies import Asked


def sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))


def gru(x: np.ndarray, h: np.ndarray, wi: np.ndarray, wh: np.ndarray, *biases: np.ndarray) -> np.ndarray:
    """Cho et al. 2014 with a reset of the recurrent part, gates in the order reset, keep, candidate."""
    n = len(h)
    a, b = wi @ x + biases[0], wh @ h + biases[1]
    reset, keep = sigmoid(a[:n] + b[:n]), sigmoid(a[n : 2 * n] + b[n : 2 * n])
    return (1 - keep) * np.tanh(a[2 * n :] + reset * b[2 * n :]) + keep * h


def features(point: np.ndarray) -> np.ndarray:
    angles = np.outer(point, [np.pi, 2 * np.pi]).ravel()
    return np.array([*point, *np.sin(angles), *np.cos(angles)])


@pytest.mark.parametrize("leaves", [0, 1])
def test_it_reads_as_the_paper_says(leaves: int) -> None:
    """With ``leaves`` a pixel has coordinates in each object, too, by a linear map of its vector."""
    torch.manual_seed(5)
    network = Reading(ReadingConfig(vector=6, hidden=5, reads=3, octaves=2, leaves=leaves)).double()
    with torch.no_grad():
        network.start.normal_()
    vectors, tokens = torch.randn(2, 3, 6).double(), torch.randint(0, 4, (2, 3))
    points, count = torch.randn(2, 4, 2).double(), torch.tensor([3, 2])
    with torch.no_grad():
        found = network(vectors, tokens, points, count).numpy()
    w = {k: v.detach().numpy() for k, v in network.state_dict().items()}
    names = ["look_place.weight", "look_object.weight", *["look_leaf.weight"] * leaves]
    look = np.concatenate([w[name] for name in names], 1), w["look_state.weight"]
    look += w["look_place.bias"], w["look_state.bias"]
    after = tuple(w[f"next.{name}"] for name in ("weight_ih", "weight_hh", "bias_ih", "bias_hh"))
    for b, p in np.ndindex(2, 4):
        place = features(points[b, p].numpy())
        state = w["start"]
        for _ in range(3):
            answers = []
            for i in range(int(count[b])):
                seen = np.concatenate([vectors[b, i].numpy(), np.eye(4)[int(tokens[b, i])], [i / 4]])
                if leaves:
                    rows = (w["frames.weight"] @ vectors[b, i].numpy() + w["frames.bias"]).reshape(2, 3)
                    seen = np.append(seen, features(rows @ [*points[b, p].tolist(), 1]))
                answers.append(gru(np.concatenate([place, seen]), state, *look))
            state = gru(np.max(answers, 0), state, *after)
        np.testing.assert_allclose(found[b, p], w["head.weight"] @ state + w["head.bias"], atol=1e-12)


def convolve(x: np.ndarray, weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """A 5 x 5 convolution (C, H, W) -> (O, H, W), stride 1, padding 2, by loops."""
    _, h, w = x.shape
    padded, out = np.pad(x, ((0, 0), (2, 2), (2, 2))), np.zeros((len(weight), h, w))
    for o, i, j in np.ndindex(*out.shape):
        out[o, i, j] = bias[o] + (weight[o] * padded[:, i : i + 5, j : j + 5]).sum()
    return out


def test_the_cell_is_a_convolutional_lstm() -> None:
    torch.manual_seed(3)
    cell = ConvLSTM(3, 2).double()
    x, hidden, state = torch.randn(3, 5, 4).double(), *torch.randn(2, 2, 5, 4).double()
    with torch.no_grad():
        new_hidden, new_state = cell(x[None], (hidden[None], state[None]))
    assert cell.gates.bias is not None
    gates = convolve(
        torch.cat([x, hidden]).numpy(), cell.gates.weight.detach().numpy(), cell.gates.bias.detach().numpy()
    )
    i, f, o, g = gates[0:2], gates[2:4], gates[4:6], gates[6:8]
    expected = sigmoid(f) * state.numpy() + sigmoid(i) * np.tanh(g)
    np.testing.assert_allclose(new_state[0].numpy(), expected, atol=1e-12)
    np.testing.assert_allclose(new_hidden[0].numpy(), sigmoid(o) * np.tanh(expected), atol=1e-12)


@pytest.mark.parametrize("resolution", [4, 64, 512])
def test_layers_have_the_shapes_of_table_3(resolution: int) -> None:
    with torch.device("meta"):
        network = Streaming(StreamingConfig(resolution=resolution))
    outs = [256, 256, 256, 256, 256, 128, 64, 32, 32][: int(math.log2(resolution))]  # from 2 x 2 up
    assert [(d.in_channels, d.out_channels) for d in network.deconvolutions] == [*pairwise([64, *outs])]
    for layer in network.deconvolutions:
        assert isinstance(layer, nn.ConvTranspose2d)
        assert (layer.kernel_size, layer.stride, layer.padding) == ((4, 4), (2, 2), (1, 1))
    before = outs[-1]
    (level,) = network.stages.values()
    gates, pixels = level.cell.gates, level.pixels  # type: ignore[union-attr]
    assert isinstance(gates, nn.Conv2d)
    assert (gates.kernel_size, gates.stride, gates.padding) == ((5, 5), (1, 1), (2, 2))
    assert gates.in_channels == 2 * before + 4  # map, state and the token
    assert gates.out_channels == 4 * before
    assert isinstance(pixels, nn.Sequential)
    assert [type(m) for m in pixels] == [nn.Conv2d, nn.ReLU, nn.Conv2d, nn.ReLU, nn.Conv2d]
    ones = [(m.kernel_size, m.in_channels, m.out_channels) for m in pixels if isinstance(m, nn.Conv2d)]
    assert ones == [((1, 1), before, out) for out in (before, before, 3)]


def test_an_object_less_is_a_shorter_stream() -> None:
    torch.manual_seed(0)
    network = Streaming(StreamingConfig(resolution=8, width=1 / 32))
    vectors, tokens = torch.randn(2, 4, 64), torch.randint(0, 4, (2, 4))
    with torch.no_grad():
        padded = network(vectors, tokens, torch.tensor([2, 4]))
        torch.testing.assert_close(padded[:1], network(vectors[:1, :2], tokens[:1, :2]))
        torch.testing.assert_close(padded[1:], network(vectors[1:], tokens[1:]))


Colour = tuple[float, float, float]
WHITE: Colour = (1.0, 1.0, 1.0)


def some(count: int, canvas: tuple[int, int], background: Colour | None = WHITE) -> Program:
    rng = np.random.default_rng(3)
    tokens = rng.integers(0, 4, count).astype(np.int8)
    tokens[:1] = 0
    return Program(
        vectors=rng.normal(size=(count, 64)).astype(np.float32),
        tokens=tokens,
        bounds=np.zeros((count, 4), np.float32),
        canvas=canvas,
        background=background,
        model="any",
        weights="0" * 64,
        objects=("star",) * count,
        places=(None,) * count,
    )


def reading() -> Reading:
    torch.manual_seed(2)
    return Reading(ReadingConfig(hidden=8, reads=2, octaves=3)).eval()


def test_a_pixel_is_the_mean_of_its_four_samples() -> None:
    network, p = reading(), some(3, (6, 4))
    picture = np.asarray(draw_whole(network, p).image)
    assert picture.shape == (4, 6, 3)
    v, t = torch.from_numpy(p.vectors.copy())[None], torch.from_numpy(p.tokens.astype(np.int64))[None]
    for row, column in ((0, 0), (1, 4), (3, 5)):
        # the shorter side spans [-1, 1]: a pixel is half a unit wide
        x, y = (column + 0.5 - 3) * 0.5, (2 - 0.5 - row) * 0.5
        points = [[x + dx, y + dy] for dx in (-0.125, 0.125) for dy in (-0.125, 0.125)]
        with torch.no_grad():
            expected = network(v, t, torch.tensor([points]))[0].mean(0).clamp(0, 1).numpy()
        np.testing.assert_allclose(picture[row, column], expected, atol=1e-6)


@pytest.mark.parametrize("canvas", [(64, 80), (8, 8)])
def test_a_picture_waits_for_nothing_on_a_device(canvas: tuple[int, int]) -> None:
    """Everything is on its way before the first number is asked for, of a device that has none."""
    streaming = Streaming(StreamingConfig(resolution=8, width=1 / 32)).eval()
    network, share = (streaming if canvas == (8, 8) else reading()).to("meta"), []
    with Asked() as asked, pytest.raises(NotImplementedError, match="Cannot copy out of meta"):
        draw_whole(network, some(3, canvas), progress=share.append)
    assert share[-1] == 1.0
    assert asked.seen["upload"] <= 4


def test_streaming_draws_its_own_size_alone() -> None:
    torch.manual_seed(2)
    network, p = Streaming(StreamingConfig(resolution=8, width=1 / 32)).eval(), some(2, (8, 8))
    picture = np.asarray(draw_whole(network, p).image)
    with torch.no_grad():
        image = network(
            torch.from_numpy(p.vectors.copy())[None], torch.from_numpy(p.tokens.astype(np.int64))[None]
        )[0]
    np.testing.assert_allclose(picture, image.clamp(0, 1).permute(1, 2, 0).numpy(), atol=1e-6)
    with pytest.raises(ProgramError, match="8 x 8"):
        draw_whole(network, some(2, (16, 16)))


def test_white_only_and_nothing_is_white() -> None:
    for background in (None, (1.0, 0.9, 1.0)):
        with pytest.raises(ProgramError, match="white"):
            draw_whole(reading(), some(1, (4, 4), background))
    empty = draw_whole(reading(), some(0, (5, 4)))
    assert np.array_equal(np.asarray(empty.image), np.ones((4, 5, 3), np.float32))
