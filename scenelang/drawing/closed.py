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
from scenelang.drawing.arrays import Array, Smooth
from scenelang.drawing.exact.field import leaf_distance
from scenelang.drawing.how import RenderError
from scenelang.drawing.neural.field import BLEND
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.network import Floats, FramedArrays, FramedConfig
from scenelang.drawing.solid.network import SolidArrays, SolidCell, Wanted
from scenelang.drawing.solid.norms import Norms

if TYPE_CHECKING:
    from scenelang.compiler.program import Program

SHARP = 1e6  # per world unit: gates of the plane's cell open within a millionth


class ExactShape:
    """Distance of a leaf of the plane in place of a decoder; it changes by no more than a point moves."""

    def __init__(self, geometry: str) -> None:
        self.row = GEOMETRIES[geometry]

    def distance(self, q: Array) -> Array:
        """Distances (M,), in leaf units, at leaf coordinates (2, M)."""
        return self.row.distance(q)

    def rise(self, q: Floats, radius: Floats) -> Floats:
        """Greatest difference (M,) of distances at leaf coordinates (2, M) from those within radii (M,)."""
        return radius


class ExactSectors(ExactShape):
    """Distance of a shape of dihedral symmetry, without angles: a point is mirrored into the half sector that
    one segment bounds (`Geometry.sectors`) and turned, so that the segment lies along an axis.
    """

    def __init__(self, geometry: str) -> None:
        super().__init__(geometry)
        n, phase, outer, inner = SECTORS[geometry]
        self._first = math.cos(phase), math.sin(phase)
        self._mirrors: list[tuple[float, float, bool]] = []
        sector, most = math.pi / n, n  # angles lie in [0, most sectors]
        while most > 1:
            at = -(-most // 3)
            self._mirrors.append((math.cos(at * sector), math.sin(at * sector), 2 * at < most))
            most = at
        u, v = inner * math.cos(sector) - outer, inner * math.sin(sector)
        self._outer, self._length = outer, math.hypot(u, v)
        self._along = u / self._length, v / self._length

    def distance(self, q: Array) -> Array:
        cos, sin = self._first
        x, y = q
        u, v = cos * x + sin * y, abs(cos * y - sin * x)
        for cos, sin, beyond in self._mirrors:
            past = np.maximum(cos * v - sin * u, 0.0)
            u += 2 * sin * past
            v -= 2 * cos * past
            v = abs(v) if beyond else v
        u -= self._outer
        cos, sin = self._along
        off, gap = sin * u - cos * v, cos * u + sin * v
        gap -= gap.clip(0.0, self._length)
        return np.copysign(np.sqrt(gap * gap + off * off), off)


class ClosedPlane(FramedArrays):
    """`FramedArrays` by formulas: distances, albedo, and a cell whose weights are those of the fold."""

    def __init__(self, model: str) -> None:
        self.__dict__.update(vars(load_arrays(model).network))
        names = load_manifest(model).geometries
        shapes = [(ExactSectors if name in SECTORS else ExactShape)(name) for name in names]
        self.config = FramedConfig(self.config.code, self.config.material_code)
        self.slopes = {code.tobytes(): shape for code, shape in zip(self.codes, shapes, strict=True)}
        self.levels = dict  # nothing is to be corrected
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
        return [self.slopes.get(code.tobytes()) for code in codes]  # rows of elements have none

    def object_albedo(self, material_code: Array) -> Array:
        return np.ones((len(material_code), 3), np.float32)


class ClosedSolids(SolidArrays):
    """`SolidArrays` by formulas: distances, their gradients, looks and the fold."""

    def __init__(self, model: str) -> None:
        self.__dict__.update(vars(load_arrays(model).network) | {"segment_w": [], "segment_b": []})
        manifest = load_manifest(model)
        self.geometries = manifest.geometries
        self.media = np.array([material == "volumetric" for material in manifest.materials], np.float32)

    def decoder(self, code: Array) -> Smooth:
        """The index of the geometry in the place of weights."""
        return Smooth([(abs(self.codes - code).sum(1).argmin(), code)])

    def look(self, material_code: Array) -> Array:
        nearest = abs(self.material_codes - material_code[..., None, :]).sum(-1).argmin(-1)
        return np.stack([*(np.ones_like(self.media[nearest]),) * 3, self.media[nearest]], -1)

    def cell(self, token: int, width: float) -> tuple[SolidCell, ...]:
        """The token in the place of the first weight, the width of blends in that of the second."""
        return self.cut(token, width if token == SMOOTH else 0.0)

    def cut(self, token: int, width: float) -> tuple[SolidCell, ...]:
        token_, width_, none = (np.full((1, 1), value, np.float32) for value in (token, width, 0.0))
        return (SolidCell(token_, width_, none, none, none),) * len(Wanted)

    def field(self, q: Array, layers: Smooth | Norms, gradient: bool) -> Array:
        assert isinstance(layers, Smooth)
        geometry = self.geometries[layers[0][0]]
        if not gradient:
            return leaf_distance(geometry, q)[None]
        slopes = GEOMETRIES[geometry].slopes
        assert slopes is not None
        return np.stack(slopes(q))

    def join(
        self, d: Array, memory: Array, look: Array, cell: SolidCell, wanted: Wanted, switched: int = 1
    ) -> tuple[Array, Array]:
        tokens, joined = cell.own[0], None
        for token in np.unique(tokens):
            result = _joined(token, cell.past[0], memory[0], d)
            joined = result if joined is None else np.where(tokens == token, result, joined)
        assert joined is not None
        register, paint = memory[1:], joined[2]
        if wanted != Wanted.DISTANCE:
            register = register + paint * (look[-len(register) :] - register)
            last = slice(-min(switched, len(register)), None)
            register[last] = np.where(paint > 0.5, look[last], memory[last])
        return np.concatenate([joined[:1], register]), joined[1]

    def box(self, layers: Smooth | Norms) -> np.ndarray:
        assert isinstance(layers, Smooth)
        half = np.array(GEOMETRIES[self.geometries[layers[0][0]]].half, np.float32)
        return np.stack([-half, half])

    def edged(self, layers: Smooth | Norms) -> bool:
        assert isinstance(layers, Smooth)
        return GEOMETRIES[self.geometries[layers[0][0]]].edged

    def alone(self, reach: Array, cell: SolidCell) -> Array:
        return 0 * reach + 1

    def partials(self, d: Array, state: Array, take: Array, cell: SolidCell) -> tuple[Array, Array]:
        return np.where(cell.own[0] == SUBTRACT, -take, take), 1 - take


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


def _joined(token: Any, k: Array, state: Array, d: Array) -> Array:
    """The distance behind an object, its share in that and in colours (3, M)."""
    if token == SMOOTH:
        h = (0.5 + 0.5 * (state - d) / np.maximum(k, 1e-9)).clip(0, 1)  # k is 0 for other tokens
        return np.stack([(1 - h) * state + h * (d - k * (1 - h)), h, h])
    if token == UNION:
        return np.stack([np.minimum(state, d), d < state, d < np.maximum(state, 0)])
    d = -d if token == SUBTRACT else d
    h = np.where(k > 0, (0.5 + 0.5 * (d - state) / np.maximum(k, 1e-9)).clip(0, 1), d > state)
    return np.stack([(1 - h) * state + h * (d + k * (1 - h)), h, 0 * d])
