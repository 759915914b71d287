"""The plane's network, from top to bottom, for parameters of either library.

Letters: B streams, N objects, M points, d coordinates of a point, C = `code`, C' = C + `hidden` + 1, F =
`features`, S = `state`, G = `decoder_width`, L = `paint_lines`, R = numbers in the register. Distances are in
world units, leaf coordinates in leaf units. Points lie last, (…, channels, M), so that arithmetic runs over
contiguous numbers.

The frame gives a point's leaf coordinates exactly (`frames.py`). Two learned parts then draw:

1. The decoder turns leaf coordinates into F distance-like features. Its weights are a linear function of
   the object's code, behind a hidden layer, so that shapes live in codes. Its units are norms (`units.py`),
   or, in networks of before, rectified linear. Its output is multiplied by the object's distance scale.
2. The cell is an LSTM (Hochreiter and Schmidhuber 1997) whose gates are clamped lines in what it is shown
   and what it remembers, chosen by the boolean token. A part of it is a register that carries the colour
   under one gate of its own, so that colour is kept, not re-learned.

No point looks at another and nothing here knows a leaf, an operator's formula, a pixel or a library.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from scenelang.compiler.lifting import PLANE_LAYOUT, Layout
from scenelang.drawing.arrays import NUMPY, Array, Layers
from scenelang.drawing.neural.units import FEATURES, UP, LeafUnits
from scenelang.drawing.solid.norms import LINES, Lifted
from scenelang.language.words import TOKENS as WORDS

TOKENS = len(WORDS)
EMPTY = 1.0  # world units: the margin before the first object, out of reach of every blend
MOST_KNOWN = 1024  # decoders that are kept
RADIUS = 2.0  # leaf units: the decoder sees points in this disc, farther ones at its rim


@dataclass(frozen=True, slots=True)
class FramedConfig:
    """Sizes of the network."""

    code: int = 4  # entries of the geometry code
    material_code: int = 12  # entries of the material code
    features: int = 1  # distance-like features F of an object at a point
    state: int = 1  # entries S of the LSTM state
    decoder_width: int = 32  # hidden units of the decoder's two layers, where they are rectified
    units: int = 0  # norm units of the decoder, without those of notches; 0: it has rectified ones
    hidden: int = 0  # rectified units between the codes and the weights of norms
    paint_lines: int = 2  # lines L of which the highest opens the register's gate


class Decoder(NamedTuple):
    """Weights of objects' decoders."""

    layers: Layers
    far: Array  # (F, 1): growth of the features beyond the rim


class Cell(NamedTuple):
    """Weights of the cell, of one token or with tokens or objects in front."""

    lines: Array  # (…, S + L, F + S)
    bias: Array  # (…, S + L)
    candidate: Array  # (…, S, F)
    bump: Array  # (…, S, 1): by how much a half-open gate lowers the state, times four


