"""The flat tables of a scene of the plane, which the kernel draws; the dtypes mirror ``kernel/scene.h``."""

from __future__ import annotations

from typing import Final

import numpy as np

from scenelang.assets.element import Element
from scenelang.compiler.groups import SMOOTH, UNION
from scenelang.compiler.program import ProgramError
from scenelang.drawing.how import Samples
from scenelang.drawing.image import sample_places
from scenelang.drawing.neural.assets import GridShape, GrownShape
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.outlines import table_of
from scenelang.drawing.neural.units import FEATURES, LeafUnits
from scenelang.drawing.tables import (
    GRID,
    GROWN,
    LINES,
    NORMS,
    SKINNED,
    TEXTURE,
    UNITS,
    Held,
    Rows,
    dtype_of,
    texture_row,
)

STEP: Final = dtype_of("i4 kind", "f4 steep rate number[6]")
SHAPE: Final = dtype_of(
    "f4 scale reach calm low[2] high[2] first wall last colour[4]",
    "i4 flags leaf step steps texture depth path[15]",
)
LEAF: Final = dtype_of(
    "i4 kind units size[9] inner features feature[10] width side",
    "f4 radius slope line[27,11] steep[27] whole[9]",
    "u8 data first near posts begins passing",
)
JOINT: Final = dtype_of("i4 flags", "f4 own[3] past[3] bias[3] candidate bump width stretch")
FLAT: Final = dtype_of(
    "i4 objects groups deepest clear traced rounded",
    "f4 slope empty over_unit",
    "u8 shape step leaf joint texture",
)
PAGE: Final = dtype_of(
    "f8 west north step",
    "i4 width height samples count channels",
    "f4 px corner near extent background[3] place[32]",
)
CORNERS: Final = {4: 0.36, 16: 0.54}  # pixels from the centre to the farthest of samples, a little rounded up
NEAR: Final = 0.85  # pixels: farther from an outline a pixel has one colour
JOINS_UNION, DRAWN, WILD, SMOOTHS, CUTS = (1 << bit for bit in range(5))  # flags of joints and shapes
OUTLINE: Final = 5  # a kind of decoder
WAYS: Final = ("adaptive", "four", "one", "owners")
UNKNOWN: Final = 1e9  # a slope of which nothing is known


