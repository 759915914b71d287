"""Ranges of activations for 8 bits: found on random scenes, kept beside the weights they belong to.

The file is safetensors: an array for each range and, in the header, the digest of the weights, so that
ranges of other weights are never used.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.nn.functional import conv2d, one_hot

from scenelang.backend.errors import RenderError
from scenelang.backend.onnx_streaming import Ranges, StreamingGraphs
from scenelang.files import read_json, read_regular, write_whole
from scenelang.renderers.streaming import TOKENS, Level, Streaming

FORMAT: Final = 1
MOST_BYTES: Final = 1 << 20
MOST: Final = 1e6  # no activation of a trained network is larger
_LEAST: Final = 1e-6  # channels that never answer
_SHARES: Final = (1.0, 0.7, 0.5, 0.35, 0.25)  # of the largest sum, beyond which gates are nearly saturated

Stream = tuple[npt.NDArray[np.float32], npt.NDArray[np.int8]]


@torch.no_grad()
def calibrate(network: Streaming, streams: Iterable[Stream]) -> Ranges:
    """Run streams through the network in float32 and note how large its activations get.

    Args:
        network: trained parameters, on the CPU.
        streams: vectors (N, D) and tokens (N,) of scenes like those of the training.
    """
    config = network.config
    level = network.stages[str(config.resolution)]
    assert isinstance(level, Level)
    f = level.cell.filters
    maps = [torch.full((config.filters(r),), _LEAST) for r in config.levels]
    pixels = [torch.full((f,), _LEAST) for _ in range(2)]
    gates = [_LEAST, _LEAST]
    w, b = level.cell.gates.weight, level.cell.gates.bias
    for vectors, tokens in streams:
        x = torch.from_numpy(np.array(vectors, np.float32))[:, :, None, None]
        for i, deconvolution in enumerate(network.deconvolutions):
            x = torch.relu(deconvolution(x))
            maps[i] = torch.maximum(maps[i], x.amax((0, 2, 3)))
        marks = one_hot(torch.from_numpy(np.array(tokens, np.int64)), TOKENS).float()[:, :, None, None]
        x = torch.cat([x, marks.expand(-1, -1, *x.shape[2:])], 1)
        sums = conv2d(x, w[:, : f + TOKENS], b, padding=2)  # (N, 4 F, R, R)
        gates[0] = max(gates[0], float(sums.abs().max()))
        hidden, cell = torch.zeros_like(x[:1, :f]), torch.zeros_like(x[:1, :f])
        for n in range(len(x)):
            more = conv2d(hidden, w[:, f + TOKENS :], padding=2)
            gates[1] = max(gates[1], float(more.abs().max()))
            take, keep, o, new = (sums[n : n + 1] + more).chunk(4, 1)
            cell = keep.sigmoid() * cell + take.sigmoid() * new.tanh()
            hidden = o.sigmoid() * cell.tanh()
        y = hidden
        for k, layer in enumerate(list(level.pixels)[:4]):
            y = layer(y)
            if k % 2:
                pixels[k // 2] = torch.maximum(pixels[k // 2], y.amax((0, 2, 3)))
    return Ranges(tuple(map(_numbers, maps)), gates[0], gates[1], (_numbers(pixels[0]), _numbers(pixels[1])))


def tune(network: Streaming, streams: Sequence[Stream], ranges: Ranges) -> Ranges:
    """Cut the ranges of the sums before the gates to where the pictures come nearest to those of float32.

    Few sums are as large as the largest, and gates are open or shut long before: finer steps about zero are
    worth more.

    Args:
        network: trained parameters, on the CPU.
        streams: as for `calibrate`.
        ranges: from `calibrate`.
    """
    plain = StreamingGraphs(network, None, 1)
    wanted = [plain.draw(*stream).clip(0.0, 1.0) for stream in streams]

    def error(tried: Ranges) -> float:
        graphs = StreamingGraphs(network, tried, 1)
        return float(
            sum(
                np.square(graphs.draw(*s) - picture).mean()
                for s, picture in zip(streams, wanted, strict=True)
            )
        )

    for name in ("object_gates", "hidden_gates"):
        most: float = getattr(ranges, name)
        tried = [replace(ranges, **{name: share * most}) for share in _SHARES]  # type: ignore[arg-type]
        ranges = min(tried, key=error)
    return ranges


def _numbers(values: Tensor) -> npt.NDArray[np.float32]:
    found: npt.NDArray[np.float32] = values.numpy().astype(np.float32)
    return found


def save_ranges(path: Path, ranges: Ranges, weights: str, about: dict[str, Any]) -> None:
    """Write ranges, whole or not at all.

    Args:
        path: the file.
        ranges: from `calibrate`.
        weights: SHA-256 of the weights they belong to, hex.
        about: of which scenes, for people.
    """
    from safetensors.numpy import save

    header = {"format": FORMAT, "weights": weights, **about}
    data = save(_arrays(ranges), {"scenelang": json.dumps(header, sort_keys=True)})
    write_whole(path, data)


def _arrays(ranges: Ranges) -> dict[str, npt.NDArray[np.float32]]:
    found = {f"maps.{i}": values for i, values in enumerate(ranges.maps)}
    found |= {f"pixels.{i}": values for i, values in enumerate(ranges.pixels)}
    return found | {"gates": np.array([ranges.object_gates, ranges.hidden_gates], np.float32)}


def load_ranges(path: Path, network: Streaming, weights: str) -> Ranges:
    """Read ranges as if a stranger had written them.

    Args:
        path: the file.
        network: what they are for.
        weights: SHA-256 of its weights, hex.

    Raises:
        RenderError: they cannot be read, are damaged or belong to other weights.
    """
    from safetensors import safe_open
    from safetensors.numpy import load

    try:
        data = read_regular(path, MOST_BYTES)
        if len(data) > MOST_BYTES:
            raise ValueError(f"more than {MOST_BYTES:,} bytes")
        arrays = load(data)
        with safe_open(path, "numpy") as file:
            header = read_json((file.metadata() or {})["scenelang"].encode())
        if header["format"] != FORMAT:
            raise ValueError("another format")
        if header["weights"] != weights:
            raise RenderError("its ranges for int8 were found with other weights: calibrate again")
        return _checked(arrays, network)
    except OSError as error:
        raise RenderError(
            f"cannot read the ranges for int8: {(error.strerror or str(error)).lower()}"
        ) from None
    except RenderError:
        raise
    except Exception as error:  # safetensors raises a class of its own
        raise RenderError(f"damaged ranges for int8: {' '.join(str(error).split())[:200]}") from None


def _checked(arrays: dict[str, npt.NDArray[Any]], network: Streaming) -> Ranges:
    config = network.config
    f = config.filters(config.resolution)
    shapes = {f"maps.{i}": (config.filters(r),) for i, r in enumerate(config.levels)}
    shapes |= {"pixels.0": (f,), "pixels.1": (f,), "gates": (2,)}
    if arrays.keys() != shapes.keys():
        raise ValueError("ranges are missing or unknown")
    for name, shape in shapes.items():
        values = arrays[name]
        if values.dtype != np.float32 or values.shape != shape:
            raise ValueError(f"`{name}` is {values.dtype} {values.shape}, not float32 {shape}")
        if not bool(((values > 0) & (values <= MOST)).all()):
            raise ValueError(f"`{name}` holds what is no range")
    maps = tuple(arrays[f"maps.{i}"] for i in range(len(config.levels)))
    gates = arrays["gates"].tolist()
    return Ranges(maps, gates[0], gates[1], (arrays["pixels.0"], arrays["pixels.1"]))
