"""Objects that rays may meet: their frames, and the balls in which each lies; none of it is learned.

A ray has a slot for each ball that it passes, so that its cost depends on those balls alone, however many
objects the scene has. An object that cuts away everything outside of it is met wherever something may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from scenelang.compiler.groups import INTERSECT, SMOOTH, SUBTRACT, UNION, Floats, Groups, Mask, felt
from scenelang.compiler.lifting import SOLID_LAYOUT, Layout
from scenelang.compiler.program import ProgramError
from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.neural.frames import MOST, read_skins
from scenelang.drawing.solid.network import BLEND, SolidNetwork


class Turn(NamedTuple):
    """A turn of coordinates (i, j) by an angle ``twirl |p| + rate p[along]``, in the sense of R."""

    i: int
    j: int
    twirl: float
    rate: float
    along: int

    def _carried(self, xp: Arrays, p: Array) -> tuple[Array, Array, Array, Array | None]:
        angle, length = self.rate * p[self.along], None
        if self.twirl:
            length = xp.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
            angle = angle + self.twirl * length
        cos, sin = xp.cos(angle), xp.sin(angle)
        a, b = p[self.i], p[self.j]
        rows = [p[0], p[1], p[2]]
        rows[self.i], rows[self.j] = cos * a + sin * b, cos * b - sin * a
        return xp.stack(rows, 0), cos, sin, length

    def __call__(self, xp: Arrays, p: Array) -> Array:
        return self._carried(xp, p)[0]

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """The gradient (3, M) before the turn of what has the gradient g behind it; p lies before it."""
        q, cos, sin, length = self._carried(xp, p)
        a, b = g[self.i], g[self.j]
        swing = a * q[self.j] - b * q[self.i]  # how it changes with the angle
        rows = [g[0], g[1], g[2]]
        rows[self.i], rows[self.j] = cos * a - sin * b, sin * a + cos * b
        rows[self.along] = rows[self.along] + self.rate * swing
        result = xp.stack(rows, 0)
        return result if length is None else result + (self.twirl * swing / length.clip(1e-12)) * p

    def stretch(self, radius: float) -> float:
        """Greatest factor by which it lengthens a small step, in the ball of a radius about the origin.

        The turn's derivative is a rotation times ``1 + u v^T``, u the point turned by a right angle in the
        plane of the turn and v the angle's gradient: with m = |u| |v| and c = u . v the larger singular
        value is ``(m + sqrt(m² + 4 + 4 c)) / 2``.
        """
        m = radius * (abs(self.twirl) + abs(self.rate))
        c = radius * abs(self.rate) if self.along in (self.i, self.j) else 0.0
        return float(m + np.sqrt(m * m + 4 + 4 * c)) / 2


class Map(NamedTuple):
    """An affine map: p to linear p + shift."""

    linear: Array  # (3, 3)
    shift: Array  # (3,)

    def __call__(self, xp: Arrays, p: Array) -> Array:
        return xp.dense(p, self.linear, self.shift)

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """As `Turn.pulled`."""
        return self.linear.T @ g

    def placed(self, xp: Arrays, like: Array) -> Map:
        """The same where an array lies."""
        return Map(xp.array(self.linear, like), xp.array(self.shift, like))


@dataclass(frozen=True, slots=True)
class SolidFrame:
    """An object's way back to its leaf, outermost first."""

    outer: Map  # into the space in which the object lies in a ball about the origin
    steps: tuple[Turn | Map, ...]  # what follows it
    scale: float  # world distance per leaf distance, the smallest singular value of the composed map
    reach: float  # the ball that holds a leaf ball of radius r has the radius reach r + moved
    moved: float
    amount: float  # of the displacement
    frequency: float
    blend: float  # width of the blend by which the object joins

    def ball(self, radius: float) -> float:
        """Radius of the ball behind `outer` outside which leaf coordinates are longer than ``radius``."""
        return self.reach * radius + self.moved

    def growth(self, radius: float) -> float:
        """Leaf units by which the distance changes at most, in a leaf ball, per step of 1 behind `outer`."""
        growth, ball = 1.0 + abs(self.amount * self.frequency), self.ball(radius)
        for step in self.steps:
            if isinstance(step, Map):
                growth *= float(np.linalg.norm(step.linear, 2))
                ball = radius
            else:
                growth *= step.stretch(ball)
        return growth

    def local(self, xp: Arrays, p: Array) -> Array:
        """Leaf coordinates of points behind `outer`, both (3, M)."""
        for step in self.steps:
            p = step(xp, p)
        return p

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """Gradient (3, M) at points behind `outer` of what has the gradient g in leaf coordinates."""
        passed = []
        for step in self.steps:
            passed.append((step, p))
            p = step(xp, p)
        for step, at in reversed(passed):
            g = step.pulled(xp, at, g)
        return g

    def placed(self, xp: Arrays, like: Array) -> SolidFrame:
        """The same where an array lies."""
        steps = tuple(step if isinstance(step, Turn) else step.placed(xp, like) for step in self.steps)
        return replace(self, outer=self.outer.placed(xp, like), steps=steps)