class FramedNetwork(Lifted):
    """The formulas of the network, over parameters of `FramedArrays` or of torch's module `Framed`."""

    config: FramedConfig
    layout: Layout = PLANE_LAYOUT
    codes: Any  # (geometries, C)
    material_codes: Any  # (materials, material_code)
    albedo: Any  # (material_code + 1, 3)
    decoder_w: Any  # (C + 1, d, G), (C + 1, G, G), (C + 1, G, F), or none
    decoder_b: Any  # (C + 1, G), (C + 1, G), (C + 1, F), or none
    far: Any  # (F,): growth of the features beyond the rim, or none
    cell_lines: Any  # (TOKENS, F + S, S + L)
    cell_gain: Any  # (TOKENS, S + L): a logarithm
    cell_bias: Any  # (TOKENS, S + L)
    candidate: Any  # (TOKENS, F, S)
    bump: Any  # (TOKENS, S)
    read_slope: Any  # a logarithm
    until_s: float = float("inf")  # processor seconds of the process when the picture has to be done

    def decoder_weights(self, code: Array) -> Decoder:
        """Decoders of objects from codes (M, C): each weight is linear in (code, 1)."""
        one = self.xp.concat([code, self.xp.full((len(code), 1), 1.0, code)], 1)  # (M, C + 1)
        layers = []
        for w, b in zip(self.decoder_w, self.decoder_b, strict=True):
            mixed = one[None] @ w.reshape(1, len(w), -1)  # (1, M, in * out)
            layers.append((mixed.reshape(len(code), *w.shape[1:]).swapaxes(1, 2), one @ b))
        return Decoder(layers, self.far[:, None])

    def decoders(self, codes: Array) -> list[Any]:
        """Decoders of the codes (M, C): `LeafUnits`, or of a network of before mixed together."""
        if self.config.units:
            return [LeafUnits(self.xp, self.norms(code, RADIUS, UP, notched=True)) for code in codes]
        layers, far = self.decoder_weights(codes)
        return [Decoder([(self.xp.packed(w[i]), b[i]) for w, b in layers], far) for i in range(len(codes))]

    def cell_weights(self) -> tuple[Array, ...]:
        """The `Cell`, with tokens in front; the steeper a gate, the lower its bump, for narrow blends."""
        gain = self.xp.exp(self.cell_gain)
        bump = self.bump / gain[:, : self.config.state]
        lines = (self.cell_lines * gain[:, None]).swapaxes(1, 2)
        candidate = self.candidate.clip(-1.0, 1.0).swapaxes(1, 2)
        return Cell(lines, self.cell_bias, candidate, bump[..., None])

    def object_albedo(self, material_code: Array) -> Array:
        """Albedo (M, 3) of material codes (M, material_code); one constant value a material."""
        return material_code @ self.albedo[:-1] + self.albedo[-1]

    def decode(self, q: Array, radius: Array | None, scale: Array | float, decoder: Any) -> Array:
        """Features (…, F, M) of leaf coordinates (…, d, M), whose lengths ``radius`` are None where none lies
        beyond `RADIUS`; ``scale`` is the world distance per leaf distance. Of norms, of (d, M).
        """
        if not isinstance(decoder, Decoder):
            return decoder.distance(q)[None] * scale
        if radius is None:
            return self.xp.perceptron(q, decoder.layers) * scale  # (…, F, M)
        x = self.xp.perceptron(q * (RADIUS / radius.clip(RADIUS)), decoder.layers)
        return (x + (radius - RADIUS).clip(0.0) * decoder.far) * scale

    def update(
        self, levels: Array, candidate: Array, bump: Array, state: Array, colour: Array, object_colour: Array
    ) -> tuple[Array, Array]:
        """State (…, S, M) and register (…, R, M) behind the gates, whose levels (…, S + L, M) are not yet
        clamped; where a gate is open the state becomes ``candidate`` (…, S, M). ``bump`` is as in `Cell`, or
        (…, S, M).
        """
        s, xp = self.config.state, self.xp
        take = levels[..., :s, :].clip(0.0, 1.0)
        paint = xp.largest(levels[..., s:, :]).clip(0.0, 1.0)
        state = xp.add_product(state, take, candidate - state) - take * (1 - take) * bump
        return state, xp.add_product(colour, paint, object_colour - colour)


class FramedArrays(FramedNetwork):
    """A trained network as numpy arrays, by the names of `parameter_shapes`."""

    xp = NUMPY

    def __init__(self, config: FramedConfig, arrays: Mapping[str, np.ndarray]) -> None:
        self.config = config
        self._known: dict[bytes, Any] = {}  # decoders by their codes
        for name, value in arrays.items():
            setattr(self, name, value)
        if not config.units:
            self.decoder_w, self.decoder_b = ([arrays[f"decoder_{k}.{i}"] for i in range(3)] for k in "wb")

    def decoders(self, codes: Array) -> list[Any]:
        keys = [code.tobytes() for code in codes]
        if len(self._known) > MOST_KNOWN:
            self._known.clear()
        new = [at for at, key in enumerate(keys) if key not in self._known]
        for at, decoder in zip(new, super().decoders(codes[new]) if new else (), strict=True):
            self._known[keys[at]] = decoder
        return [self._known[key] for key in keys]


def parameter_shapes(
    c: FramedConfig, geometries: int, materials: int, d: int = 2
) -> dict[str, tuple[int, ...]]:
    """Shapes of a network's parameters in a file, by name."""
    sizes, rows = [d, c.decoder_width, c.decoder_width, c.features], c.state + c.paint_lines
    code = c.code + c.hidden + 1
    norms = {"lines": (code, LINES * (c.units + 2), FEATURES), "radius": (code,)}
    layers = {
        **{f"decoder_w.{i}": (c.code + 1, *sizes[i : i + 2]) for i in range(3)},
        **{f"decoder_b.{i}": (c.code + 1, sizes[i + 1]) for i in range(3)},
        "far": (c.features,),
    }
    return {
        "codes": (geometries, c.code),
        "material_codes": (materials, c.material_code),
        "albedo": (c.material_code + 1, 3),
        **({"lift_w": (c.code, c.hidden), "lift_b": (c.hidden,)} if c.hidden else {}),
        **(norms if c.units else layers),
        "edge_slope": (),
        "cell_lines": (TOKENS, c.features + c.state, rows),
        "cell_gain": (TOKENS, rows),
        "cell_bias": (TOKENS, rows),
        "candidate": (TOKENS, c.features, c.state),
        "bump": (TOKENS, c.state),
        "read_slope": (),
    }
