"""The flat tables of a scene of solids: arrays of all objects, for the kernel and for numpy's field.

They are made once, for all objects at a time, from the vectors of a Program and the weights of its network.
Whatever is in a vector, an index leads to what there is and numbers are finite, or `ProgramError` is raised:
the kernel trusts in that. The dtypes mirror ``kernel/scene.h``.

Letters: N objects, G groups, R rows of the register.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import Element, Gradient
from scenelang.compiler.groups import (
    INTERSECT,
    OPERATOR,
    SMOOTH,
    SUBTRACT,
    UNION,
    Floats,
    Groups,
    Index,
    Mask,
    felt,
    read_groups,
    widths_of,
)
from scenelang.compiler.lifting import LAYOUTS, STRENGTHS, Layout, Parts
from scenelang.compiler.program import STEPS as COLOUR_STEPS
from scenelang.compiler.program import Paint, ProgramError
from scenelang.compiler.spaces import AMBIENT, EXTINCTION, LIFT, NEAREST, Stage
from scenelang.drawing.arrays import Smooth
from scenelang.drawing.neural.assets import grid_shape, texture_of
from scenelang.drawing.neural.frames import MOST, read_skins
from scenelang.drawing.solid.march import MarchSettings
from scenelang.drawing.solid.network import BLEND, Formula, SolidCell, SolidNetwork, Wanted, element_box
from scenelang.drawing.solid.norms import Norms

UNITS, LINES, WIDEST = 8, 27, 32  # of decoders at most
DRAWS, CLIPS, BEGINS, BOXED, SKINNED, BUMPY, STOPS, MEDIUM, WIDER = (1 << bit for bit in range(9))
MAP, TURN_Z, TURN_Y = range(3)  # kinds of steps
NORMS, SILU, GRID, GROWN, FORMULA = range(5)  # of decoders
FORMULAS = ("sphere", "torus", "box", "cylinder", "cone", "capsule", "octahedron")  # those that are known
PICTURE, SPACE, LINEAR, RADIAL = range(4)  # of textures


def dtype_of(*kinds: str) -> np.dtype[Any]:
    """The dtype of a struct: of each kind, f4, i4 or u8 for an address, members, arrays with their sides."""
    fields: list[Any] = []
    for kind, *members in map(str.split, kinds):
        for member in members:
            name, _, sides = member.rstrip("]").partition("[")
            fields.append((name, kind, tuple(map(int, filter(None, sides.split(","))))))
    return np.dtype(fields, align=True)


OBJECT = dtype_of(
    "f4 map[12] scale reach moved radius ball rate centre[3] extent low[3] high[3] amount frequency",
    "f4 first wall last late detail look[12]",
    "i4 flags ends decoder step steps texture depth path[15]",
)
STEP = dtype_of("i4 kind", "f4 twirl rate map[12]")
DECODER = dtype_of("i4 kind units size[8] inner features feature[7] width", "f4 radius line[27,8]", "u8 data")
CELL = dtype_of("f4 own[5] past[5] bias[5] candidate bump", "i4 smooth")
TEXTURE = dtype_of("i4 kind wide high stops steps", "f4 place[8]", "u8 data step")
PIECE = dtype_of("i4 ray", "f4 begin end before sigma")
SCENE = dtype_of(
    "i4 objects groups deepest rows switched clipping media mixed hues dense coloured",
    "f4 sigma reach",
    "u8 object step decoder cell texture",
)
LAMP = dtype_of("f4 at[3] power[3] radius")
STAGE = dtype_of(
    "f8 forward[3] right[3] up[3] px",
    "f4 eye[3] horizon[3] zenith[3] ground[3] floor gap ambient[2] fade nearest lift contrast deep[3]",
    "f4 exposure",
    "i4 lamps grounded transparent glow width height count every nodes",
    "u8 lamp opaque hazy",
)
NODE = dtype_of("f4 p[3] n[3] sent[3] colour[3] weight")
AROUND = dtype_of(
    "f4 low[3] side horizon[3] zenith[3] floor fade scale warp corner[3] spacing",
    "i4 nodes first near counts[3] ground grounded hollow lamps sides[3] steps discs",
    "u8 node index alike about lamp haze disc",
)

SLACK = 0.002  # leaf units by which a learned surface may leave the unit ball
LOOSE = 0.03  # the same, per leaf unit, of one that grows
SMALL = 1.7  # a side of a box that is worth the asking
TAGS = np.array([[0.618034], [0.754878], [0.569840]])  # parts of whole numbers times these lie apart
MOST_RATE = 1e30  # so that it stays in float32

Rows = npt.NDArray[Any]  # of one of the dtypes


def finite(table: Rows) -> bool:
    """Whether all numbers of an array, or of a table's rows, are."""
    parts = [table[name] for name in table.dtype.names] if table.dtype.names else [table]
    return all(bool(np.isfinite(part).all()) for part in parts)


