"""The streaming renderer through onnxruntime: float graphs against torch, 8-bit ones against loops."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import torch
from torch.nn.functional import conv2d, conv_transpose2d, pad

from scenelang.backend import onnx_session
from scenelang.backend.errors import RenderError
from scenelang.backend.onnx_calibrate import calibrate, load_ranges, save_ranges, tune
from scenelang.backend.onnx_session import Nodes, integer_kernels
from scenelang.backend.onnx_streaming import BATCH, Ranges, StreamingGraphs, spread_kernels
from scenelang.renderers.streaming import TOKENS, Streaming, StreamingConfig

VECTOR = 6


def network(resolution: int, width: float = 1 / 32, gates: float = 5.0) -> Streaming:
    torch.manual_seed(resolution)
    made = Streaming(StreamingConfig(VECTOR, resolution, width)).requires_grad_(False)
    for layer in made.deconvolutions:
        layer.weight *= 3  # so that maps are not nearly empty
    level = made.stages[str(resolution)]
    level.cell.gates.weight *= gates
    for i in (0, 2):
        level.pixels[i].weight *= 4
    last = level.pixels[4]  # pictures of all colours, as untrained ones are grey
    drawn = torch.from_numpy(by_torch(made, *stream(0)))
    spread = 0.2 / drawn.std((0, 1))
    last.weight *= spread[:, None, None, None]
    last.bias.copy_(0.5 + (last.bias - drawn.mean((0, 1))) * spread)
    return made


def stream(seed: int, count: int = 3) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    tokens = rng.integers(0, 4, count).astype(np.int8)
    return rng.normal(size=(count, VECTOR)).astype(np.float32), tokens


def by_torch(made: Streaming, vectors: np.ndarray, tokens: np.ndarray) -> np.ndarray:
    found = made(torch.from_numpy(vectors)[None], torch.from_numpy(tokens).long()[None])
    return found[0].permute(1, 2, 0).numpy()


@pytest.mark.parametrize("resolution", [4, 8, 16, 32])
@pytest.mark.parametrize("count", [1, 3, BATCH + 2])
def test_the_float_graphs_draw_what_torch_draws(resolution: int, count: int) -> None:
    made = network(resolution)
    drawn = StreamingGraphs(made, None, 1).draw(*stream(count, count))
    np.testing.assert_allclose(drawn, by_torch(made, *stream(count, count)), atol=2e-5)


def test_no_objects_leave_the_empty_state() -> None:
    made = network(8)
    level = made.stages["8"]
    empty = level.pixels(torch.zeros(1, level.cell.filters, 8, 8))[0].permute(1, 2, 0).numpy()
    nothing = np.zeros((0, VECTOR), np.float32), np.zeros(0, np.int8)
    np.testing.assert_allclose(StreamingGraphs(made, None, 1).draw(*nothing), empty, atol=2e-5)
    ranges = calibrate(made, [stream(0)])
    np.testing.assert_allclose(StreamingGraphs(made, ranges, 1).draw(*nothing), empty.clip(0, 1), atol=0.05)


def test_a_deconvolution_is_a_convolution_to_four_corners() -> None:
    g = torch.Generator().manual_seed(1)
    x, w = torch.randn(2, 3, 5, 5, generator=g), torch.randn(3, 4, 4, 4, generator=g)
    wide = conv2d(pad(x, (1, 1, 1, 1)), torch.from_numpy(spread_kernels(w.numpy())))
    found = torch.empty(2, 4, 10, 10)
    for a in (0, 1):
        for b in (0, 1):
            first = (2 * a + b) * 4
            found[:, :, a::2, b::2] = wide[:, first : first + 4, a : a + 5, b : b + 5]
    torch.testing.assert_close(found, conv_transpose2d(x, w, stride=2, padding=1), atol=1e-5, rtol=1e-5)


# ---------------------------------------------------------------- 8 bits, by loops over whole numbers


def rounded(x: np.ndarray, step: float, zero: int) -> np.ndarray:
    return np.clip(np.rint(np.asarray(x, np.float64) / np.float32(step)) + zero, 0, 255)


def whole_conv(
    x: np.ndarray, zero: int, step: float, w: np.ndarray, b: np.ndarray, padding: int
) -> np.ndarray:
    """Sums of an 8-bit convolution of maps (C, H, W) in float64, from whole numbers, without any library."""
    steps, kernels = integer_kernels(w)
    unit = steps.astype(np.float64) * np.float32(step)
    x = np.pad(x - zero, ((0, 0), (padding, padding), (padding, padding)))
    size = w.shape[2]
    high, wide = x.shape[1] - size + 1, x.shape[2] - size + 1
    total = np.zeros((len(w), high, wide))
    for i in range(size):
        for j in range(size):
            total += np.tensordot(kernels[:, :, i, j].astype(np.float64), x[:, i : i + high, j : j + wide], 1)
    total += np.rint(b / unit.astype(np.float32))[:, None, None]
    return total * unit[:, None, None]


def emulated(made: Streaming, ranges: Ranges, vectors: np.ndarray, tokens: np.ndarray) -> np.ndarray:
    """`StreamingGraphs.draw` in 8 bits, one object after the other."""
    config = made.config
    r, f = config.resolution, config.filters(config.resolution)
    level = made.stages[str(r)]
    gates = level.cell.gates.weight.numpy()
    hidden, cell = np.full((f, r, r), 128.0), np.zeros((f, r, r))

    def sigmoid(v: np.ndarray) -> np.ndarray:
        return 1 / (1 + np.exp(-v))

    for vector, token in zip(vectors, tokens, strict=True):
        x = torch.from_numpy(vector)[None, :, None, None]
        maps = None
        for i, layer in enumerate(made.deconvolutions):
            if config.levels[i] <= 8:
                x = torch.relu(layer(x))
                if config.levels[i] == 8:
                    maps = rounded(x[0].numpy() / ranges.maps[i][:, None, None], 1 / 255, 0)
            else:
                assert maps is not None
                w = layer.weight.numpy() * ranges.maps[i - 1][:, None, None, None]
                w = w / ranges.maps[i][:, None, None]
                size = config.levels[i]
                wide = whole_conv(
                    maps, 0, 1 / 255, spread_kernels(w), np.tile(layer.bias.numpy() / ranges.maps[i], 4), 1
                )
                wide = rounded(wide.clip(0), 1 / 255, 0).reshape(4, -1, size // 2 + 1, size // 2 + 1)
                maps = np.empty((wide.shape[1], size, size))
                for a in (0, 1):
                    for b in (0, 1):
                        corner = wide[2 * a + b, :, a : a + size // 2, b : b + size // 2]
                        maps[:, a::2, b::2] = corner
        marks = np.zeros((TOKENS, r, r))
        marks[token] = 255
        own = gates[:, : f + TOKENS] * np.concatenate([ranges.maps[-1], np.ones(TOKENS)])[:, None, None]
        own = own.astype(np.float32)
        unit = ranges.object_gates / 127
        sums = whole_conv(np.concatenate([maps, marks]), 0, 1 / 255, own, level.cell.gates.bias.numpy(), 2)
        total = (rounded(sums, unit, 128) - 128) * np.float32(unit)
        if (hidden != 128).any():
            unit = ranges.hidden_gates / 127
            more = whole_conv(hidden, 128, 1 / 127, gates[:, f + TOKENS :], np.zeros(4 * f), 2)
            total += (rounded(more, unit, 128) - 128) * np.float32(unit)
        i, keep, o, new = np.split(total, 4)
        cell = sigmoid(keep) * cell + sigmoid(i) * np.tanh(new)
        hidden = rounded(sigmoid(o) * np.tanh(cell), 1 / 127, 128)
    y, zero, step, before = hidden, 128, 1 / 127, np.ones(f)
    for k, layer in enumerate(level.pixels[i] for i in (0, 2, 4)):
        after = ranges.pixels[k][:, None] if k < 2 else np.ones((3, 1))
        w = layer.weight.numpy()[..., 0, 0] * before / after
        sums = whole_conv(
            y, zero, step, w[:, :, None, None].astype(np.float32), layer.bias.numpy() / after[:, 0], 0
        )
        y, zero, step, before = rounded(sums.clip(0), 1 / 255, 0), 0, 1 / 255, after[:, 0]
    return np.moveaxis(y, 0, 2) / 255


@pytest.mark.parametrize("resolution", [8, 16, 32])
def test_eight_bits_are_what_whole_numbers_give(resolution: int) -> None:
    made = network(resolution)
    ranges = calibrate(made, [stream(s) for s in range(4)])
    for seed in (0, 7):  # seen in calibration, and not
        drawn = StreamingGraphs(made, ranges, 1).draw(*stream(seed))
        off = np.abs(drawn - emulated(made, ranges, *stream(seed))) * 255
        # a sum that lies between two steps may fall on either side, as float32 and float64 round
        assert off.max() <= 2.01
        assert (off > 0.01).mean() < 0.05


def test_eight_bits_stay_near_float32() -> None:
    made = network(16, 1 / 8, gates=3.0)
    streams = [stream(s) for s in range(6)]
    ranges = tune(made, streams, calibrate(made, streams))
    graphs = StreamingGraphs(made, ranges, 1)
    for seed in range(20, 26):
        gap = graphs.draw(*stream(seed)) - by_torch(made, *stream(seed)).clip(0, 1)
        assert float(np.sqrt(np.square(gap).mean())) < 0.05  # colours spread by 0.2


def test_channels_of_very_different_size_keep_their_steps() -> None:
    """A channel's own range is used: scaling one up and its readers down changes nothing."""
    made, other = network(16), network(16)
    before, after = other.deconvolutions[2], other.deconvolutions[3]
    before.weight[:, 0] *= 512
    before.bias[0] *= 512
    after.weight[0] /= 512
    drawn = [StreamingGraphs(m, calibrate(m, [stream(3)]), 1).draw(*stream(3)) for m in (made, other)]
    np.testing.assert_allclose(drawn[0], drawn[1], atol=1.01 / 255)