class FlatTables(Held):
    """The kernel's view of a field of the plane; keeps the arrays that the `FLAT` row points to.

    Raises `ProgramError` where a number is none, or an element or a decoder is more than the kernel knows.
    """

    def __init__(self, field: Field) -> None:
        super().__init__()
        count, groups = len(field.tokens), field.groups
        shapes = np.zeros(count, SHAPE)
        reach = field.reach
        low, high = field.frames.boxes(np.where(np.isinf(reach), 0.0, reach))
        every = np.isinf(reach) | np.isnan(low + high).any(0)
        most = np.finfo(np.float32).max
        shapes["low"] = np.where(every, -most, np.clip(low - 1e-6, -most, most)).T
        shapes["high"] = np.where(every, most, np.clip(high + 1e-6, -most, most)).T
        steps, shapes["steps"] = field.frames.steps(STEP)
        shapes["step"] = shapes["steps"].cumsum() - shapes["steps"]
        shapes["scale"], shapes["calm"] = field.frames.scale, 1 / field.frames.stretch
        shapes["reach"] = np.minimum(reach, most)
        if field.skins is not None:
            for name in ("first", "wall", "last"):
                shapes[name] = getattr(field.skins, name)
        colours = np.asarray(field.xp.to_numpy(field.colours)).T
        shapes["colour"][:, : colours.shape[1]] = colours
        shapes["colour"][:, 3] = field.opacity
        shapes["texture"] = field.texture
        shapes["depth"], shapes["path"] = (groups.path >= 0).sum(1), -1
        shapes["path"][:, : groups.deepest] = groups.path
        flags = ((SKINNED, field.skinned), (WILD, field.frames.wild))
        shapes["flags"] = sum(flag * mask.astype(np.int32) for flag, mask in flags)
        leaves, shapes["leaf"] = self._leaves(field)
        textures = np.zeros(len(field.textures), TEXTURE)
        for at, (row, texture) in enumerate(zip(textures, field.textures, strict=True)):
            paint = field.paints[int(np.argmax(field.texture == at))]
            assert paint is not None
            texture_row(self, row, paint, texture, field.xp)
        joints = np.zeros(count + len(groups.joins), JOINT)
        cells = field.cells
        if cells.lines.shape[1:] != (3, 2):
            raise ProgramError("a cell of other lines than the kernel knows")
        joints["own"], joints["past"] = cells.lines.transpose(2, 0, 1)
        joints["bias"], joints["candidate"], joints["bump"] = (
            cells.bias,
            cells.candidate[:, 0, 0],
            cells.bump[:, 0, 0],
        )
        joints["width"], joints["stretch"] = field.widths, field.stretch
        kinds = ((JOINS_UNION, field.operators == UNION), (SMOOTHS, field.operators == SMOOTH))
        for flag, mask in (*kinds, (CUTS, field.operators > SMOOTH)):
            joints["flags"] |= flag * mask.astype(np.int32)
        traced = field.textured or field.blended or groups.deepest > 0
        sizes = count, len(groups.joins), groups.deepest, field.clear, traced, field.rounded
        numbers = field.slope, field.nothing, 1 / field.unit
        tables = map(self.held, (shapes, steps, leaves, joints, textures))
        self.scene = np.array((*sizes, *numbers, *tables), FLAT)

    def _leaves(self, field: Field) -> tuple[Rows, np.ndarray]:
        """Rows of decoders, and which of them each object has."""
        keys = [
            (shape, held if held is not None and held.curved else None)
            for shape, held in zip(field.shape.tolist(), field.brought, strict=True)
        ]
        number = {key: at for at, key in enumerate(dict.fromkeys(keys))}
        rows = np.zeros(len(number), LEAF)
        for row, (at, outline) in zip(rows, number, strict=True):
            shape = field.shapes[at]
            if outline is not None:
                self._outline(row, outline)
            elif isinstance(shape, GridShape):
                row["kind"], row["width"] = GROWN if isinstance(shape, GrownShape) else GRID, shape.side
                row["slope"] = min(shape.steepest(), UNKNOWN)
                row["data"] = self.held(np.asarray(field.xp.to_numpy(shape.nodes), np.float32))
            elif isinstance(shape, LeafUnits):
                _units(row, shape)
            else:
                raise ProgramError("a decoder that the kernel does not know")
        return rows, np.array([number[key] for key in keys], np.int32)

    def _outline(self, row: Rows, element: Element) -> None:
        table = table_of(element)
        pieces = np.zeros((table.pieces.shape[1], 16), np.float32)
        pieces[:, :8] = table.pieces.T
        pieces[:, 10:12] = way = pieces[:, 6:8] - pieces[:, :2]
        pieces[:, 12] = 1 / np.maximum((way * way).sum(1), 1e-12)
        row["kind"], row["width"], row["side"], row["slope"] = OUTLINE, len(pieces), table.side, 1.05
        row["data"], row["posts"] = self.held(pieces), self.held(table.posts)
        for name in ("first", "near", "begins", "passing"):
            row[name] = self.held(getattr(table, name).astype(np.int32))


def tables_of(field: Field) -> FlatTables:
    """The tables of a field, made once."""
    if field.tables is None:
        field.tables = FlatTables(field)
    tables: FlatTables = field.tables
    return tables


def _units(row: Rows, shape: LeafUnits) -> None:
    """Fill a row of norm units; raises `ProgramError` for more than a row holds."""
    layers, xp = shape.layers, shape.xp
    w, b = (np.asarray(xp.to_numpy(part)) for part in (layers.w, layers.b))
    if len(b) > LINES or len(layers.units) > UNITS:
        raise ProgramError(f"a decoder of {len(b)} lines, at most {LINES}")
    row["kind"], row["units"], row["inner"] = NORMS, len(layers.units), layers.inner
    row["size"][: 1 + len(layers.units)] = layers.notch, *layers.units
    row["features"], row["feature"][: len(layers.features)] = len(layers.features), layers.features
    row["radius"] = np.asarray(xp.to_numpy(layers.radius))
    row["line"][: len(b), : w.shape[1]], row["line"][: len(b), FEATURES - 1] = w, b
    row["steep"][: len(b)] = shape.steep
    row["whole"][: 1 + len(layers.units)] = shape.whole


def page_row(
    canvas: tuple[int, int], count: int, samples: Samples | str, background: np.ndarray | None = None
) -> Rows:
    """The `PAGE` row of a picture with so many samples a pixel."""
    width, height = canvas
    px = 2 / min(width, height)  # world units
    page = np.zeros((), PAGE)
    page["west"], page["north"], page["step"] = (0.5 - width / 2) * px, (height / 2 - 0.5) * px, px
    page["width"], page["height"], page["count"] = width, height, count
    page["samples"], page["channels"] = WAYS.index(samples), 4 if background is None else 3
    page["px"], page["corner"] = px, CORNERS[count]
    page["near"] = NEAR + (CORNERS[count] - CORNERS[4])
    page["extent"] = max(width, height) * px / 2
    page["background"] = 0.0 if background is None else background
    places = (sample_places(count) - 0.5).astype(np.float32) * np.float32(px)
    page["place"][:count], page["place"][16 : 16 + count] = places
    return page
