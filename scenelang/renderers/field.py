"""The framed renderer's field: what it answers at points, whoever asks and by whichever library.

Letters are those of `network.py`. Each object's frame (`frames.py`) carries points into its own space, where
the network meets them. Nothing here knows a pixel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scenelang.elements.element import Element
from scenelang.program.paints import Paint
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array
from scenelang.renderers.frames import FAR, ObjectFrame, local_points, read_frame
from scenelang.renderers.grid import GridShape, grid_shape
from scenelang.renderers.network import EMPTY, Cell, Decoder, FramedNetwork
from scenelang.renderers.texture import Texture

UNION, SMOOTH, SUBTRACT, INTERSECT = range(4)
SLACK = 0.02  # leaf units by which a learned outline may leave the unit disc
BLEND = 0.15  # world units: the width of the blends that the cell is trained on
FARTHER = 2.0  # widths of a blend at which objects cannot change it


@dataclass(frozen=True, slots=True)
class Row:
    """One object, ready to be met.

    Args:
        number: of the object, from 0.
        token: how it joins what came before.
        colour: (R, 1): three numbers, and where some object has a texture, whether this one has, and 1.
        shape: of its leaf, learned or brought by a user.
        paint, texture: in place of the colour, what users brought.
        reach: leaf units from its origin beyond which it changes nothing; inf where it concerns every point.
        width: of the blend by which it joins.
        cell: the weights of its token and of that width.
    """

    frame: ObjectFrame
    number: int
    token: int
    colour: Array
    shape: Decoder | GridShape
    brought: Element | None
    paint: Paint | None
    texture: Texture | None
    reach: float
    width: float
    cell: Cell

    @property
    def draws(self) -> bool:
        """Whether something may be seen, where it is met, of what was empty before."""
        return self.token in (UNION, SMOOTH)


class Field:
    """A program's objects with their weights, ready to be met by points.

    Args:
        network: trained parameters, on any device.
        vectors: (N, 64) float32, geometry and material vectors.
        brought: what users brought, None where a row shows a geometry of the model; all of them if left out.
        paints: likewise, None where a row has the colour of its vector.
        frames: of geometry vectors that were read before, by their bytes.

    Raises:
        ProgramError: an object's vector holds no way from the world to a leaf, or an element cannot be drawn.
    """

    def __init__(
        self,
        network: FramedNetwork,
        vectors: np.ndarray,
        tokens: np.ndarray,
        brought: Sequence[Element | None] | None = None,
        paints: Sequence[Paint | None] | None = None,
        *,
        frames: Mapping[bytes, ObjectFrame] | None = None,
    ) -> None:
        self.network, self.xp = network, network.xp
        self.vectors = vectors
        self.layout = layout = network.layout
        self.codes = np.array(sorted(set(map(tuple, vectors[:, : layout.code].tolist()))), np.float32)
        """Of the leaves in use (K, C)."""
        geometry = {vector.tobytes(): vector for vector in vectors[:, : layout.geometry]}
        known = frames or {}
        self.frames = {k: known.get(k) or read_frame(vector, layout) for k, vector in geometry.items()}
        with self.xp.inference():
            self.cells = [
                Cell(*map(self.xp.packed, cell)) for cell in zip(*network.cell_weights(), strict=True)
            ]
            self.slope = float(self.xp.exp(network.read_slope)) / 4
            self.unit = float(np.linalg.norm(self.xp.to_numpy(self.cells[UNION].candidate[0])))
            """Growth of the margin per world unit."""
            self.widest = BLEND
            """Of the blends, at least the usual one."""
            none = [None] * len(tokens)
            self.textured = any(paints or none)
            """Whether some object has a texture."""
            self.rows = self._rows(vectors, tokens, brought or none, paints or none)

    def _rows(
        self,
        vectors: np.ndarray,
        tokens: np.ndarray,
        brought: Sequence[Element | None],
        paints: Sequence[Paint | None],
    ) -> list[Row]:
        if not len(vectors):
            return []
        xp, layout = self.xp, self.layout
        g, m = vectors[:, : layout.geometry], vectors[:, layout.geometry :]
        like = self.network.codes
        layers, far = self.network.decoder_weights(xp.array(self.codes, like))
        shapes = {
            tuple(code): Decoder([(xp.packed(w[i]), b[i]) for w, b in layers], far)
            for i, code in enumerate(self.codes.tolist())
        }
        grids = {element: grid_shape(element, xp, like) for element in {*brought} if element is not None}
        if grids and self.network.config.features != 1:
            raise ProgramError("elements for a network that knows more than distances")
        codes_m = xp.array(m[:, layout.material_code].copy(), like)
        albedo = self.network.object_albedo(codes_m)
        albedo = xp.concat([albedo, xp.full((len(g), 1), 1.0, like)], 1)
        matrix = xp.array(m[:, layout.colour].reshape(-1, 3, 4).copy(), like)
        colours = (matrix @ albedo[:, :, None]).clip(0.0, 1.0)  # (N, 3, 1)
        widths = np.where(vectors[:, layout.blend] > 0, vectors[:, layout.blend].astype(float), BLEND)
        # the widest of the smooth unions from each row on, 0 for none
        blends_after = np.maximum.accumulate(np.where(tokens == SMOOTH, widths, 0.0)[::-1])[::-1]
        self.widest = max(BLEND, float(blends_after[0]))
        textures: dict[tuple[Paint, bytes], Texture] = {}
        rows = []
        for i, token in enumerate(tokens.tolist()):
            frame = self.frames[g[i].tobytes()]
            if token == INTERSECT or (token == SUBTRACT and blends_after[i]):
                reach = float("inf")
            else:
                reach = 1.0 + SLACK + FARTHER * blends_after[i] / frame.scale
            cell = self.cells[token]
            if token == SMOOTH and widths[i] != BLEND:
                # The fold of s d and s D is s D', so that the cell's own width is that of any other.
                scale = BLEND / float(widths[i])
                cell = Cell(cell.lines * scale, cell.bias, cell.candidate, cell.bump / scale)
            element = brought[i]
            learned = shapes[tuple(g[i, : layout.code].tolist())]
            shape = learned if element is None else grids[element]
            texture, paint, colour = None, paints[i], colours[i]
            if paint is not None and token in (UNION, SMOOTH):  # the others leave colours as they are
                texture = textures.get(key := (paint, m[i, :6].tobytes()))
                texture = textures[key] = texture or Texture(xp, paint, m[i, :6], like, light=False)
            if self.textured:
                worn = [0.0 * colour, 0.0 * colour[:1] + 1.0] if texture else [colour, 0.0 * colour[:1]]
                colour = xp.concat([*worn, 0.0 * colour[:1] + 1.0], 0)
            looks = colour, shape, element, paint, texture
            rows.append(Row(frame, i, token, *looks, float(reach), float(widths[i]), cell))
        return rows

    def empty(self, count: int) -> Array:
        """State and register (S + R, M) of points that have met nothing."""
        rows = self.network.config.state + (5 if self.textured else 3)
        memory = self.xp.full((rows, count), 0.0, self.network.codes)
        memory[0] = EMPTY * self.widest / BLEND
        return memory

    def texture(self, row: Row, p: Array) -> Array:
        """Colours (3, M) of an object with a texture at world points (d, M)."""
        assert row.texture is not None
        return row.texture.at(self.local(row, p))

    def local(self, row: Row, p: Array) -> Array:
        """Leaf coordinates of world points, both (d, M)."""
        return local_points(self.xp, row.frame, p)

    def meet(self, row: Row, q: Array, radius: Array | None, memory: Array) -> tuple[Array, Array]:
        """Let points meet an object.

        Args:
            q: their leaf coordinates (d, M).
            radius: the lengths of those (M,); None where none is beyond `RADIUS`.
            memory: state and register (S + R, M).

        Returns:
            State and register, and the object's distances (M,), world units.
        """
        s = self.network.config.state
        if isinstance(row.shape, GridShape):
            features = row.shape.distance(q)[None] * row.frame.scale
        else:
            features = self.network.decode(q, radius, row.frame.scale, row.shape)
        if row.frame.wild:
            features = features.clip(-FAR, FAR)
        new = self.network.step(features, memory[:s], memory[s:], row.colour, row.cell)
        return self.xp.concat(new, 0), features[0]

    def picture(self, memory: Array) -> Array:
        """Premultiplied colour and coverage (4, M), in [0, 1], of points that have met all objects."""
        coverage = (0.5 - memory[0] * self.slope).clip(0.0, 1.0)
        s = self.network.config.state
        return self.xp.concat([memory[s : s + 3] * coverage, coverage[None]], 0)