def test_threads_change_no_pixel() -> None:
    made = network(32)
    ranges = calibrate(made, [stream(0)])
    one, two = (StreamingGraphs(made, ranges, threads).draw(*stream(0)) for threads in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_a_bias_beyond_32_bits_is_cut_not_wrapped() -> None:
    nodes = Nodes()
    nodes.weights(np.full((1, 1, 1, 1), 1e-9, np.float32), np.array([1e9], np.float32), 1 / 255)
    (bias,) = (v for v in nodes.constants.values() if v.dtype == np.int32 and v.any())
    assert bias[0] == 2**30


# ---------------------------------------------------------------- ranges in files

DIGEST = "ab" * 32


@pytest.fixture
def saved(tmp_path: Path) -> tuple[Path, Streaming, Ranges]:
    made = network(8)
    ranges = calibrate(made, [stream(0)])
    save_ranges(tmp_path / "int8.safetensors", ranges, DIGEST, {"scenes": 1})
    return tmp_path / "int8.safetensors", made, ranges


def test_ranges_come_back(saved: tuple[Path, Streaming, Ranges]) -> None:
    path, made, ranges = saved
    found = load_ranges(path, made, DIGEST)
    assert found.object_gates == pytest.approx(ranges.object_gates)
    assert found.hidden_gates == pytest.approx(ranges.hidden_gates)
    for a, b in zip(found.maps + found.pixels, ranges.maps + ranges.pixels, strict=True):
        np.testing.assert_array_equal(a, b)


def test_ranges_of_other_weights_are_refused(saved: tuple[Path, Streaming, Ranges]) -> None:
    with pytest.raises(RenderError, match="other weights: calibrate again"):
        load_ranges(saved[0], saved[1], "cd" * 32)


def test_ranges_of_another_network_are_refused(saved: tuple[Path, Streaming, Ranges]) -> None:
    with pytest.raises(RenderError, match="damaged ranges for int8: "):
        load_ranges(saved[0], network(16), DIGEST)


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, 0.0, 1e30])
def test_ranges_that_are_none_are_refused(saved: tuple[Path, Streaming, Ranges], value: float) -> None:
    path, made, ranges = saved
    save_ranges(path, Ranges(ranges.maps, value, 1.0, ranges.pixels), DIGEST, {})
    with pytest.raises(RenderError, match="`gates` holds what is no range"):
        load_ranges(path, made, DIGEST)


@pytest.mark.parametrize("cut", [0, 4, 40, -5])
def test_cut_files_are_refused(saved: tuple[Path, Streaming, Ranges], cut: int) -> None:
    path, made, _ = saved
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(RenderError, match="damaged ranges for int8"):
        load_ranges(path, made, DIGEST)


def test_a_header_without_end_is_refused(saved: tuple[Path, Streaming, Ranges]) -> None:
    path, made, _ = saved
    path.write_bytes(struct.pack("<Q", 1 << 60) + b"{}")
    with pytest.raises(RenderError, match="damaged ranges for int8"):
        load_ranges(path, made, DIGEST)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(RenderError, match="cannot read the ranges for int8: no such file"):
        load_ranges(tmp_path / "none.safetensors", network(8), DIGEST)


def test_a_missing_package_is_told_with_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(onnx_session.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RenderError, match=r"pip install 'scenelang\[int8\]'"):
        Nodes().session(1)
