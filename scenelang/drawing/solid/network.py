"""The solids' network, from top to bottom, for parameters of either library, and boxes around its leaves.

Letters: N objects, M points, C = `code`, C' = C + `hidden` + 1, H = `hidden`, G = `width`, S = `segment`, L =
`paint_lines`, K = `kind_lines`. Distances are in world units, leaf coordinates in leaf units, points lie
last. Two parts are learned:

1. The decoder turns leaf coordinates into a distance. Its weights are a linear function of the object's code,
   behind a hidden layer where the network has one. Its units are norms (`norms.py`), or, in networks that
   know round leaves alone, SiLU (Elfwing et al. 2018).
2. The cell is an LSTM whose gates are clamped lines in the object's distance and the distance so far, chosen
   by the boolean token. Its register carries colour and medium, the latter under a gate of its own.

Files of weights may also have layers that told the length of half a ray in a leaf; nothing asks them. Both
parts say how their answers change with what they are asked, written by hand: a surface's normal is the
gradient of the distance behind the last object.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from scenelang.assets.element import Element
from scenelang.assets.pyramid import unpacked
from scenelang.compiler.groups import SMOOTH, SUBTRACT
from scenelang.compiler.lifting import SOLID_LAYOUT, Layout
from scenelang.drawing.arrays import NUMPY, SMOOTH_BLOCK, Array, Smooth
from scenelang.drawing.neural.network import TOKENS
from scenelang.drawing.solid.norms import FEATURES, LINES, Lifted, Norms, answers

LEVELS = 7  # of halvings of the cube's cells
STEEPEST = 1.1  # change of a distance over a way of 1 at most; the march trusts in 1
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)), np.float32).T[:, None]  # (3, 1, 8)


@lru_cache(maxsize=64)
def decoder_box(shapes: tuple[tuple[int, ...], ...], numbers: bytes, *rest: Any) -> np.ndarray:
    """The box (2, 3) of a decoder whose arrays have such shapes, one after the other; of one of norm units
    the ``rest`` is given.
    """
    ends = np.cumsum([0, *(int(np.prod(shape)) for shape in shapes)])
    flat = np.frombuffer(numbers, np.float32)
    parts: Any = [flat[a:b].reshape(shape) for a, b, shape in zip(ends, ends[1:], shapes, strict=False)]
    if rest:
        return surrounding(lambda q: answers(NUMPY, q, Norms(*parts, *rest), False)[0])
    return surrounding(lambda q: NUMPY.smooth(q, Smooth(zip(parts[::2], parts[1::2], strict=True)))[0])


@lru_cache(maxsize=8)
def element_box(element: Element) -> np.ndarray:
    """The box (2, 3) of the cells of an element's grid with something inside."""
    inside = unpacked(element) <= 0
    sides, box = len(inside) - 1, []
    for axis in range(3):
        filled = np.flatnonzero(inside.any(tuple(other for other in range(3) if other != axis)))
        box.append([filled[0] - 1, filled[-1] + 1] if len(filled) else [0, sides])
    return np.asarray(np.array(box, np.float32).T.clip(0, sides) * (2 / sides) - 1)