class Ways(NamedTuple):
    """The ways of N objects to their leaves: an outer map, and what may follow it, in float64.

    Args:
        outer: (N, 3, 4) into the space in which an object lies in a ball about the origin.
        turns: (N, 4, 3) outer and inner slots of twirl, bend and twist.
        middle: (N, 3, 4) map between the outer slots and the inner ones.
        warped: (N,) whether there are outer slots; else the middle map is part of the outer one.
        scale: (N,) world distance per leaf distance, the smallest singular value of the composed map.
        reach, moved: (N,) the ball that holds a leaf ball of radius r has the radius reach r + moved.
        bulge: (N, 2) amount and frequency of a displacement.
    """

    outer: Floats
    turns: Floats
    middle: Floats
    warped: Mask
    scale: Floats
    reach: Floats
    moved: Floats
    bulge: Floats

    def ball(self, radius: Floats) -> Floats:
        """Radii (N,) of balls behind `outer` outside which leaf coordinates are longer than ``radius``."""
        return self.reach * radius + self.moved

    def rate(self, radius: Floats) -> Floats:
        """World units by which distances (N,) change at most, in leaf balls, per step of 1 behind `outer`.

        A turn's derivative is a rotation times ``1 + u v^T``, u the point turned by a right angle in the
        plane of the turn and v the angle's gradient: with m = |u| |v| and c = u . v the larger singular value
        is ``(m + sqrt(m² + 4 + 4 c)) / 2``.
        """
        growth: Floats = self.scale * (1.0 + abs(self.bulge[:, 0] * self.bulge[:, 1]))
        growth[self.warped] *= np.linalg.norm(self.middle[self.warped, :, :3], 2, axis=(1, 2))
        balls = self.ball(radius), self.ball(radius), radius, radius
        for ball, (twirl, bend, twist) in zip(balls, abs(self.turns).transpose(1, 2, 0), strict=True):
            # an outer turn of an object without outer slots is none
            m, along = ball * (twirl + bend), ball * bend
            growth *= (m + np.sqrt(m * m + 4 + 4 * along)) / 2
            m = ball * twist
            growth *= (m + np.sqrt(m * m + 4)) / 2
        return np.minimum(growth, MOST_RATE)

    def steps(self) -> tuple[Rows, npt.NDArray[np.int32]]:
        """Rows of all steps behind `outer`, objects in turn, and how many each has (N,)."""
        count = len(self.scale)
        rows = np.zeros((count, 9), STEP)
        rows["kind"] = [TURN_Z, TURN_Y] * 2 + [MAP] + [TURN_Z, TURN_Y] * 2
        for slot, at in enumerate((0, 2, 5, 7)):
            twirl, bend, twist = self.turns[:, slot].T
            rows["twirl"][:, at], rows["rate"][:, at], rows["rate"][:, at + 1] = twirl, bend, twist
        rows["map"][:, 4] = _map(self.middle)
        there = (rows["twirl"] != 0) | (rows["rate"] != 0)
        there[:, 4] = self.warped
        return rows[there], there.sum(1).astype(np.int32)