def read_solid_frame(g: np.ndarray, layout: Layout = SOLID_LAYOUT) -> SolidFrame:
    """The frame of one vector (64,); raises `ProgramError` where it leads to no leaf."""
    g = g.astype(np.float64)
    if not np.abs(g[: layout.geometry]).max() < MOST:
        raise ProgramError("a frame beyond float32")
    parts = layout.unpack(g)
    last, middle = (
        Map(rows[:, :3], rows[:, 3]) for rows in np.reshape([parts.frame, parts.middle], (2, 3, 4))
    )
    outer, inner = _turns(parts.outer), _turns(parts.inner)
    whole = Map(middle.linear @ last.linear, middle.linear @ last.shift + middle.shift)
    stretches = np.linalg.svd(whole.linear, compute_uv=False)
    if not (stretches[2] > 1 / MOST and stretches[0] < MOST):
        raise ProgramError("a frame beyond float32")
    (amount, frequency), blend = parts.bulge.tolist(), float(parts.width)
    reach, moved = 1.0, 0.0
    steps: tuple[Turn | Map, ...] = tuple(inner)
    if outer:
        back = inverse_of(middle.linear)
        reach, moved = float(np.linalg.norm(back, 2)), float(np.linalg.norm(back @ middle.shift))
        steps = (*outer, _single(middle), *inner)
    return SolidFrame(
        outer=_single(last if outer else whole),
        steps=steps,
        scale=1 / float(stretches[0]),
        reach=reach,
        moved=moved,
        amount=amount,
        frequency=frequency,
        blend=blend if blend > 0 else BLEND,
    )


def inverse_of(linear: np.ndarray) -> np.ndarray:
    """The inverse of a linear map (3, 3); raises `ProgramError` where float32 has none."""
    try:
        result: np.ndarray = np.linalg.inv(linear)
    except np.linalg.LinAlgError:
        raise ProgramError("a damaged program: a frame without an inverse") from None
    if not np.abs(result).max() < MOST:
        raise ProgramError("a frame beyond float32")
    return result


def _single(wide: Map) -> Map:
    """A map in float32."""
    return Map(wide.linear.astype(np.float32), wide.shift.astype(np.float32))


def _turns(slots: np.ndarray) -> list[Turn]:
    """Turns of slots of three strengths: by t |p| + b x about z, then by w y about y."""
    turns = []
    for twirl, bend, twist in slots.reshape(-1, 3).tolist():
        if twirl or bend:
            turns.append(Turn(0, 1, twirl, bend, 0))
        if twist:
            turns.append(Turn(0, 2, 0.0, twist, 1))
    return turns


