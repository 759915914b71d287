"""The framed renderer with its decoder in 8 bits, to measure what that costs; `scenelang render` offers none.

The decoder's large layer, G x G, takes an 8-bit product and hands on 8 bits; its first layer sees coordinates
and its last one answers distances, which stay in float32. Channels are divided by the largest value they
take over the disc that the decoder sees. Frames, cell and register stay as they are: they are not products.

What was found (`docs/frontier.md`): a tenth of a frame is in that product, so that nothing is gained, and
distances of 8 bits move outlines by a part of a pixel, which costs far more than 1 dB.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from scenelang.backend.onnx_session import Nodes
from scenelang.renderers.framed import RADIUS
from scenelang.renderers.stream import Stream, _Row

Floats = npt.NDArray[np.float32]
_POINTS = 8192
_SESSIONS = 64


class EightBitStream(Stream):
    """`Stream` with 8-bit decoders."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._decoders: dict[int, Any] = {}

    def _layers(self, x: Tensor, row: _Row) -> Tensor:
        decoder = self._decoders.get(id(row.layers))
        if decoder is None:
            decoder = _decoder([v.numpy() for layer in row.layers for v in layer])
            self._decoders[id(row.layers)] = decoder
        return torch.from_numpy(decoder.run(None, {"points": x.numpy()})[0])


_known: dict[bytes, Any] = {}


def _decoder(arrays: list[Floats]) -> Any:
    """A session for a decoder; its last bits depend on the leaves it was made with and do not count."""
    key = b"".join(a.astype(np.float16).tobytes() for a in arrays)
    if key not in _known:
        if len(_known) >= _SESSIONS:
            _known.clear()
        _known[key] = _session(arrays)
    return _known[key]


def _session(arrays: list[Floats]) -> Any:
    """Points (m, 2) to features (m, F)."""
    w1, w2, w3 = arrays[::2]
    b1, b2, b3 = arrays[1::2]
    rng = np.random.default_rng(1)
    angle, far = rng.uniform(0, 2 * np.pi, _POINTS), RADIUS * np.sqrt(rng.uniform(0, 1, _POINTS))
    points = np.stack([far * np.cos(angle), far * np.sin(angle)]).astype(np.float32)
    first = np.maximum(w1 @ points + b1[:, None], 0)
    second = np.maximum(w2 @ first + b2[:, None], 0)
    top1, top2 = (np.maximum(v.max(1), 1e-6) for v in (first, second))
    nodes = Nodes()
    x = nodes.input("points", "float32", (None, 2))
    x = _plain(nodes, x, w1 / top1[:, None], b1 / top1)
    x = nodes.quantise(nodes.add("Relu", x), 1 / 255, 0)
    kernels = nodes.weights(w2 * top1 / top2[:, None], b2 / top2, 1 / 255)
    x = nodes.add("Gemm", nodes.dequantise(x, 1 / 255, 0), *kernels, transB=1)
    x = nodes.quantise(nodes.add("Relu", x), 1 / 255, 0)
    x = _plain(nodes, nodes.dequantise(x, 1 / 255, 0), w3 * top2, b3)
    nodes.output("features", "float32", (None, len(b3)), x)
    return nodes.session(1)


def _plain(nodes: Nodes, x: str, w: Floats, b: Floats) -> str:
    return nodes.add("Gemm", x, nodes.constant(w, np.float32), nodes.constant(b, np.float32), transB=1)