def _map(affine: Floats) -> npt.NDArray[np.float32]:
    """Matrices (N, 9), row by row, and the shifts behind them, of (N, 3, 4)."""
    flat = np.concatenate([affine[:, :, :3].reshape(-1, 9), affine[:, :, 3]], 1)
    return flat.astype(np.float32)


def read_ways(vectors: npt.NDArray[np.floating], layout: Layout = LAYOUTS[3]) -> Ways:
    """The ways that vectors (N, 64) hold; raises `ProgramError` where one leads to no leaf."""
    wide = vectors.astype(np.float64)
    if not (abs(wide[:, : layout.geometry]) < MOST).all():
        raise ProgramError("a frame beyond float32")
    parts = layout.unpack(wide)
    last, middle = parts.frame.reshape(-1, 3, 4), parts.middle.reshape(-1, 3, 4)
    whole = middle[:, :, :3] @ last
    whole[:, :, 3] += middle[:, :, 3]
    stretches = np.linalg.svd(whole[:, :, :3], compute_uv=False)
    if not ((stretches[:, 2] > 1 / MOST) & (stretches[:, 0] < MOST)).all():
        raise ProgramError("a frame beyond float32")
    warped = (parts.outer != 0).any(1)
    reach, moved = np.ones(len(wide)), np.zeros(len(wide))
    if warped.any():
        back = inverses(middle[warped, :, :3])
        reach[warped] = np.linalg.norm(back, 2, axis=(1, 2))
        moved[warped] = np.linalg.norm((back @ middle[warped, :, 3:])[..., 0], axis=1)
    return Ways(
        outer=np.where(warped[:, None, None], last, whole),
        turns=np.concatenate([parts.outer, parts.inner], 1).reshape(len(wide), 4, STRENGTHS),
        middle=middle,
        warped=warped,
        scale=1 / stretches[:, 0],
        reach=reach,
        moved=moved,
        bulge=parts.bulge,
    )


def inverses(linear: Floats) -> Floats:
    """Inverses of linear maps (…, 3, 3); raises `ProgramError` where float32 has none."""
    try:
        result = np.asarray(np.linalg.inv(linear), np.float64)
    except np.linalg.LinAlgError:
        raise ProgramError("a damaged program: a frame without an inverse") from None
    if not (abs(result) < MOST).all():
        raise ProgramError("a frame beyond float32")
    return result


class Objects(NamedTuple):
    """Rows of N objects, `OBJECT`, without decoders and looks, and `STEP` rows of what leads to their leaves.

    ``wide`` (N,) are those whose balls hold more than what their leaves change.
    """

    rows: Rows
    steps: Rows
    wide: Mask

    def flagged(self, flag: int) -> Mask:
        """A mask (N,) of the rows that have a flag."""
        return np.asarray(self.rows["flags"] & flag > 0)


def read_objects(
    vectors: npt.NDArray[np.floating], layout: Layout, groups: Groups, widths: Floats, reach: float = 0.0
) -> Objects:
    """The objects of a stream, whose groups and widths of blends are as of `felt`, with distances up to
    ``reach`` around them; raises `ProgramError`.
    """
    with np.errstate(all="ignore"):
        return _read_objects(vectors, layout, groups, widths, reach)