INF = float("inf")
SMALL = 1.7  # a side of a box that is worth the asking
SLACK = 0.002  # leaf units by which a learned surface may leave the unit ball
LOOSE = 0.03  # the same, per leaf unit, of one that grows
OBJECT, WAY, BEGIN, END, RATE, SLOT = 0, slice(1, 4), 4, 5, 6, 7  # what a slot of a ray has, and how many


@dataclass(frozen=True, slots=True)
class Solid:
    """One object: where rays may meet it."""

    frame: SolidFrame
    draws: bool  # something may be seen, where it is met, of what was empty before
    clips: bool  # outside its ball nothing is left of its group so far, or of what the group it begins joins
    begins: bool  # a group
    ends: int  # groups that end behind it
    radius: float  # leaf units from its origin beyond which it changes nothing
    ball: float  # radius of the ball around that behind the frame's outer map
    rate: float  # at which its world distance changes in it at most, per step of 1 behind the map
    centre: Array  # (3,) of a ball of the world around that
    extent: float  # radius of this
    wide: bool = False  # its ball holds more than what its leaf changes
    box: tuple[Array, Array] | None = (
        None  # behind the map, least and greatest coordinates (3, 1) that it changes
    )


def read_solids(
    network: SolidNetwork, vectors: np.ndarray, groups: Groups, widths: Floats, reach: float = 0.0
) -> list[Solid]:
    """The objects of a stream, whose groups and widths of blends are as of `felt`, with distances up to
    ``reach`` around them; raises `ProgramError`.
    """
    xp, layout, like = network.xp, network.layout, network.codes
    solids: list[Solid] = []
    frames = [read_solid_frame(vector, layout) for vector in vectors]
    skins = read_skins(layout.unpack(vectors))
    grown = np.zeros(len(frames)) if skins is None else np.asarray(skins.reach, np.float64)
    more = grown + [abs(frame.amount) for frame in frames]  # how much farther out than leaves they reach
    deepest = float(np.max([frame.scale for frame in frames] * (1 + more.clip(0.0)), initial=0.0))
    matters = felt(groups, widths)
    # rows (1 + D, N) that may show something where it was empty: at all, and in their groups
    shows = np.isin(groups.tokens, (UNION, SMOOTH))
    inner = [np.isin(groups.joins[path], (UNION, SMOOTH)) | (path < 0) for path in groups.path.T[::-1]]
    seen = np.logical_and.accumulate([shows, *inner])[::-1]
    # rows that a subtract joins, or a group around them: these say how deep points inside others lie
    taken = (groups.tokens == SUBTRACT) | ((groups.path >= 0) & (groups.joins[groups.path] == SUBTRACT)).any(
        1
    )
    deep = matters.everywhere & taken
    for i, frame in enumerate(frames):
        # a blend reaches as far as its width, and each lowers the distance by a quarter of that at most
        blends = reach + float(matters.widest[i]) * (1 + int(matters.blends[i]) / 4)
        if deep[i]:
            blends += deepest
        radius = 1 + SLACK + float(more[i] + LOOSE * abs(grown[i])) + blends / frame.scale
        back = inverse_of(frame.outer.linear.astype(np.float64))
        centre, ball = (-back @ frame.outer.shift).astype(np.float32), frame.ball(radius)
        solids.append(
            Solid(
                frame=frame.placed(xp, like),
                draws=bool(seen[0, i]),
                clips=bool(groups.tokens[i] == INTERSECT),
                begins=bool(groups.first[i]),
                ends=int(groups.ends[i]),
                radius=radius,
                ball=ball,
                rate=frame.scale * frame.growth(radius),
                centre=xp.array(centre, like),
                extent=float(np.linalg.norm(back, 2)) * ball,
            )
        )
    return _widened(xp, solids, frames, groups, seen) if groups.deepest else solids


