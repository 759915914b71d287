"""The solids' field by its formulas in place of the network, with all that the renderer saves: its rival."""

from __future__ import annotations

from typing import Any

import numpy as np

from scenelang.models.framed import load_arrays
from scenelang.models.manifest import load_manifest
from scenelang.reference.field import TORUS, leaf_distance
from scenelang.renderers.arrays import Array, Layers
from scenelang.renderers.field import SMOOTH, SUBTRACT, UNION
from scenelang.renderers.solid.network import Cell, SolidArrays, Wanted


class ClosedForms(SolidArrays):
    """What `SolidArrays` has learned, computed: distances, their gradients, looks and the fold.

    Args:
        model: whose Programs are drawn.
    """

    def __init__(self, model: str) -> None:
        self.__dict__.update(vars(load_arrays(model).network) | {"segment_w": []})
        manifest = load_manifest(model)
        self.geometries = manifest.geometries
        self.media = np.array([material == "volumetric" for material in manifest.materials], np.float32)

    def decoder(self, code: Array) -> Layers:
        """The index of the geometry in the place of weights."""
        return [(abs(self.codes - code).sum(1).argmin(), code)]

    def look(self, material_code: Array) -> Array:
        nearest = abs(self.material_codes - material_code[..., None, :]).sum(-1).argmin(-1)
        return np.stack([*(np.ones_like(self.media[nearest]),) * 3, self.media[nearest]], -1)

    def cell(self, token: int, width: float) -> tuple[Cell, ...]:
        """The token in the place of the first weight, the width of blends in that of the second."""
        token_, width_, none = (np.full((1, 1), value, np.float32) for value in (token, width, 0.0))
        return (Cell(token_, width_, none, none, none),) * len(Wanted)

    def field(self, q: Array, layers: Layers, gradient: bool) -> Array:
        geometry = self.geometries[layers[0][0]]
        if not gradient:
            return leaf_distance(geometry, q)[None]
        x, y, z = q
        if geometry == "sphere":
            length = np.sqrt(x * x + y * y + z * z).clip(1e-12)
            return np.stack([length - 1, x / length, y / length, z / length])
        around = np.sqrt(x * x + z * z).clip(1e-12)
        ring = around - np.float32(TORUS[0])
        tube = np.sqrt(ring * ring + y * y).clip(1e-12)
        out = ring / (tube * around)
        return np.stack([tube - np.float32(TORUS[1]), out * x, y / tube, out * z])

    def join(self, d: Array, memory: Array, look: Array, cell: Cell, wanted: Wanted) -> tuple[Array, Array]:
        tokens, joined = cell.own[0], None
        for token in np.unique(tokens):
            found = _joined(token, cell.past[0], memory[0], d)
            joined = found if joined is None else np.where(tokens == token, found, joined)
        assert joined is not None
        register, paint = memory[1:], joined[2]
        if wanted != Wanted.DISTANCE:
            register = register + paint * (look[-len(register) :] - register)
            register[-1] = np.where(paint > 0.5, look[-1], memory[-1])
        return np.concatenate([joined[:1], register]), joined[1]

    def partials(self, d: Array, state: Array, take: Array, cell: Cell) -> tuple[Array, Array]:
        return np.where(cell.own[0] == SUBTRACT, -take, take), 1 - take


def _joined(token: Any, k: Array, state: Array, d: Array) -> Array:
    """The distance behind an object, its share in that and in colours (3, M)."""
    if token == SMOOTH:
        h = (0.5 + 0.5 * (state - d) / k).clip(0, 1)
        return np.stack([(1 - h) * state + h * (d - k * (1 - h)), h, h])
    if token == UNION:
        return np.stack([np.minimum(state, d), d < state, d < np.maximum(state, 0)])
    d = -d if token == SUBTRACT else d
    return np.stack([np.maximum(state, d), d > state, 0 * d])