def _read_objects(
    vectors: npt.NDArray[np.floating], layout: Layout, groups: Groups, widths: Floats, reach: float
) -> Objects:
    ways, count = read_ways(vectors, layout), len(vectors)
    skins = read_skins(layout.unpack(vectors))
    amount, frequency = ways.bulge.T
    grown = np.zeros(count) if skins is None else np.asarray(skins.reach, np.float64)
    more = grown + abs(amount)  # how much farther out than leaves they reach
    deepest = float(np.max(ways.scale * (1 + more.clip(0.0)), initial=0.0))
    matters = felt(groups, widths)
    there = groups.path >= 0
    # rows (1 + D, N) that may show something where it was empty: at all, and in their groups
    shows = np.isin(groups.tokens, (UNION, SMOOTH))
    inner = [np.isin(groups.joins[path], (UNION, SMOOTH)) | (path < 0) for path in groups.path.T[::-1]]
    seen = np.logical_and.accumulate([shows, *inner])[::-1]
    # rows that a subtract joins, or a group around them: these say how deep points inside others lie
    cuts = there & (groups.joins[groups.path] == SUBTRACT)
    taken = (groups.tokens == SUBTRACT) | cuts.any(1)
    # blends reach as far as their width, and each lowers the distance by a quarter of that at most
    blends = reach + matters.widest * (1 + matters.blends / 4)
    blends = blends + deepest * (matters.everywhere & taken)
    radius = 1 + SLACK + more + LOOSE * abs(grown) + blends / ways.scale
    linear = ways.outer[:, :, :3].astype(np.float32).astype(np.float64)
    shift = ways.outer[:, :, 3].astype(np.float32).astype(np.float64)
    back = inverses(linear)
    centre, ball = -(back @ shift[..., None])[..., 0], ways.ball(radius)
    spread = np.linalg.norm(back, 2, axis=(1, 2))
    clips, wide = groups.tokens == INTERSECT, np.zeros(count, bool)
    if groups.deepest:
        ball, clips, wide = _widened(linear, centre, spread * ball, ball, groups, seen)
        radius = np.where(wide, (ball - ways.moved) / ways.reach, radius)
    rows = np.zeros(count, OBJECT)
    rows["map"] = _map(ways.outer)
    for name, values in (
        *(("scale", ways.scale), ("reach", ways.reach), ("moved", ways.moved), ("radius", radius)),
        *(("ball", ball), ("rate", ways.rate(radius)), ("centre", centre), ("extent", spread * ball)),
        *(("amount", amount), ("frequency", frequency), ("ends", groups.ends), ("depth", there.sum(1))),
    ):
        rows[name] = values
    rows["path"] = -1
    rows["path"][:, : groups.deepest] = groups.path
    rows["texture"] = -1
    skinned = np.zeros(count, bool)
    if skins is not None:
        for name, part in skins._asdict().items():
            rows[name] = part
        skinned = np.any(skins[:3], axis=0)
    # a group that neither draws nor takes away may leave what begins where it meets more
    adds = there.any(1) & ((cuts.sum(1) + (groups.tokens == SUBTRACT)) % 2 == 0)
    for flag, mask in (
        *((DRAWS, seen[0]), (CLIPS, clips), (BEGINS, groups.first), (SKINNED, skinned)),
        *((BUMPY, amount != 0), (STOPS, seen[0] | adds), (WIDER, wide)),
    ):
        rows["flags"] |= flag * mask.astype(np.int32)
    steps, rows["steps"] = ways.steps()
    rows["step"] = rows["steps"].cumsum() - rows["steps"]
    if not (finite(rows) and finite(steps)):
        raise ProgramError("a frame beyond float32")
    return Objects(rows, steps, wide)


