"""Models in torch: the networks' parameters, read from weights files, ready to draw or to be trained."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from scenelang.compiler.lifting import WIDTH
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.weights import (
    LIFTING,
    Codes,
    ModelError,
    check_shapes,
    codes_of,
    manifest_of,
    open_weights,
    shipped_weights,
)
from scenelang.drawing.arrays_torch import TORCH
from scenelang.drawing.neural.files import MOST_WIDTH, sizes_of
from scenelang.drawing.neural.network import FramedConfig, FramedNetwork, parameter_shapes
from scenelang.drawing.neural.paper import Reading, ReadingConfig, Streaming, StreamingConfig
from scenelang.drawing.solid.network import SolidConfig, SolidNetwork, solid_shapes

RENDERER = "renderer."
"""In front of the names of a renderer's tensors, where a file holds it beside a lifting's."""


class _Parameters(nn.Module):
    """Parameters of shapes by name, at random; ``name.0`` and so on are a list."""

    codes: nn.Parameter
    cell_lines: nn.Parameter
    cell_gain: nn.Parameter
    cell_bias: nn.Parameter
    candidate: nn.Parameter
    bump: nn.Parameter

    def __init__(self, code: int, shapes: Mapping[str, tuple[int, ...]]) -> None:
        super().__init__()
        stacks: dict[str, list[nn.Parameter]] = {"segment_w": [], "segment_b": []}
        for name, shape in shapes.items():
            group, _, index = name.partition(".")
            fan = (code + 1) * (shape[1] if index in ("1", "2") else 1)
            value = torch.randn(shape)
            if index:
                scale = fan**-0.5 if group.endswith("w") else 0.3
                stacks.setdefault(group, []).append(nn.Parameter(value * scale))
            else:
                setattr(self, name, nn.Parameter(value))
        for name, layers in stacks.items():
            setattr(self, name, nn.ParameterList(layers))
        with torch.no_grad():  # gates begin in their linear range
            self.cell_lines.mul_(0.3)
            self.cell_gain.zero_()
            self.cell_bias.fill_(0.5)
            self.bump.zero_()
            self.candidate.mul_(0.3)


class Framed(_Parameters, FramedNetwork):
    """The framed renderer of so many geometry and material codes, in torch."""

    xp = TORCH

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        super().__init__(config.code, parameter_shapes(config, geometries, materials))
        self.config = config


class Solids(_Parameters, SolidNetwork):
    """The solids' renderer of so many geometry and material codes, in torch."""

    xp = TORCH

    def __init__(self, config: SolidConfig, geometries: int, materials: int) -> None:
        super().__init__(config.code, solid_shapes(config, geometries, materials))
        self.config = config


Network = Framed | Solids | Streaming | Reading


@dataclass(frozen=True, slots=True)
class Model:
    """A model that draws Programs."""

    manifest: Manifest
    network: Network  # the trained network, in evaluation mode, without gradients
    codes: Codes  # of its weights, as `compile_scene` takes them
    header: dict[str, Any]  # how the weights were trained (config, seed, revision, budget)

    @property
    def digest(self) -> str:
        """SHA-256 of the weights file, hex."""
        return self.codes.digest

    @property
    def framed(self) -> Framed:
        """The network that meets objects in their frames; `ModelError` where there is none."""
        if not isinstance(self.network, Framed):
            raise ModelError(f"model `{self.manifest.name}` has no framed renderer")
        return self.network


def load_network(data: bytes, manifest: Manifest, device: str = "cpu") -> Network:
    """Build the network of a weights file; `ModelError` where it does not fit the manifest or itself."""
    header, arrays = open_weights(data)
    if (make := _MAKERS.get(manifest.renderer)) is None:
        raise ModelError(f"an unknown renderer `{manifest.renderer}`")
    try:
        with torch.random.fork_rng(devices=[]):
            # Not on the meta device, which takes no memory but 1.8 s to import what it stands on.
            network = make(header["config"], manifest, len(data))
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ModelError(f"bad network sizes: {error}") from None
    if not isinstance(network, Framed | Solids):
        arrays = {
            name.removeprefix(RENDERER): array.astype(np.float32) if array.dtype == np.float16 else array
            for name, array in arrays.items()
            if not name.startswith(LIFTING)
        }
    check_shapes(arrays, {name: tuple(held.shape) for name, held in network.state_dict().items()})
    network.load_state_dict({k: torch.from_numpy(array) for k, array in arrays.items()}, assign=True)
    return network.requires_grad_(False).eval().to(device)


def _streaming(config: dict[str, Any], manifest: Manifest, size: int) -> Streaming:
    known = StreamingConfig(**{**config["student"]["streaming"], "vector": WIDTH})
    if manifest.sizes != ((known.resolution, known.resolution),):
        raise ModelError(f"a network for {known.resolution} pixels, which the manifest does not say")
    filters = known.filters(known.resolution)
    if 2 * 25 * (2 * filters + 4) * 4 * filters > size:  # in half precision
        raise ModelError("a network larger than its file")
    return Streaming(known)


def _reading(config: dict[str, Any], manifest: Manifest, size: int) -> Reading:
    sizes = {**config["student"]["reading"], "vector": WIDTH}
    if any(type(v) is not int or not (k != "leaves") <= v <= MOST_WIDTH for k, v in sizes.items()):
        raise ModelError("a network size is out of range")
    known = ReadingConfig(**sizes)
    if 4 * 9 * known.hidden**2 > size or known.reads > 64 or known.octaves > 16:
        raise ModelError("a network larger than its file, or that reads too often")
    return Reading(known)


_Make = Callable[[dict[str, Any], Manifest, int], Network]
_MAKERS: dict[str, _Make] = {
    "framed": lambda c, m, size: Framed(sizes_of(FramedConfig, c, size), len(m.geometries), len(m.materials)),
    "solid": lambda c, m, size: Solids(sizes_of(SolidConfig, c, size), len(m.geometries), len(m.materials)),
    "streaming": _streaming,
    "reading": _reading,
}


def load_model(name: str, device: str = "cpu", path: Path | None = None, weights: str = "") -> Model:
    """Load a shipped model, or weights at ``path``; raises and takes ``weights`` as `load_arrays`."""
    manifest, data = manifest_of(name, weights, path), shipped_weights(name, weights, path)
    network, codes = load_network(data, manifest, device), codes_of(manifest, data)
    return Model(manifest, network, codes, open_weights(data).header)


def place_of(network: Network) -> torch.device:
    """The device that a network lies on."""
    parameter: Tensor = next(network.parameters())
    return parameter.device
