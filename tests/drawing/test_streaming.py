"""The streaming renderer against loops in float64, its shapes against the paper's Table 3."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from torch import nn

from scenelang.drawing.neural.paper import FILTERS, ConvLSTM, Streaming, StreamingConfig


def convolve(x: np.ndarray, weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """A 5 x 5 convolution (C, H, W) -> (O, H, W), stride 1, padding 2, by loops."""
    _, h, w = x.shape
    out = np.zeros((len(weight), h, w))
    for o in range(len(weight)):
        for i in range(h):
            for j in range(w):
                total = bias[o]
                for di in range(-2, 3):
                    for dj in range(-2, 3):
                        if 0 <= i + di < h and 0 <= j + dj < w:
                            total += float(weight[o, :, di + 2, dj + 2] @ x[:, i + di, j + dj])
                out[o, i, j] = total
    return out


def sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))


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


@pytest.mark.parametrize("resolution", [4, 32, 64, 128, 256, 512])
def test_layers_have_the_shapes_of_table_3(resolution: int) -> None:
    with torch.device("meta"):
        network = Streaming(StreamingConfig(resolution=resolution))
    sizes = [2 ** (i + 1) for i in range(int(math.log2(resolution)))]
    before = 64
    assert len(network.deconvolutions) == len(sizes)
    for size, layer in zip(sizes, network.deconvolutions, strict=True):
        assert isinstance(layer, nn.ConvTranspose2d)
        expected = {4: 256, 8: 256, 16: 256, 32: 256, 64: 128, 128: 64, 256: 32, 512: 32}.get(size, 256)
        assert (layer.kernel_size, layer.stride, layer.padding) == ((4, 4), (2, 2), (1, 1))
        assert (layer.in_channels, layer.out_channels) == (before, expected)
        before = expected
    (level,) = network.stages.values()
    gates, pixels = level.cell.gates, level.pixels  # type: ignore[union-attr]
    assert isinstance(gates, nn.Conv2d)
    assert (gates.kernel_size, gates.stride, gates.padding) == ((5, 5), (1, 1), (2, 2))
    assert gates.in_channels == 2 * before + 4  # map, state and the token
    assert gates.out_channels == 4 * before
    assert isinstance(pixels, nn.Sequential)
    ones = [m for m in pixels if isinstance(m, nn.Conv2d)]
    assert [(m.kernel_size, m.in_channels, m.out_channels) for m in ones] == [
        ((1, 1), before, before),
        ((1, 1), before, before),
        ((1, 1), before, 3),
    ]
    assert [type(m) for m in pixels] == [nn.Conv2d, nn.ReLU, nn.Conv2d, nn.ReLU, nn.Conv2d]


def test_growing_has_a_cell_and_pixels_for_every_level() -> None:
    network = Streaming(StreamingConfig(resolution=32, width=1 / 16), grown=True)
    assert list(network.stages) == ["4", "8", "16", "32"]


def test_an_object_less_is_a_shorter_stream() -> None:
    torch.manual_seed(0)
    network = Streaming(StreamingConfig(resolution=8, width=1 / 32))
    vectors, tokens = torch.randn(2, 4, 64), torch.randint(0, 4, (2, 4))
    with torch.no_grad():
        padded = network(vectors, tokens, torch.tensor([2, 4]))
        torch.testing.assert_close(padded[:1], network(vectors[:1, :2], tokens[:1, :2]))
        torch.testing.assert_close(padded[1:], network(vectors[1:], tokens[1:]))


def test_a_new_level_is_blended_in() -> None:
    torch.manual_seed(0)
    network = Streaming(StreamingConfig(resolution=8, width=1 / 32), grown=True)
    vectors, tokens = torch.randn(1, 2, 64), torch.zeros(1, 2, dtype=torch.int64)
    with torch.no_grad():
        old = network(vectors, tokens, resolution=4)
        new = network(vectors, tokens, resolution=8)
        half = network(vectors, tokens, resolution=8, blend=0.25)
    enlarged = old.repeat_interleave(2, 2).repeat_interleave(2, 3)
    torch.testing.assert_close(half, 0.25 * new + 0.75 * enlarged)


def test_sizes_are_checked() -> None:
    with pytest.raises(ValueError, match="power of two"):
        StreamingConfig(resolution=48)
    with pytest.raises(ValueError, match="share"):
        StreamingConfig(width=2.0)
    assert StreamingConfig(resolution=512).filters(512) == FILTERS[512]


def test_a_cell_on_halves_keeps_its_sums() -> None:
    torch.manual_seed(1)
    level = Streaming(StreamingConfig(resolution=8, width=1 / 32)).stages["8"]
    maps, marks = torch.randn(2, 3, 8, 8, 8), torch.eye(4)[torch.randint(0, 4, (2, 3))]
    with torch.no_grad(), torch.autocast("cpu", torch.bfloat16):
        cell = level.cell((torch.randn(2, 12, 8, 8).bfloat16()), (maps[:, 0].bfloat16(), maps[:, 1]))[1]
        states = level.states(maps.bfloat16(), marks)  # type: ignore[union-attr,operator]
    assert cell.dtype == torch.float32
    assert [state.dtype for state in states] == [torch.bfloat16] * 3