def _widened(
    linear: Floats, centres: Floats, extents: Floats, balls: Floats, groups: Groups, seen: Mask
) -> tuple[Floats, Mask, Mask]:
    """Radii of balls (N,) behind maps where those that intersect are met wherever they have to be, which rows
    clip what stands before them, and which are met farther out than they change something.

    A group that is intersected with what stands before it has to be there, whatever cuts it: what intersects
    in it is met wherever the group may be. Elsewhere what came before ends with its ball.
    """
    number = len(groups.joins)
    middle, reach = np.zeros((number, 3)), np.zeros(number)  # balls of what may be in the groups
    for path, shown in zip(groups.path.T, seen[1:], strict=True):
        rows = np.flatnonzero((path >= 0) & shown)
        low, high = np.full((number, 3), np.inf), np.full((number, 3), -np.inf)
        np.minimum.at(low, path[rows], centres[rows] - extents[rows, None])
        np.maximum.at(high, path[rows], centres[rows] + extents[rows, None])
        here = np.unique(path[rows])
        middle[here] = (low[here] + high[here]) / 2
        far = np.linalg.norm(centres[rows] - middle[path[rows]], axis=1) + extents[rows]
        np.maximum.at(reach, path[rows], far)
    depth = (groups.path >= 0).sum(1)

    def open_at(level: Index) -> Index:
        """The groups (N,) that are open at levels, -1 for none."""
        row = np.arange(len(level))
        return np.where(level >= 0, groups.path[row, level.clip(0)], -1)

    def cut(group: Index) -> Mask:
        return np.asarray((group >= 0) & (groups.joins[group] == INTERSECT))

    clips = groups.tokens == INTERSECT
    begun = np.where(groups.first, open_at(depth - 1), -1)
    around = open_at(depth - 1 - groups.first)  # the group that a row, or the group that it begins, stands in
    wide = clips | cut(begun)
    held = np.where(cut(around), around, begun)  # what its ball has to hold
    clips = np.where(wide, ~cut(around), clips)
    wide &= held >= 0
    some = np.flatnonzero(wide)
    far = np.linalg.norm(centres[some] - middle[held[some]], axis=1) + reach[held[some]]
    result = balls.copy()
    result[some] = np.maximum(balls[some], np.linalg.norm(linear[some], 2, axis=(1, 2)) * far)
    return result, clips, wide


class Looks(NamedTuple):
    """What N objects' materials are: a register (R, N) float32, whose last row is 1 for a medium.

    Args:
        register: colours (3, N); where some have textures, plain ones (3, N) to find outlines by; glow (3, N)
            where something glows; densities where they differ; roughness where something reflects; kinds.
        hues: rows of colours, and of plain ones.
        switched: the last rows, which come with the kind of material.
        density: (N,) extinction.
        sigma: that of all media, None where they differ.
    """

    register: npt.NDArray[np.float32]
    hues: int
    switched: int
    density: npt.NDArray[np.float32]
    sigma: float | None
    glowing: bool
    rough: bool


def read_looks(network: SolidNetwork, parts: Parts, worn: Mask, draws: Mask) -> Looks:
    """The looks of vectors' parts, of rows (N,) that wear textures and that draw."""
    xp, count = network.xp, len(worn)
    look = np.asarray(xp.to_numpy(network.look(xp.array(parts.material.copy(), network.codes)))).T
    colour = (parts.rgb.T * look[:3]).astype(np.float32).clip(0.0, 1.0)
    rows = [colour]
    if worn.any():
        tags = (0.4 + 0.6 * (TAGS * (np.arange(count) + 1) % 1.0)).astype(np.float32)
        rows.append(np.where(worn, tags, colour))
    hues = 3 * len(rows)
    glow, roughness = (np.asarray(part, np.float32).T for part in (parts.glow, parts.roughness))
    density = np.where(parts.density > 0, parts.density, EXTINCTION).astype(np.float32)
    there = np.unique(density[(look[3] > 0.5) & draws])
    # the extinction of media, None where they differ; and that of each object (N,)
    sigma = None if len(there) > 1 else float(there[0]) if len(there) else EXTINCTION
    glowing, rough = bool(glow.any()), bool(roughness.any())
    switched = [density] * (sigma is None) + [roughness] * rough + [look[3].astype(np.float32)]
    rows += [glow] * glowing + [np.stack(switched)]
    return Looks(np.concatenate(rows), hues, len(switched), density, sigma, glowing, rough)


