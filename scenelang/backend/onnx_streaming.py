"""The streaming renderer in 8 bits: the network of `scenelang.renderers.streaming` as onnxruntime graphs.

The graphs are made from the model's own weights and the ranges that calibration found; no graph is stored.
Kernels are int8 with a step for each output channel, activations uint8. Each channel of a map is divided by
the largest value that calibration saw in it, which a rectified linear unit lets through to the next layer's
kernels, so that every channel uses all 256 levels. In float32 stay: the deconvolutions up to 8 x 8, which
cost nothing and see vectors of any size, the gates' nonlinearities and the LSTM's cell. The picture leaves as
the 8-bit values that are saved.

Two things are written another way, exactly:

- a 4 x 4 deconvolution of stride 2 is a 2 x 2 convolution to four times the channels, one group for each
  corner of the 2 x 2 pixels that an input pixel becomes, cut and interleaved; onnxruntime has no 8-bit
  deconvolution;
- the convolution over [map, token, hidden] is the sum of one over [map, token], which all objects share in
  one batch, and one over the hidden state, which the first object does not need, as it meets zeros.

Letters: N objects, D numbers of an object, F filters, R pixels along a side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.backend.onnx_session import Nodes
from scenelang.renderers.streaming import TOKENS, Level, Streaming

Floats = npt.NDArray[np.float32]
PLAIN: Final = 8  # pixels along a side up to which deconvolutions stay in float32
BATCH: Final = 8  # objects whose maps are computed together
_LEVELS: Final = 255
_SIGNED: Final = 127, 128  # steps on either side, and where zero lies


@dataclass(frozen=True, slots=True)
class Ranges:
    """What calibration saw.

    Args:
        maps: largest value of each channel (F,) after each deconvolution.
        object_gates, hidden_gates: largest absolute value of the two sums in front of the gates.
        pixels: largest value of each channel (F,) after the first two layers of the pixel generator.
    """

    maps: tuple[Floats, ...]
    object_gates: float
    hidden_gates: float
    pixels: tuple[Floats, Floats]


class StreamingGraphs:
    """The network as three graphs: objects to sums before the gates, the LSTM's cell, the pixels.

    Args:
        network: trained parameters.
        ranges: from calibration; None makes the same graphs in float32.
        threads: cores that they compute on.
    """

    def __init__(self, network: Streaming, ranges: Ranges | None, threads: int) -> None:
        config = network.config
        self.resolution, self.filters = config.resolution, config.filters(config.resolution)
        level = network.stages[str(config.resolution)]
        assert isinstance(level, Level)
        self.eight = ranges is not None
        self.kind = "uint8" if self.eight else "float32"
        self._objects = _objects(network, level, ranges).session(threads)
        self._first = _cell(level, ranges, self.resolution, first=True).session(threads)
        self._next = _cell(level, ranges, self.resolution, first=False).session(threads)
        self._pixels = _pixels(level, ranges, self.resolution).session(threads)

    def draw(self, vectors: Floats, tokens: npt.NDArray[np.int8]) -> Floats:
        """The picture (R, R, 3) over white of a stream.

        Args:
            vectors: (N, D).
            tokens: (N,).
        """
        shape = 1, self.filters, self.resolution, self.resolution
        hidden: npt.NDArray[Any] = np.full(shape, _SIGNED[1] if self.eight else 0, self.kind)
        cell = np.zeros(shape, np.float32)
        for start in range(0, len(vectors), BATCH):
            part = slice(start, start + BATCH)
            marks = (tokens[part, None] == np.arange(TOKENS)) * (_LEVELS if self.eight else 1)
            feeds = {
                "vectors": np.ascontiguousarray(vectors[part, :, None, None], np.float32),
                "marks": marks[:, :, None, None].astype(self.kind),
            }
            (sums,) = self._objects.run(None, feeds)  # (n, 4 F, R, R)
            for i in range(len(sums)):
                if start + i == 0:
                    hidden, cell = self._first.run(None, {"sums": sums[:1]})
                else:
                    state = {"sums": sums[i : i + 1], "hidden": hidden, "cell": cell}
                    hidden, cell = self._next.run(None, state)
        (picture,) = self._pixels.run(None, {"hidden": hidden})
        found: Floats = np.moveaxis(picture[0], 0, 2).astype(np.float32)
        if self.eight:
            found /= _LEVELS
        return found


def _array(tensor: Any) -> Floats:
    found: Floats = tensor.detach().cpu().numpy().astype(np.float32)
    return found


def spread_kernels(w: Floats) -> Floats:
    """Kernels (4 F', F, 2, 2) of the convolution that a deconvolution (F, F', 4, 4), stride 2, padding 1, is.

    Row a and column b of the pixels that an input pixel becomes are outputs (2 a + b) F' to (2 a + b + 1) F',
    found a pixel further down for a = 1, to the right for b = 1.
    """
    taps = {0: (3, 1), 1: (2, 0)}  # of the pixels before and at this place
    found = [w[:, :, taps[a]][:, :, :, taps[b]].transpose(1, 0, 2, 3) for a in (0, 1) for b in (0, 1)]
    return np.concatenate(found)


def _objects(network: Streaming, level: Level, ranges: Ranges | None) -> Nodes:
    """Vectors and tokens to the objects' part of the sums before the gates (N, 4 F, R, R)."""
    nodes = Nodes()
    config = network.config
    r = config.resolution
    plain = min(PLAIN, r)
    x = nodes.input("vectors", "float32", (None, config.vector, 1, 1))
    marks = nodes.input("marks", "uint8" if ranges else "float32", (None, TOKENS, 1, 1))
    before: Floats | None = None  # what the channels of x were divided by
    for i, (size, layer) in enumerate(zip(config.levels, network.deconvolutions, strict=True)):
        w, b = _array(layer.weight), _array(layer.bias)
        if before is not None:
            w = w * before[:, None, None, None]
        if ranges is not None and size >= plain:
            w, b = w / ranges.maps[i][:, None, None], b / ranges.maps[i]
            before = ranges.maps[i]
        if ranges is None or size <= plain:
            kernel, bias = nodes.constant(w, np.float32), nodes.constant(b, np.float32)
            x = nodes.add("ConvTranspose", x, kernel, bias, strides=[2, 2], pads=[1] * 4, kernel_shape=[4, 4])
            x = nodes.add("Relu", x)
            if ranges is not None and size == plain:
                x = nodes.quantise(x, 1 / _LEVELS, 0)
        else:
            x = _spread(nodes, x, w, b, size // 2)
    wide = nodes.add("Expand", marks, nodes.constant([1, 1, r, r], np.int64))
    x = nodes.add("Concat", x, wide, axis=1)
    f = level.cell.filters
    w, b = _array(level.cell.gates.weight)[:, : f + TOKENS], _array(level.cell.gates.bias)
    if before is not None:
        w = w * np.concatenate([before, np.ones(TOKENS, np.float32)])[:, None, None]
    limit = ranges.object_gates if ranges is not None else None
    x = _convolve(nodes, x, w, b, 1 / _LEVELS, 0, limit, pads=2)
    nodes.output("sums", "uint8" if ranges else "float32", (None, 4 * f, r, r), x)
    return nodes


def _spread(nodes: Nodes, x: str, w: Floats, b: Floats, size: int) -> str:
    """An 8-bit deconvolution of maps (N, F, size, size), with its rectified linear units."""
    f = w.shape[1]
    step = 1 / _LEVELS
    kernels = nodes.weights(spread_kernels(w), np.tile(b, 4), step)
    y = nodes.add("Conv", nodes.dequantise(x, step, 0), *kernels, pads=[1] * 4, kernel_shape=[2, 2])
    y = nodes.quantise(nodes.add("Relu", y), step, 0)  # (N, 4 F', size + 1, size + 1)
    parts = []
    axes = nodes.constant([1, 2, 3], np.int64)
    for a in (0, 1):
        for column in (0, 1):
            first = (2 * a + column) * f
            starts = nodes.constant([first, a, column], np.int64)
            ends = nodes.constant([first + f, a + size, column + size], np.int64)
            parts.append(nodes.add("Slice", y, starts, ends, axes))
    return nodes.add("DepthToSpace", nodes.add("Concat", *parts, axis=1), blocksize=2, mode="DCR")


def _convolve(
    nodes: Nodes,
    x: str,
    w: Floats,
    b: Floats | None,
    step: float,
    zero: int,
    limit: float | None,
    pads: int = 0,
) -> str:
    """A convolution; in 8 bits, to steps about zero up to ±limit, where there is a limit."""
    size = list(w.shape[2:])
    if limit is None:
        kernels = [nodes.constant(w, np.float32)] + ([nodes.constant(b, np.float32)] if b is not None else [])
        return nodes.add("Conv", x, *kernels, pads=[pads] * 4, kernel_shape=size)
    x = nodes.dequantise(x, step, zero)
    y = nodes.add("Conv", x, *nodes.weights(w, b, step), pads=[pads] * 4, kernel_shape=size)
    return nodes.quantise(y, limit / _SIGNED[0], _SIGNED[1])


def _cell(level: Level, ranges: Ranges | None, r: int, *, first: bool) -> Nodes:
    """One object's sums, and the state before it unless it is the first, to the state after it."""
    nodes = Nodes()
    f = level.cell.filters
    kind = "uint8" if ranges else "float32"
    sums = nodes.input("sums", kind, (1, 4 * f, r, r))
    if ranges is not None:
        sums = nodes.dequantise(sums, ranges.object_gates / _SIGNED[0], _SIGNED[1])
    if not first:
        hidden, cell = nodes.input("hidden", kind, (1, f, r, r)), nodes.input("cell", "float32", (1, f, r, r))
        w = _array(level.cell.gates.weight)[:, f + TOKENS :]
        limit = ranges.hidden_gates if ranges is not None else None
        more = _convolve(nodes, hidden, w, None, 1 / _SIGNED[0], _SIGNED[1], limit, pads=2)
        if limit is not None:
            more = nodes.dequantise(more, limit / _SIGNED[0], _SIGNED[1])
        sums = nodes.add("Add", sums, more)
    i, g, o, c = nodes.split("Split", 4, sums, axis=1, num_outputs=4)
    new = nodes.add("Mul", nodes.add("Sigmoid", i), nodes.add("Tanh", c))
    if not first:
        new = nodes.add("Add", nodes.add("Mul", nodes.add("Sigmoid", g), cell), new)
    shown = nodes.add("Mul", nodes.add("Sigmoid", o), nodes.add("Tanh", new))
    if ranges is not None:
        shown = nodes.quantise(shown, 1 / _SIGNED[0], _SIGNED[1])
    nodes.output("shown", kind, (1, f, r, r), shown)
    nodes.output("new", "float32", (1, f, r, r), new)
    return nodes


def _pixels(level: Level, ranges: Ranges | None, r: int) -> Nodes:
    """The last hidden state to a picture (1, 3, R, R)."""
    nodes = Nodes()
    x = nodes.input("hidden", "uint8" if ranges else "float32", (1, level.cell.filters, r, r))
    step, zero = 1 / _SIGNED[0], _SIGNED[1]
    before: Floats | None = None
    layers = [level.pixels[i] for i in (0, 2, 4)]
    for i, layer in enumerate(layers):
        w, b = _array(layer.weight), _array(layer.bias)
        if ranges is not None and before is not None:
            w = w * before[:, None, None]
        if ranges is not None and i < 2:
            before = ranges.pixels[i]
            w, b = w / before[:, None, None, None], b / before
        if ranges is None:
            x = _convolve(nodes, x, w, b, step, zero, None)
        else:
            x = nodes.add(
                "Conv", nodes.dequantise(x, step, zero), *nodes.weights(w, b, step), kernel_shape=[1, 1]
            )
        if i < 2:
            x = nodes.add("Relu", x)
        if ranges is not None:  # the last to 8-bit colours, which saturate at black and white
            step, zero = 1 / _LEVELS, 0
            x = nodes.quantise(x, step, zero)
    nodes.output("picture", "uint8" if ranges else "float32", (1, 3, r, r), x)
    return nodes