def _widened(
    xp: Arrays, solids: list[Solid], frames: Sequence[SolidFrame], groups: Groups, seen: Mask
) -> list[Solid]:
    """The same frames, as numpy's arrays, of which those that intersect are met wherever they have to be.

    A group that is intersected with what stands before it has to be there, whatever cuts it: what intersects
    in it is met wherever the group may be. Elsewhere what came before ends with its ball.
    """
    centres = np.array([np.asarray(xp.to_numpy(solid.centre), np.float64) for solid in solids])
    extents = np.array([solid.extent for solid in solids])[:, None]
    number = len(groups.joins)
    middle, reach = np.zeros((number, 3)), np.zeros(number)  # balls of what may be in the groups
    for path, shown in zip(groups.path.T, seen[1:], strict=True):
        rows = np.flatnonzero((path >= 0) & shown)
        low, high = np.full((number, 3), INF), np.full((number, 3), -INF)
        np.minimum.at(low, path[rows], centres[rows] - extents[rows])
        np.maximum.at(high, path[rows], centres[rows] + extents[rows])
        here = np.unique(path[rows])
        middle[here] = (low[here] + high[here]) / 2
        far = np.linalg.norm(centres[rows] - middle[path[rows]], axis=1) + extents[rows, 0]
        np.maximum.at(reach, path[rows], far)
    depth = (groups.path >= 0).sum(1)
    for i, solid in enumerate(solids):
        own = groups.path[i, : depth[i]].tolist()
        held = own.pop() if solid.begins else -1  # what its ball has to hold, and where that stands
        if not (solid.clips or (held >= 0 and groups.joins[held] == INTERSECT)):
            continue
        clips = not own or bool(groups.joins[own[-1]] != INTERSECT)
        if not clips:
            held = own[-1]
        if held < 0:
            continue
        linear, frame = frames[i].outer.linear.astype(np.float64), frames[i]
        far = float(np.linalg.norm(centres[i] - middle[held]) + reach[held])
        ball = max(solid.ball, float(np.linalg.norm(linear, 2)) * far)
        radius = (ball - frame.moved) / frame.reach
        solids[i] = replace(
            solid,
            clips=clips,
            radius=radius,
            ball=ball,
            rate=frame.scale * frame.growth(radius),
            extent=float(np.linalg.norm(np.linalg.inv(linear), 2)) * ball,
            wide=True,
        )
    return solids


class Passes(NamedTuple):
    """The balls that M rays pass, K at most."""

    # (SLOT, K, M), a ray's last object first: its number, or -1 minus it where it does not draw; the ray's
    # direction behind its map; begin and end, inf and -inf where there is none; the distance's greatest rate
    slots: Array
    origins: Array  # (3, N), the point behind the map of each object, or (3, M) in the world
    many: bool = False  # whether each ray has a point of its own

    def at(self, xp: Arrays, index: Array) -> Passes:
        """Passes of some of the rays."""
        origins = xp.take(self.origins, index) if self.many else self.origins
        return Passes(xp.take(self.slots, index), origins, self.many)