def stage_rows(
    stage: Stage,
    canvas: tuple[int, int],
    pace: MarchSettings,
    samples: int = 0,
    every: bool = False,
    glow: int = 0,
    shadows: Sequence[Tables] = (),
) -> tuple[Rows, tuple[Rows, Sequence[Tables]]]:
    """The `STAGE` row of a picture under direct light, and the `LAMP` rows and tables that it points to.

    Pixels that differ from their neighbours, or ``every`` one, have so many samples. ``glow`` is the first
    row of `Looks` that tells it, and ``shadows`` are the tables of what is opaque and of what is not, for
    lamps of a radius.
    """
    assert len(shadows) == 2 or not any(light.radius for light in stage.lights)
    lamps = np.zeros(len(stage.lights), LAMP)
    for row, light in zip(lamps, stage.lights, strict=True):
        row["at"], row["power"], row["radius"] = (
            light.position,
            light.power * np.array(light.rgb),
            light.radius,
        )
    result, ground, camera = np.zeros((), STAGE), stage.ground, stage.camera
    forward, right, up = np.array(camera.axes())
    half = np.tan(camera.fov_rad / 2)
    result["forward"], result["right"], result["up"] = forward / half, right, up
    result["deep"], result["px"] = forward * half, 2 / min(canvas)
    result["eye"], result["horizon"], result["zenith"] = camera.eye, stage.horizon, stage.zenith
    if ground is not None:
        result["grounded"], result["ground"], result["floor"] = 1, ground.rgb, ground.y
        result["fade"] = ground.fade**2
    result["gap"], result["ambient"] = pace.gap, AMBIENT
    result["contrast"], result["nodes"], result["glow"] = pace.contrast, pace.nodes, glow
    result["nearest"], result["lift"], result["transparent"] = NEAREST, LIFT, stage.transparent
    (result["width"], result["height"]), result["exposure"] = canvas, camera.exposure
    result["count"], result["every"] = samples, every
    result["lamps"], result["lamp"] = len(lamps), lamps.ctypes.data
    for name, tables in zip(("opaque", "hazy"), shadows, strict=False):
        result[name] = tables.scene.ctypes.data
    return result, (lamps, shadows)


class Held:
    """Arrays that tables point to."""

    def __init__(self) -> None:
        self._kept: list[Any] = []

    def held(self, array: npt.NDArray[Any]) -> int:
        """The address of an array that is kept; raises `ProgramError` where a number of it is none."""
        if not finite(array):
            raise ProgramError("numbers that the network cannot draw with")
        self._kept.append(np.ascontiguousarray(array))
        return int(self._kept[-1].ctypes.data)


def texture_row(tables: Held, row: Rows, paint: Paint, texture: Any, xp: Any) -> None:
    """Fill a row of a paint's texture, whose arrays tables keep."""
    rows = np.array(texture.place.rows)
    row["place"] = (rows if rows.shape[1] == 4 else np.insert(rows, 2, 0.0, 1)).reshape(-1)
    if isinstance(paint.element, Gradient):
        stops = paint.element.stops
        row["kind"] = RADIAL if paint.element.name == "radial" else LINEAR
        row["stops"], row["data"] = len(stops), tables.held(np.array(stops, np.float32))
    else:
        row["kind"] = PICTURE if texture.lattice is None else SPACE
        row["high"], row["wide"] = texture.sides
        row["data"] = tables.held(np.asarray(xp.to_numpy(texture.texels)))
    steps = np.zeros((len(paint.steps), 4), np.float32)
    for step, (name, *numbers) in zip(steps, paint.steps, strict=True):
        step[: 1 + len(numbers)] = list(COLOUR_STEPS).index(name), *numbers
    row["steps"], row["step"] = len(steps), tables.held(steps)


