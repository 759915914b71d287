"""A model ready to draw: manifest, trained network, digest of its weights."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import load

from scenelang.models.manifest import Manifest, load_manifest
from scenelang.models.weights import MOST_BYTES, Codes, read_header, read_weights, weights_path
from scenelang.models.weights import ModelError as ModelError
from scenelang.renderers.framed import Framed, FramedConfig

MOST_WIDTH = 1024


@dataclass(frozen=True, slots=True)
class Model:
    """What draws programs.

    Args:
        manifest: what the model states about itself.
        network: the trained network, in evaluation mode, without gradients.
        digest: SHA-256 of the weights file, hex.
        header: how the weights were trained (config, seed, revision, budget).
    """

    manifest: Manifest
    network: Framed
    digest: str
    header: dict[str, Any]

    def codes(self) -> Codes:
        """The codes of these weights, as `compile_scene` takes them."""
        return Codes(
            dict(zip(self.manifest.geometries, map(tuple, self.network.codes.tolist()), strict=True)),
            dict(zip(self.manifest.materials, map(tuple, self.network.material_codes.tolist()), strict=True)),
            self.digest,
        )


def load_network(data: bytes, manifest: Manifest, device: str = "cpu") -> Framed:
    """Build the network that a weights file holds.

    Raises:
        ModelError: the file does not fit the manifest or itself, or holds numbers that are not finite.
    """
    if len(data) > MOST_BYTES:
        raise ModelError(f"weights of more than {MOST_BYTES} bytes")
    header = read_header(data)
    try:
        sizes = header["config"]["network"]
        if any(type(v) is not int or not 1 <= v <= MOST_WIDTH for v in sizes.values()):
            raise ModelError("a network size is out of range")
        config = FramedConfig(**sizes)
    except (KeyError, TypeError, AttributeError) as error:
        raise ModelError(f"bad network sizes: {error}") from None
    decoder = (config.code + 1) * config.decoder_width * (config.decoder_width + config.features)
    cell = (config.features + config.state) * config.cell_width + config.features * config.state
    if 4 * max(decoder, cell) > len(data):
        raise ModelError("a network larger than its file")
    # Not on the meta device, which takes no memory but 1.8 s to import what it stands on.
    with torch.random.fork_rng(devices=[]):
        network = Framed(config, len(manifest.geometries), len(manifest.materials))
    try:
        tensors = load(data)
        network.load_state_dict(tensors, assign=True)
    except Exception as error:
        # safetensors raises its own class, torch a RuntimeError; both say what does not fit
        raise ModelError(f"damaged weights: {' '.join(str(error).split())[:300]}") from None
    for name, parameter in network.named_parameters():
        if parameter.dtype != torch.float32 or not torch.isfinite(parameter).all():
            raise ModelError(f"weights '{name}' are not finite float32 numbers")
    return network.requires_grad_(False).eval().to(device)


def load_model(name: str, device: str = "cpu", path: Path | None = None) -> Model:
    """Load a shipped model, or one whose weights lie at ``path``.

    Raises:
        KeyError: there is no such model.
        ModelError: its weights are missing or damaged.
    """
    manifest = load_manifest(name)
    try:
        data = read_weights(path or weights_path(name))
    except OSError as error:
        raise ModelError(
            f"cannot read the weights of '{name}': {(error.strerror or str(error)).lower()}"
        ) from None
    network = load_network(data, manifest, device)
    return Model(manifest, network, hashlib.sha256(data).hexdigest(), read_header(data))