def find_passes(
    xp: Arrays,
    solids: Sequence[Solid],
    origin: Array,
    origins: Array,
    way: Array,
    limit: Array,
    tight: bool = True,
    begin: Array | float = 0.0,
    spare: Array = None,
) -> tuple[Array, Passes]:
    """Indices (k,) of rays that may meet something that draws, and the balls that these pass, boxes too if
    ``tight``. Rays go from (3,), behind the objects' maps (3, N), or from a point each (3, M), along unit
    directions (3, M) from ``begin`` (M,) up to a limit. Balls of rays from (3,) may be smaller by ``spare``
    (2, M), its first row for each unit of the way and the second at its beginning.
    """
    low, high, result = 0 * way[0] + begin, limit, []
    filled, drawn = xp.whole(0 * low), low < 0
    around: list[tuple[Array, Array]] = []  # of the groups that a group stands in
    for i, solid in reversed(list(enumerate(solids))):
        around += [(low, high)] * solid.ends
        start = origins if origin.ndim == 2 else origins[:, i, None]
        rays, values = _crossed(xp, solid, origin, start, (way, low, high), tight, spare)
        if solid.begins:
            low, high = around.pop()
        if solid.clips:
            low, high = 0 * way[0] + INF, 0 * way[0] - INF
            xp.put(low, rays, values[BEGIN])
            xp.put(high, rays, values[END])
        values[OBJECT] = i if solid.draws else -1 - i
        slot = xp.take(filled, rays)
        xp.put(filled, rays, slot + 1)
        if solid.draws:
            xp.put(drawn, rays, slot >= 0)
        result.append((rays, slot, values))
    some = xp.where(drawn)
    count, most = len(some), int(filled.max()) if len(some) else 0
    slots = xp.full((SLOT, most, count), 0.0, way)
    slots[BEGIN], slots[END] = INF, -INF
    if count:
        rays, slot, values = (xp.concat(parts, -1) for parts in zip(*result, strict=True))
        place = xp.take(placed(xp, some, filled), rays)
        kept = xp.where(place >= 0)
        if len(kept) < len(place):
            place, slot, values = (xp.take(each, kept) for each in (place, slot, values))
        xp.put(slots.reshape(SLOT, -1), slot * count + place, values)
    many = origin.ndim == 2
    return some, Passes(slots, xp.take(origins, some) if many else origins, many)


def _crossed(
    xp: Arrays, solid: Solid, origin: Array, start: Array, ways: tuple[Array, ...], tight: bool, spare: Array
) -> tuple[Array, Array]:
    """Indices (k,) of rays that pass an object's ball between low and high, and their slots (SLOT, k)."""
    (way, low, high), near, less = ways, None, 0.0  # leaf units by which the ball is smaller
    if origin.ndim == 2:  # the ball is ahead, or around
        to = solid.centre[:, None] - origin
        ahead, room = (to * way).sum(0), solid.extent**2 * (1 + 1e-5) - (to * to).sum(0)
        near = xp.where((room >= 0) | ((ahead > 0) & (room + ahead * ahead >= 0)))
        start = solid.frame.outer(xp, xp.take(origin, near))
    else:
        to = solid.centre - origin
        far = float(xp.sqrt(to @ to))
        if far > solid.extent:  # rays within a cone around the ball, by its cosine less 1e-5 for rounding
            near = xp.where(to @ way >= far * (1 - (solid.extent / far) ** 2) ** 0.5 - 1e-5 * far)
            if spare is not None and not solid.wide:
                rate, least = xp.take(spare, near)
                less = (least + rate * (far - solid.extent)).clip(0.0) / solid.frame.scale
    if near is not None:
        way, low, high = xp.take(way, near), xp.take(low, near), xp.take(high, near)
    a = solid.frame.outer.linear @ way
    square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    middle = -((start * a).sum(0) if origin.ndim == 2 else start[:, 0] @ a) / square
    closest = start + middle * a  # to the ball's centre
    ball = solid.ball - solid.frame.reach * less
    left = ball**2 - closest[0] * closest[0] - closest[1] * closest[1] - closest[2] * closest[2]
    half = xp.sqrt((left / square).clip(0.0))
    begin, end = xp.maximum(middle - half, low), xp.minimum(middle + half, high)
    if tight and solid.box is not None:
        first, last = ((side - start) / a for side in (solid.box[0] + less, solid.box[1] - less))
        begin = xp.maximum(begin, xp.largest(xp.minimum(first, last))[0])
        end = xp.minimum(end, xp.least(xp.maximum(first, last)))
    hit = xp.where((left > 0) & (begin <= end))
    values = xp.concat([square[None], a, begin[None], end[None], solid.rate * xp.sqrt(square)[None]], 0)
    return hit if near is None else xp.take(near, hit), xp.take(values, hit)


def placed(xp: Arrays, index: Array, like: Array) -> Array:
    """Positions (M,) of entries in an index, -1 for those that are not in it; `like` are integers (M,)."""
    result = 0 * like - 1
    xp.put(result, index, xp.whole(0 * index + 1).cumsum(0) - 1)
    return result