class Tables(Held):
    """What the kernel takes of a scene; keeps the arrays that the `SCENE` row points to.

    Of rows of vectors (N, 64) and tokens (N,), ``brought`` and ``paints`` are elements and textures, None
    where a row has the geometry or the colour of its vector. Raises `ProgramError` where a vector holds no
    way to a leaf or a number is none, or an element is damaged. Distances hold up to ``reach`` around
    objects, at least.
    """

    def __init__(
        self,
        network: SolidNetwork,
        vectors: npt.NDArray[np.float32],
        tokens: npt.NDArray[np.int8],
        brought: Sequence[Element | None] | None = None,
        paints: Sequence[Paint | None] | None = None,
        reach: float = 0.0,
    ) -> None:
        count, none = len(vectors), [None] * len(vectors)
        parts, groups = network.layout.unpack(vectors), read_groups(tokens)
        widths = widths_of(np.asarray(tokens, np.intp) & OPERATOR, parts.width)
        self.network, self.groups = network, groups
        self.objects = read_objects(vectors, network.layout, groups, widths, reach)
        rows = self.objects.rows
        super().__init__()
        self.edged = False  # whether a decoder shows edges, which rays may clip
        with network.xp.inference():
            draws = self.objects.flagged(DRAWS)
            textures = self._textures(paints or none, parts.texture, draws)
            self.looks = read_looks(network, parts, rows["texture"] >= 0, draws)
            self.decoders = self._decoders(parts.code, brought or none)
            cells = _cells(network, groups, widths)
        register = self.looks.register
        rows["look"][:, : len(register)] = register.T
        rows["flags"] |= MEDIUM * (register[-1] > 0.5)
        clipping = bool(self.objects.flagged(CLIPS).any())
        kinds = register[-1] > 0.5
        sizes = count, len(groups.joins), groups.deepest, len(register), self.looks.switched, clipping
        hues, sigma = self.looks.hues, self.looks.sigma
        coloured = bool(kinds.any()) and np.ptp(register[hues - 3 : hues, kinds], 1).max() > 0
        mixed = bool(kinds.any()), bool(kinds.any() and not kinds.all()), hues, sigma is None, coloured
        tables = map(self.held, (rows, self.objects.steps, self.decoders, cells, textures))
        self.scene = np.array((*sizes, *mixed, sigma or 0.0, reach, *tables), SCENE)

    def _textures(self, paints: Sequence[Paint | None], frames: npt.NDArray[np.float32], draws: Mask) -> Rows:
        """Rows of textures of objects that draw; the others leave colours as they are."""
        network = self.network
        worn = [i for i, paint in enumerate(paints) if paint is not None and draws[i]]
        result = np.zeros(len(worn), TEXTURE)
        self.objects.rows["texture"][worn] = np.arange(len(worn))
        for row, i in zip(result, worn, strict=True):
            paint = paints[i]
            assert paint is not None
            texture: Any = texture_of(network.xp, paint, frames[i], network.codes, light=True)
            self.objects.rows["detail"][i] = texture.detail / self.objects.rows["scale"][i]
            texture_row(self, row, paint, texture, network.xp)
        return result

    def _decoders(self, codes: npt.NDArray[np.float32], brought: Sequence[Element | None]) -> Rows:
        """Rows of decoders, which objects' rows have their indices in, and boxes where they are small."""
        network, objects, xp = self.network, self.objects, self.network.xp
        rows, skinned, sides = objects.rows, objects.flagged(SKINNED), []
        grown = {brought[i] for i in np.flatnonzero(skinned).tolist()}
        keys = [code.tobytes() if own is None else own for code, own in zip(codes, brought, strict=True)]
        number = {key: at for at, key in enumerate(dict.fromkeys(keys))}
        result = np.zeros(len(number), DECODER)
        for row, key in zip(result, number, strict=True):
            if isinstance(key, Element):
                shape = grid_shape(key, xp, network.codes, key in grown)
                row["kind"], row["width"] = GROWN if key in grown else GRID, shape.side
                row["data"] = self.held(np.asarray(xp.to_numpy(shape.nodes)))
                sides.append(element_box(key))
                continue
            decoder: Any = network.decoder(xp.array(np.frombuffer(key, np.float32).copy(), network.codes))
            sides.append(network.box(decoder))
            self.edged |= network.edged(decoder)
            if isinstance(decoder, Formula):
                row["kind"], row["width"] = FORMULA, FORMULAS.index(decoder)
            elif isinstance(decoder, Norms):
                _norms(row, decoder, xp)
            else:
                row["kind"], row["width"] = SILU, len(decoder[0][1])
                row["data"] = self.held(_layers(decoder, xp))
        rows["decoder"] = [number[key] for key in keys]
        box = np.array(sides).reshape(-1, 2, 3)[rows["decoder"]]
        # a small box, where an affine map leads to the leaf
        small = ((box[:, 1] - box[:, 0]).min(1) <= SMALL) & (rows["steps"] == 0) & ~objects.wide
        more = (rows["radius"] - 1).clip(0.0)[:, None]
        rows["low"], rows["high"] = box[:, 0] - more, box[:, 1] + more
        rows["flags"] |= BOXED * small.astype(np.int32)
        return result


