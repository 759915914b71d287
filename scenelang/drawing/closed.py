"""The exact field: formulas of leaves and fold in place of the network, drawn by the same renderer.

Shapes that users bring have no formula; they stay grids.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from scenelang.compiler.geometries import GEOMETRIES, SECTORS
from scenelang.compiler.groups import SMOOTH, SUBTRACT, UNION
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.arrays import NUMPY, Array
from scenelang.drawing.exact.field import leaf_distance
from scenelang.drawing.how import RenderError
from scenelang.drawing.neural.field import BLEND
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.network import FramedArrays, FramedConfig
from scenelang.drawing.neural.units import FIRST, RADIAL, LeafUnits
from scenelang.drawing.neural.units import SECTORS as ORDERS
from scenelang.drawing.solid.network import Formula, SolidArrays, SolidCell
from scenelang.drawing.solid.norms import Norms

if TYPE_CHECKING:
    from scenelang.compiler.program import Program

SHARP = 1e6  # per world unit: gates of the plane's cell open within a millionth


def exact_units(geometry: str) -> Norms:
    """Norm units that are the distance of a leaf of the plane, by the edge in half a sector."""
    if geometry not in SECTORS:  # a disc
        return Norms(np.ones((1, 1)), np.zeros(1), np.ones(()), (RADIAL,), (1,), 0)
    order, _, outer, inner = SECTORS[geometry]
    if order not in ORDERS:  # a square, by |x| and |y|
        return Norms(np.tile(np.eye(2), (2, 1)), np.full(4, -inner), np.zeros(()), (1, 2), (2,), 2)
    half = math.pi / order
    u, v = inner * math.cos(half) - outer, inner * math.sin(half)
    length = math.hypot(u, v)
    cos, sin = u / length, v / length
    off, along = [sin, -cos, -sin * outer], [cos, sin, -cos * outer]
    before = [-number for number in along]
    inside = [-number for number in off]
    beyond = [*along[:2], along[2] - length]
    lines = np.array([inside, beyond, off, before])
    first = FIRST + 2 * ORDERS.index(order)
    return Norms(lines[:, :2], lines[:, 2], np.zeros(()), (first, first + 1), (2,), 0, 2)


def _narrow(part: Any) -> Any:
    return part.astype(np.float32) if isinstance(part, np.ndarray) else part


class ClosedPlane(FramedArrays):
    """`FramedArrays` by formulas: distances, albedo, and a cell whose weights are those of the fold."""

    def __init__(self, model: str) -> None:
        self.__dict__.update(vars(load_arrays(model).network))
        names = load_manifest(model).geometries
        shapes = [LeafUnits(NUMPY, Norms(*map(_narrow, exact_units(name)))) for name in names]
        self.config = FramedConfig(self.config.code, self.config.material_code)
        self.shapes = {code.tobytes(): shape for code, shape in zip(self.codes, shapes, strict=True)}
        self.read_slope = np.float32(math.log(4 * SHARP))
        # a gate is a clamped line: 0.5 where both sides are equal, and open after 1 / (2 slope) world units
        s, k = SHARP, 0.5 / BLEND
        shut = [0.0, 0.0, -1.0]
        # of each token the gates of distance and colour: lines in (d, D), and their biases
        gates = [
            ([-s, s, 0.5], [-s, s, 0.5], [-s, 0.0, 0.5]),  # d < D; d < D or d < 0
            ([-k, k, 0.5], [-k, k, 0.5], shut),
            ([-s, -s, 0.5], shut, shut),  # -d > D
            ([s, -s, 0.5], shut, shut),  # d > D
        ]
        lines = np.array(gates, np.float32).swapaxes(1, 2)  # (TOKENS, d and D and bias, S + L)
        self.cell_lines, self.cell_bias = lines[:, :2], lines[:, 2]
        self.cell_gain = np.zeros_like(self.cell_bias)
        self.candidate = np.array([1.0, 1.0, -1.0, 1.0], np.float32)[:, None, None]
        self.bump = np.array([0.0, BLEND, 0.0, 0.0], np.float32)[:, None]

    def decoders(self, codes: Array) -> list[Any]:
        return [self.shapes.get(code.tobytes()) for code in codes]  # rows of elements have none

    def object_albedo(self, material_code: Array) -> Array:
        return np.ones((len(material_code), 3), np.float32)


class ClosedSolids(SolidArrays):
    """`SolidArrays` by formulas: distances, their gradients, looks, and a cell with weights of the fold."""

    def __init__(self, model: str) -> None:
        self.__dict__.update(vars(load_arrays(model).network) | {"segment_w": [], "segment_b": []})
        manifest = load_manifest(model)
        self.geometries = manifest.geometries
        self.media = np.array([material == "volumetric" for material in manifest.materials], np.float32)

    def decoder(self, code: Array) -> Any:
        return Formula(self.geometries[int(abs(self.codes - code).sum(1).argmin())])

    def look(self, material_code: Array) -> Array:
        nearest = abs(self.material_codes - material_code[..., None, :]).sum(-1).argmin(-1)
        return np.stack([*(np.ones_like(self.media[nearest]),) * 3, self.media[nearest]], -1)

    def cell(self, token: int, width: float) -> tuple[SolidCell, ...]:
        """Gates of the distance, colours and kinds that open as the fold does: lines in (d, D), biases."""
        return self.cut(token, width if token == SMOOTH else 0.0)

    def cut(self, token: int, width: float) -> tuple[SolidCell, ...]:
        k = 0.5 / width if width else SHARP
        first, second = [-k, k, 0.5], [-SHARP, SHARP, 0.5]
        if token == UNION:  # d < D; d < D or d < 0
            gates = [first, first, [-SHARP, 0.0, 0.5], first, [-SHARP, 0.0, 0.5]]
        elif token == SMOOTH:
            gates = [first, first, first, second, second]
        else:  # -d > D or d > D
            gates = [[-k if token == SUBTRACT else k, -k, 0.5], *[[0.0, 0.0, -1.0]] * 4]
        side, cuts = 1.0 - 2.0 * (token == SUBTRACT), token >= SUBTRACT
        own, past, bias = np.array(gates, np.float32).T[..., None]
        candidate, bump = (np.full((1, 1), value, np.float32) for value in (side, -width if cuts else width))
        return tuple(
            SolidCell(own[rows], past[rows], bias[rows], candidate, bump)
            for rows in ([0], [0, 3, 4], [*range(5)])
        )

    def field(self, q: Array, layers: Any, gradient: bool) -> Array:
        if not gradient:
            return leaf_distance(layers, q)[None]
        slopes = GEOMETRIES[layers].slopes
        assert slopes is not None
        return np.stack(slopes(q))

    def box(self, layers: Any) -> np.ndarray:
        half = np.array(GEOMETRIES[layers].half, np.float32)
        return np.stack([-half, half])

    def edged(self, layers: Any) -> bool:
        return GEOMETRIES[layers].edged


@lru_cache(maxsize=8)
def closed_forms(model: str) -> ClosedPlane | ClosedSolids:
    """The exact field of a model's Programs; raises `RenderError` where it has none."""
    manifest = load_manifest(model)
    if not manifest.framed:
        raise RenderError(f"model `{model}` has no frames that formulas could answer in")
    return (ClosedPlane if manifest.dimension == 2 else ClosedSolids)(model)


def field_of(program: Program, exact: bool) -> FramedArrays | SolidArrays:
    """Formulas, or a Program's network; raises as `load_arrays`, and `RenderError` without formulas."""
    formulas = closed_forms(program.model) if exact else None
    network, digest = load_arrays(program.model, program.weights)
    program.check_weights(digest)
    return formulas or network
