"""Learned lifting without torch: the compiler's side of `lab.designs.encoders`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.graph.steps import Affine, Step, Warp

Array = npt.NDArray[np.float64]
MOST = 1e4  # of an entry: far outside all that was trained, and what float32 networks still take in

# Numbers that a transformation hands to its encoder.
GEOMETRY_INPUTS = {"affine": 16, "twirl": 1, "bend": 1}
MATERIAL_INPUTS = {"color": 3}


@dataclass(frozen=True, slots=True)
class Lifting:
    """Vectors and encoders of a model, as its weights file holds them, in float64.

    Args:
        codes: (G, d_g), one row a geometry of the manifest, in its order.
        material_codes: (K, d_m), one row a material.
        encoders: kind of transformation to its three layers, each (weight (out, in), bias (out,)).
    """

    codes: Array
    material_codes: Array
    encoders: Mapping[str, tuple[tuple[Array, Array], ...]]

    def matrices(self, kind: str, numbers: npt.ArrayLike) -> Array:
        """Matrices (M, d, d) of M transformations of a kind: (M, inputs)."""
        x = np.atleast_2d(np.asarray(numbers, np.float64))
        *hidden, (weight, bias) = self.encoders[kind]
        for w, b in hidden:
            x = np.maximum(x @ w.T + b, 0.0)
        size = round(len(bias) ** 0.5)
        return (x @ weight.T + bias).reshape(-1, size, size) + np.eye(size)


def read_lifting(tensors: Mapping[str, npt.NDArray[Any]], prefix: str = "lifting.") -> Lifting:
    """The lifting in a weights file.

    Raises:
        KeyError: something is missing.
        ValueError: shapes do not fit each other, or numbers are not finite.
    """

    def array(name: str) -> Array:
        return np.asarray(tensors[prefix + name], np.float64)

    lifting = Lifting(array("codes"), array("material_codes"), {})
    encoders: dict[str, tuple[tuple[Array, Array], ...]] = {}
    for side, kinds, size in (
        ("geometry", GEOMETRY_INPUTS, lifting.codes.shape[1]),
        ("material", MATERIAL_INPUTS, lifting.material_codes.shape[1]),
    ):
        for kind, width in kinds.items():
            names = [f"{side}.{kind}.layers.{i}" for i in range(3)]
            encoders[kind] = tuple((array(f"{name}.weight"), array(f"{name}.bias")) for name in names)
            _check(kind, encoders[kind], width, size)
    if sum(name.startswith(prefix) for name in tensors) > 2 + 6 * len(encoders):
        raise ValueError("it holds tensors that no encoder has")
    return replace(lifting, encoders=encoders)


def _check(kind: str, layers: tuple[tuple[Array, Array], ...], width: int, size: int) -> None:
    """An encoder's layers must fit one another, take ``width`` numbers and end in a matrix (size, size)."""
    for weight, bias in layers:
        if weight.ndim != 2 or bias.shape != weight.shape[:1] or weight.shape[1] != width:
            raise ValueError(f"a layer of `{kind}` has the wrong shape")
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise ValueError(f"a layer of `{kind}` is not finite")
        width = len(bias)
    if width != size * size:
        raise ValueError(f"`{kind}` ends in {width} numbers, where {size} x {size} are needed")


def step_numbers(step: Step) -> tuple[str, list[float]]:
    """Which encoder a step goes through, and with what numbers."""
    if isinstance(step, Affine):
        a, b, c, d, e, f, g, h, i, j, k, l = step.rows  # noqa: E741
        return "affine", [a, b, c, d, e, f, g, h, i, j, k, l, 0.0, 0.0, 0.0, 1.0]
    if not isinstance(step, Warp):
        raise ValueError(f"a {type(step).__name__.lower()} has no encoder")
    if step.twirl and any(step.bend):
        raise ValueError("a merged warp has no encoder; it is split before it is lifted")
    return ("bend", [step.bend[0]]) if step.bend[0] else ("twirl", [step.twirl])


def lift_geometry(lifting: Lifting, chains: Sequence[Sequence[Step]], leaves: Sequence[int]) -> Array:
    """Geometry vectors (N, d_g): T_n … T_1 g of each chain, nearest the leaf first; leaves are rows."""
    out: Array = lifting.codes[np.asarray(leaves, int)].copy()
    for at in range(max(map(len, chains), default=0)):
        groups: dict[str, list[tuple[int, list[float]]]] = {}
        for row, chain in enumerate(chains):
            if at < len(chain):
                kind, numbers = step_numbers(chain[at])
                groups.setdefault(kind, []).append((row, numbers))
        for kind, members in groups.items():
            rows = [row for row, _ in members]
            given = np.clip([numbers for _, numbers in members], -MOST, MOST)
            made = lifting.matrices(kind, given)
            out[rows] = np.clip(np.einsum("mij,mj->mi", made, out[rows]), -MOST, MOST)
    return out


def lift_material(lifting: Lifting, colours: Sequence[Sequence[float]], materials: Sequence[int]) -> Array:
    """Material vectors (N, d_m) of objects whose material is one colour (r, g, b) in [0, 1]."""
    codes: Array = lifting.material_codes[np.asarray(materials, int)]
    if not len(codes):
        return codes
    lifted: Array = np.einsum("mij,mj->mi", lifting.matrices("color", colours), codes)
    return lifted