def _norms(row: Rows, decoder: Norms, xp: Any) -> None:
    """Fill a row of norm units; raises `ProgramError` for more than a row holds."""
    w, b = (np.asarray(xp.to_numpy(part)) for part in (decoder.w, decoder.b))
    if len(b) > LINES or len(decoder.units) > UNITS:
        raise ProgramError(f"a decoder of {len(b)} lines, at most {LINES}")
    row["kind"], row["units"], row["inner"] = NORMS, len(decoder.units), decoder.inner
    row["size"][: len(decoder.units)], row["features"] = decoder.units, len(decoder.features)
    row["feature"][: len(decoder.features)] = decoder.features
    row["radius"] = np.asarray(xp.to_numpy(decoder.radius))
    row["line"][: len(b), : w.shape[1]], row["line"][: len(b), 7] = w, b


def _layers(decoder: Smooth, xp: Any) -> npt.NDArray[np.float32]:
    """The weights of three layers in a row, each (out, in) and then its biases."""
    sizes = [tuple(w.shape) for w, _ in decoder]
    width = sizes[0][0]
    if sizes != [(width, 3), (width, width), (1, width)] or width > WIDEST:
        raise ProgramError(f"a decoder of {sizes}, which the kernel does not know")
    parts = [np.asarray(xp.to_numpy(part)).reshape(-1) for layer in decoder for part in layer]
    return np.concatenate(parts).astype(np.float32)


def cell_keys(groups: Groups, widths: Floats) -> Floats:
    """Tokens and widths of blends (N + G, 2) by which objects and, behind these, groups join; ``widths`` (N,)
    are those of rows.
    """
    operators = np.concatenate([groups.tokens, groups.joins])
    return np.stack(
        [operators, np.concatenate([np.where(groups.first, 0.0, widths), widths[groups.rows]])], 1
    )


def cell_of(network: SolidNetwork, token: int, width: float) -> tuple[SolidCell, ...]:
    """The cell of a token, whose edges are rounded where a cut has a width."""
    rounded = token >= SUBTRACT and width
    return network.cut(token, width) if rounded else network.cell(token, width or BLEND)


def _cells(network: SolidNetwork, groups: Groups, widths: Floats) -> Rows:
    """Cells of the objects and, behind these, of the groups; ``widths`` are those of rows' blends."""
    known, which = np.unique(cell_keys(groups, widths), axis=0, return_inverse=True)
    if (network.config.paint_lines, network.config.kind_lines) != (2, 2):
        raise ProgramError("a cell of other lines than the kernel knows")
    result = np.zeros(len(known), CELL)
    for row, (token, width) in zip(result, known.tolist(), strict=True):
        row["smooth"] = token == SMOOTH
        for name, part in cell_of(network, int(token), width)[Wanted.ALL]._asdict().items():
            values = np.asarray(network.xp.to_numpy(part)).reshape(-1)
            row[name] = values if len(values) > 1 else values[0]
    return result[which.reshape(-1)]