def surrounding(distance: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """The least and the greatest coordinates (2, 3) of what lies in [-1, 1]^3, at most 0.03 too far out, by
    distances (M,) of points (3, M), which change by at most `STEEPEST` over a way of 1.

    Cells are halved where something may lie in them outside the box of points known to be inside.
    """
    centre, half = np.zeros((3, 1), np.float32), 1.0
    low, high = np.full((3, 1), np.inf, np.float32), np.full((3, 1), -np.inf, np.float32)
    for _ in range(LEVELS):
        half /= 2
        centre = (centre[:, :, None] + half * CORNERS).reshape(3, -1)
        result = distance(centre)
        inside = centre[:, result <= 0]
        low = np.minimum(low, inside.min(1, keepdims=True, initial=np.inf))
        high = np.maximum(high, inside.max(1, keepdims=True, initial=-np.inf))
        wider = ((centre - half < low) | (centre + half > high)).any(0)
        centre = centre[:, wider & (result <= STEEPEST * half * 3**0.5)]
    low = np.minimum(low, (centre - half).min(1, keepdims=True, initial=np.inf))
    high = np.maximum(high, (centre + half).max(1, keepdims=True, initial=-np.inf))
    return np.concatenate([low, high], 1).T


EMPTY = 100.0  # world units: the distance where nothing has been met
RADIUS = 3.0  # leaf units: the decoder sees points in this ball, farther ones at its rim
BLEND = 0.15  # world units: the width of the blends that the cell is trained on
SEGMENT = 5  # numbers that told a ray in a leaf


@dataclass(frozen=True, slots=True)
class SolidConfig:
    """Sizes of the network."""

    code: int = 4  # entries of the codes
    material_code: int = 2
    width: int = 8  # hidden units of the decoder's two layers, where it has SiLU
    units: int = 0  # norm units of the decoder; 0: it has SiLU
    hidden: int = 0  # rectified units between the codes and the weights
    paint_lines: int = 2  # lines of which the highest opens the gate of colour
    kind_lines: int = 2  # and that of medium
    segment: int = 0  # hidden units of two layers that answered for whole segments; 0: there are none
    answered: int = 0  # geometries, the first ones, that these answered for; 0: all


class Formula(str):
    """The name of a geometry whose formula stands in the place of a decoder."""


class SolidCell(NamedTuple):
    """Weights of the cell for a token and a width of blends, or (…, M) for those of each point."""

    own: Array  # (1 + L + K, 1): levels of the gates from the object's distance
    past: Array  # (1 + L + K, 1): and from the distance so far
    bias: Array  # (1 + L + K, 1)
    candidate: Array  # (1, 1): what an open gate makes of the object's distance
    bump: Array  # (1, 1): by how much a half-open gate lowers the distance, times four


class Wanted(IntEnum):
    """Values that the cell is asked for."""

    DISTANCE = 0
    KIND = 1  # and whether it is a medium
    ALL = 2  # and the colour


class SolidNetwork(Lifted):
    """The formulas of the network, over parameters of either library."""

    config: SolidConfig
    layout: Layout = SOLID_LAYOUT
    codes: Any  # (geometries, C)
    material_codes: Any  # (materials, material_code)
    albedo: Any  # (material_code + 1, 4): colour and medium
    decoder_w: Any  # (C', 3, G), (C', G, G), (C', G, 1), or none
    decoder_b: Any  # (C', G), (C', G), (C', 1), or none
    segment_w: Any  # (C', 5, S), (C', S, S), (C', S, 1), or none
    segment_b: Any  # (C', S), (C', S), (C', 1), or none
    cell_lines: Any  # (TOKENS, 2, 1 + L + K)
    cell_gain: Any  # (TOKENS, 1 + L + K): a logarithm
    cell_bias: Any  # (TOKENS, 1 + L + K)
    candidate: Any  # (TOKENS,)
    bump: Any  # (TOKENS,)
    last: Any = None  # the `Around` of the last picture
    until_s: float = float("inf")  # processor seconds of the process when the picture has to be done

    def decoder(self, code: Array) -> Smooth | Norms:
        """The decoder of a code (C,)."""
        if not self.config.units:
            return self._layers(code, self.decoder_w, self.decoder_b)
        return self.norms(code, RADIUS)

    def _layers(self, code: Array, weights: Sequence[Array], biases: Sequence[Array]) -> Smooth:
        one = self.lifted(code)
        return Smooth(
            (self.xp.packed((one @ w.reshape(len(w), -1)).reshape(w.shape[1:]).swapaxes(0, 1)), one @ b)
            for w, b in zip(weights, biases, strict=True)
        )

    def cell(self, token: int, width: float) -> tuple[SolidCell, ...]:
        """The cell of a token for blends of a width, with each `Wanted`'s gates: s d and s D fold to s D'."""
        paint, scale = self.config.paint_lines, BLEND / width
        gain = self.xp.exp(self.cell_gain[token])[:, None]
        own, past = (line[:, None] * (gain * scale) for line in self.cell_lines[token])
        bias, bump = self.cell_bias[token][:, None], self.bump[token] / (gain[:1] * scale)
        kept = [[0], [0, *range(1 + paint, len(bias))], [*range(len(bias))]]
        candidate = self.candidate[token].reshape(1, 1)
        return tuple(SolidCell(own[rows], past[rows], bias[rows], candidate, bump) for rows in kept)

    def cut(self, token: int, width: float) -> tuple[SolidCell, ...]:
        """As `cell`, of a rounded cut: `subtract` leaves -smooth(-D, d), `intersect` -smooth(-D, -d)."""
        blend, concat = self.cell(SMOOTH, width)[Wanted.DISTANCE], self.xp.concat
        side = -1.0 if token == SUBTRACT else 1.0
        edge = SolidCell(-side * blend.own, -blend.past, blend.bias, side * blend.candidate, -blend.bump)
        return tuple(
            edge._replace(
                own=concat([edge.own, sharp.own[1:]], 0),
                past=concat([edge.past, sharp.past[1:]], 0),
                bias=concat([edge.bias, sharp.bias[1:]], 0),
            )
            for sharp in self.cell(token, BLEND)
        )

    def look(self, material_code: Array) -> Array:
        """Colour and medium (…, 4) of material codes (…, material_code)."""
        return material_code @ self.albedo[:-1] + self.albedo[-1]

    def field(self, q: Array, layers: Smooth | Norms, gradient: bool) -> Array:
        """Distances of leaf coordinates (3, M), leaf units: (1, M), or with their gradients (4, M)."""
        if isinstance(layers, Smooth) and not gradient:
            return self.xp.smooth(q, layers)
        parts = [q[:, i : i + SMOOTH_BLOCK] for i in range(0, q.shape[1], SMOOTH_BLOCK)] or [q]
        if isinstance(layers, Norms):
            results = [answers(self.xp, part, layers, gradient) for part in parts]
        else:
            results = [self._slopes(part, layers) for part in parts]
        return results[0] if len(results) == 1 else self.xp.concat(results, 1)

    def box(self, layers: Smooth | Norms) -> np.ndarray:
        """The least and the greatest leaf coordinates (2, 3) of what a decoder shows."""
        arrays: Any = (
            layers[:3] if isinstance(layers, Norms) else [part for layer in layers for part in layer]
        )
        rest = layers[3:] if isinstance(layers, Norms) else ()
        parts = [np.asarray(self.xp.to_numpy(part), np.float32) for part in arrays]
        return decoder_box(tuple(p.shape for p in parts), b"".join(p.tobytes() for p in parts), *rest)

    def edged(self, layers: Smooth | Norms) -> bool:
        """Whether a decoder shows edges, which lines inside make; rays may clip them."""
        return isinstance(layers, Norms) and layers.inner > 0

    def _slopes(self, q: Array, layers: Smooth) -> Array:
        """Distances and gradients (4, M), which go back through the layers."""
        xp, kept = self.xp, []
        for w, b in layers[:-1]:
            a = xp.dense(q, w, b)
            s = xp.sigmoid(a)
            q = a * s
            kept.append(s * (1 + a - q))  # the derivative of a s
        w, b = layers[-1]
        value, g = xp.dense(q, w, b), w.T
        for slope, (w, _) in zip(reversed(kept), reversed(layers[:-1]), strict=True):
            g = w.T @ (slope * g)
        return xp.concat([value, g], 0)

    def join(
        self, d: Array, memory: Array, look: Array, cell: SolidCell, wanted: Wanted, switched: int = 1
    ) -> tuple[Array, Array]:
        """The memory behind an object at distances (M,), and how far the distance's gate is open (M,).

        Memory is the distance so far and the register behind it: (1, M), (2, M) with the medium alone, or,
        with colours before it, (1 + R, M); ``look`` is the object's own register (R, 1), or (R, M). Its last
        rows, ``switched``, come with the kind of material.
        """
        xp, state = self.xp, memory[:1]
        gates = xp.unit(cell.own * d + cell.past * state + cell.bias)
        take = gates[:1]
        keep = 1 - take
        new = take * (d * cell.candidate - keep * cell.bump) + keep * state
        take = take[0]
        if wanted == Wanted.DISTANCE:
            return new, take
        if wanted == Wanted.KIND:
            kind = xp.largest(gates[1:])
            return xp.concat([new, memory[1:] + kind * (look[-1:] - memory[1:])], 0), take
        n = 1 + self.config.paint_lines
        paint, kind = xp.largest(gates[1:n]), xp.largest(gates[n:])
        gate = xp.concat([paint] * (len(memory) - 1 - switched) + [kind] * switched, 0)
        return xp.concat([new, memory[1:] + gate * (look - memory[1:])], 0), take

    def partials(self, d: Array, state: Array, take: Array, cell: SolidCell) -> tuple[Array, Array]:
        """Derivatives (M,) of the distance behind an object by its own and by that before it."""
        candidate, bump = cell.candidate[0], cell.bump[0]
        rate = d * candidate - state - (1 - 2 * take) * bump
        rate = self.xp.select((take > 0) & (take < 1), rate, 0 * rate)
        return take * candidate + rate * cell.own[0], 1 - take + rate * cell.past[0]


class SolidArrays(SolidNetwork):
    """A trained network as numpy arrays, by the names of `solid_shapes`."""

    xp = NUMPY

    def __init__(self, config: SolidConfig, arrays: Mapping[str, np.ndarray]) -> None:
        self.config = config
        self.segment_w: list[np.ndarray] = []
        self.segment_b: list[np.ndarray] = []
        for name, value in arrays.items():
            group, _, index = name.partition(".")
            setattr(self, group, [*getattr(self, group, ()), value] if index else value)


def solid_shapes(c: SolidConfig, geometries: int, materials: int) -> dict[str, tuple[int, ...]]:
    """Shapes of a network's parameters in a file, by name."""
    rows, code = 1 + c.paint_lines + c.kind_lines, c.code + c.hidden
    decoder = {"lines": (code + 1, LINES * (c.units + 1), FEATURES), "radius": (code + 1,)}
    return {
        "codes": (geometries, c.code),
        "material_codes": (materials, c.material_code),
        "albedo": (c.material_code + 1, 4),
        **({"lift_w": (c.code, c.hidden), "lift_b": (c.hidden,)} if c.hidden else {}),
        **(decoder if c.units else _layer_shapes("decoder", code, 3, c.width)),
        "cell_lines": (TOKENS, 2, rows),
        "cell_gain": (TOKENS, rows),
        "cell_bias": (TOKENS, rows),
        "candidate": (TOKENS,),
        "bump": (TOKENS,),
        **(_layer_shapes("segment", code, SEGMENT, c.segment) if c.segment else {}),
    }


def _layer_shapes(name: str, code: int, inputs: int, width: int) -> dict[str, tuple[int, ...]]:
    sizes = [inputs, width, width, 1]
    weights = {f"{name}_w.{i}": (code + 1, *sizes[i : i + 2]) for i in range(3)}
    return {**weights, **{f"{name}_b.{i}": (code + 1, sizes[i + 1]) for i in range(3)}}
