"""Bounds, proved pixel by pixel, of how far a picture of the plane may differ from the exact one.

A region of the picture has a distance to each object: the exact one at its centre, widened by the region's
radius in the leaf's own coordinates. Intervals pass through the exact fold, whose state is monotonic in both
distances. Where the result is one colour, all samples of the region have it.
Elsewhere objects that are certain to change nothing are dropped, and the region's quarters are asked, down to
single samples. All bounds are of the scene as written, so that they cover the compiler's passes too.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from math import hypot, inf, isqrt, sqrt
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import HARD, Gradient
from scenelang.compiler.chain import split_levels
from scenelang.compiler.emit import tokens_of
from scenelang.compiler.graph import Graph, Look
from scenelang.compiler.groups import (
    INTERSECT,
    SMOOTH,
    SUBTRACT,
    UNION,
    anchored,
    felt,
    read_groups,
    widths_of,
)
from scenelang.compiler.lifting import lift_many
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.spaces import ALIKE, PLANE
from scenelang.compiler.steps import IDENTITY, Affine, Rows, Skin, Step, Warp, compose
from scenelang.drawing.exact.field import along, carry_back, colour_at, leaf_distance, placed_leaves
from scenelang.drawing.how import RenderError, check_time
from scenelang.drawing.image import PROVED, Image, Proof, from_samples
from scenelang.drawing.neural.frames import Frames
from scenelang.drawing.neural.meetings import (
    Index,
    Interval,
    Mask,
    Meetings,
    NestedSlot,
    Nesting,
    Pairs,
    State,
    flat_nesting,
    meetings_of,
    nesting,
    raster,
)
from scenelang.language.words import TOKENS

TAME = 1e-9  # leaf units: an error that is allowed for in any case
EPS = 32 * 2.0**-52  # relative error of one step: a few dozen roundings of float64


class WrittenObject(NamedTuple):
    """An object as written: its look before it was folded, and its steps, nearest the leaf first."""

    look: Look
    steps: tuple[Step, ...]

    def misplaced(self, reach: float, far: float) -> float:
        """Leaf units by which points within a reach of the leaf, and ``far`` from the world's, may be off."""
        return TAME + _misplaced(self.steps, min(reach, _seen(self.steps, far)))

    def mispainted(self, reach: float, far: float) -> tuple[float, float]:
        """How far (u, v) of a texture may be off there, and a channel of its colours, hard edges apart."""
        if (element := self.look.element) is None:
            return 0.0, 0.0
        reach = min(reach, _seen(self.steps, far))
        lost = off = _misplaced((*self.look.texture, *self.steps), _seen(self.look.texture, reach))
        off *= element.slope if isinstance(element, Gradient) else max(element.sizes)
        for kind, *numbers in self.look.colours:
            if kind == "hue":
                off = 6 * (off + EPS * abs(numbers[0]))
            else:  # shares clamp nothing and tear no colours apart
                off *= 1 + 2 * max(0.0, max(numbers) - 1.0, -min(numbers))
        return lost, off


def _seen(steps: Sequence[Step], far: float) -> float:
    """Greatest length of leaf coordinates of points that are no longer than ``far`` in the world."""
    size = np.full(2, far)
    for step in reversed(steps):
        if isinstance(step, Affine):
            _, back, moved = _sizes(step)
            size = back @ (size + moved)
        elif isinstance(step, Warp):
            size[:] = np.hypot(*size)
    return float(np.hypot(*size))


def _misplaced(steps: Sequence[Step], far: float) -> float:
    """Rounding error of float64 in leaf coordinates of points that are no longer than ``far`` there. Points,
    `size`, their ways into the leaf and back, `ways` and `forth`, are by coordinates, without signs.
    """
    size, ways, forth, lost, run = np.full(2, far), np.eye(2), np.eye(2), np.full(2, EPS * far), IDENTITY
    for step in steps:
        if isinstance(step, Affine):
            own, back, moved = _sizes(step)
            size, ways, forth, run = own @ size + moved, ways @ back, own @ forth, compose(step.rows, run)
            lost += EPS * (ways @ (own @ (back @ (size + moved)) + size + moved))
        elif isinstance(step, Warp):
            size[:] = np.hypot(*size)
            ways = ways @ np.full((2, 2), 1.0 + size[0] * (abs(step.twirl) + hypot(*step.bend)))
            if (unlike := _unlike(run)) is None:
                run, unlike = IDENTITY, 0.0
            lost += (EPS + unlike) * (ways @ size)
    lost += EPS * (forth @ ways).max() * far  # of the composed map's inverse and its scale
    return float(lost.max()) if np.isfinite(lost).all() else inf


def _unlike(rows: Rows) -> float | None:
    """Error of a point where a warp moves past a map that counts as similar, None where none does."""
    a, b, _, x, c, d, _, y = rows[:8]
    turned, mirrored = max(abs(a - d), abs(b + c)), max(abs(a + d), abs(b - c))
    off = max(min(turned, mirrored), abs(x), abs(y)) / (sqrt(abs(a * d - b * c)) or 1.0)
    return 4 * off if off < 2 * ALIKE else None


def _sizes(step: Affine) -> tuple[Any, Any, Any]:
    """A map of the plane, its inverse (2, 2) and its shift (2,), without signs."""
    a, b, _, x, c, d, _, y = map(abs, step.rows[:8])
    det = abs(step.rows[0] * step.rows[5] - step.rows[1] * step.rows[4])
    return np.array([[a, b], [c, d]]), np.array([[d, b], [c, a]]) / det, np.array([x, y])


Floats = npt.NDArray[np.float64]
NOTHING = 1e200  # world units: the distance before the first object, beyond all blends


class Joins(NamedTuple):
    """Ways in which P operands join."""

    tokens: Index  # operators
    widths: Floats  # of their blends, 0 for sharp edges
    free: Mask  # no blend follows: what is outside, and how deep inside the rest, is all one

    def some(self, which: slice | Index) -> Joins:
        """Select some of them."""
        return Joins(self.tokens[which], self.widths[which], self.free[which])


def enclosed(
    meetings: Meetings,
    distance: Interval,
    colour: Interval,
    joins: Joins,
    behind: Floats,
    nest: Nesting | None = None,
    groups: Joins | None = None,
) -> tuple[Interval, Mask]:
    """Channels (K, B) that regions show, and which objects (P,) may change them.

    Distances (P,) and colours (3 or 4, P), as of `State`, of the pairs hold wherever in the region;
    ``behind`` (K,) is shown where nothing is. ``nest`` and ``groups`` are of streams with groups.
    """
    count, channels = len(meetings.columns), len(colour.low)
    nest = nest or flat_nesting(meetings)
    state = _Exact.empty(NOTHING, nest.states, np.float64, channels)
    operands = State(distance, colour)

    def join(turn: NestedSlot) -> tuple[Mask, Mask]:
        how = joins if turn.ending is None else groups
        assert how is not None
        operand = state.operands(turn, operands, NOTHING)
        return state.join(turn.at, operand, how.some(turn.which), turn.fresh)

    shut, _ = nest.fold(len(joins.tokens), join)
    (low, high), (first, last) = (tuple(side[..., :count] for side in pair) for pair in state)
    back = behind[:, None]
    if channels < len(behind):
        first, last = (np.vstack([c, np.ones(count)]) for c in (first, last))
    elif channels > len(behind):
        first, last = first[:3] + (1.0 - last[3]) * back, last[:3] + (1.0 - first[3]) * back
    shown = Interval(
        np.where(high < 0, first, np.where(low < 0, np.minimum(first, back), back)),
        np.where(high < 0, last, np.where(low < 0, np.maximum(last, back), back)),
    )
    return shown, ~shut


class _Exact(State):
    """States of the exact fold."""

    def join(self, columns: Index | slice, operand: State, how: Joins, fresh: Mask) -> tuple[Mask, Mask]:
        """Take in n operands, ``fresh`` ones as they are; which change nothing, which leave nothing else."""
        (d, e), (token, k, free) = operand.distance, how
        a, b = self.distance.low[columns].copy(), self.distance.high[columns].copy()
        union = token == UNION
        # the object's share of the colour; of a union all or none
        some = union & ((e < np.maximum(a, 0.0)) | (free & (a >= 0.0)))
        most = union & (some | ((d < np.maximum(b, 0.0)) & ~(free & (d >= 0.0))))
        shares = some.astype(float), most.astype(float)
        ends = np.minimum(a, d), np.minimum(b, e)
        closed, wide = d >= np.where(free, 0.0, np.maximum(b, 0.0)), e < np.where(free, 0.0, a)
        if (which := token == SMOOTH).any():
            blend = _blend(a, e, k)[0], _blend(b, d, k)[0]
            shares = _chosen(which, blend, shares)
            ends = _chosen(which, (_blend(a, d, k)[1], _blend(b, e, k)[1]), ends)
            closed, wide = _chosen(which, (blend[1] <= 0, blend[0] >= 1), (closed, wide))
        for operator, (near, far) in ((SUBTRACT, (-e, -d)), (INTERSECT, (d, e))):
            if (which := token == operator).any():
                rounds = which & (k > 0)
                ends = _chosen(which, (np.maximum(a, near), np.maximum(b, far)), ends)
                closed = np.where(which, (far <= a) | (free & (far < 0.0)), closed)
                if rounds.any():  # a smooth union turned inside out
                    blends = -_blend(-a, -near, k)[1], -_blend(-b, -far, k)[1]
                    ends = _chosen(rounds, blends, ends)
                    closed = np.where(rounds, far + k <= a, closed)
                wide &= ~which
        if fresh.any():
            ends, shares = _chosen(fresh, (d, e), ends), _chosen(fresh, (1.0, 1.0), shares)
            closed, wide = closed & ~fresh, wide | fresh
        self.distance.low[columns], self.distance.high[columns] = ends
        through = None
        if len(operand.colour.low) == 4:
            least, most = (1.0 - side[3] for side in reversed(operand.colour))
            over = union & ~fresh
            through = Interval(least * (over & (b < 0.0)), most * (over & (a < 0.0)))
            wide = wide & (through.high <= 0.0)
        self.paint(columns, operand.colour, Interval(*shares), through)
        return closed, wide


def _chosen(which: Mask, new: tuple[Any, Any], old: tuple[Any, Any]) -> tuple[Any, Any]:
    return np.where(which, new[0], old[0]), np.where(which, new[1], old[1])


def blended(meetings: Meetings, rounds: Mask) -> Mask:
    """After which pairs (P,) a blend follows in their region."""
    result, seen = np.empty(len(rounds), bool), np.zeros(len(meetings.columns), bool)
    for part in reversed(meetings.slots()):
        n = part.stop - part.start
        result[part] = seen[:n]
        seen[:n] |= rounds[part]
    return result


def _blend(big: Floats, d: Floats, k: Floats) -> tuple[Floats, Floats]:
    """The share of the object's colour, and the state behind a smooth union."""
    k = np.where(k > 0, k, 1.0)  # of others, which do not ask
    with np.errstate(over="ignore"):
        h = np.clip(0.5 + 0.5 * (big - d) / k, 0.0, 1.0)
    return h, big * (1 - h) + d * h - k * h * (1 - h)


class Stream:
    """The N objects of a scene as written, ``lowered``, and of its stream of leaves, ``graph``.

    ``frames`` are in float64; ``rounds`` (N,) says which objects join by a blend, or begin a group that does.
    ``reach`` (N,) is in leaf units from its origin, beyond which an object has no say: without it the fold is
    the same, or both folds are so far outside of everything that the blends to come, each of which brings
    them nearer by its width at most, leave them outside. ``rounding`` (N,) is in leaf units by which float64
    may misplace points within reach, or the fold's distance. ``unknown`` geometries lie in the unit disc;
    nothing else is known of them.
    """

    def __init__(self, lowered: Graph, graph: Graph, manifest: Manifest) -> None:
        rows = graph.rows()
        self._leaves = [row.leaf for row in rows]
        levels = [split_levels(leaf.steps, manifest.limits, PLANE) for leaf in self._leaves]
        self.frames = Frames(lift_many(levels, [(0.0,) * 4] * len(levels)))
        self.groups = groups = read_groups(tokens_of(rows))
        raw = np.array([TOKENS[row.op] for row in rows], np.intp)
        widths = widths_of(raw, np.array([row.k for row in rows]))
        seen = felt(groups, widths)
        skins = [Skin.of(leaf.steps) for leaf in self._leaves]
        beyond = 1.0 + seen.total / self.frames.scale + [skin.reach for skin in skins]
        reach = np.where(seen.everywhere | anchored(groups), np.inf, beyond)
        behind = [skin.grow * (skin.order & 1) for skin in skins]
        # of each object how far it grows before it is a shell, half of that, and how far it grows behind it
        self._skins = np.array([[skin.grow for skin in skins], [skin.shell / 2 for skin in skins], behind])
        self._skins[0] -= self._skins[2]
        objects, far = placed_leaves(lowered.root), np.hypot(*graph.canvas) / min(graph.canvas)
        written = {leaf.number: WrittenObject(leaf.look, steps) for leaf, steps, _ in objects}
        leaves = [written[leaf.number] for leaf in self._leaves]
        own = list(zip(leaves, reach.tolist(), strict=True))
        self.rounding = np.array([leaf.misplaced(within, far) for leaf, within in own])
        self.rounding += EPS * widths.sum() / self.frames.scale
        self.reach = reach + self.rounding
        free = ~seen.inside & (seen.blends == 0)
        self.rounds = widths > 0
        self.joins = Joins(groups.tokens, np.where(groups.first, 0.0, widths), free)
        first = groups.rows
        # what follows a group follows its first row, and the group's own blend does
        self.group_joins = Joins(groups.joins, widths[first], free[first])
        names = [leaf.geometry for leaf in self._leaves]
        self.unknown = set(names) & graph.elements.keys()
        self.unproved = tuple(sorted({leaf.called for leaf in self._leaves if leaf.geometry in self.unknown}))
        self._shapes = {name: np.array([own == name for own in names]) for name in dict.fromkeys(names)}
        self._plain = np.array([leaf.look.colour() for leaf in self._leaves]).reshape(-1, 3).T
        opacity = np.array([leaf.look.opacity for leaf in self._leaves])
        self._opacity = opacity if (opacity < 1.0).any() else None
        self._painted = np.array([leaf.look.element is not None for leaf in leaves], bool)
        self._off = [leaf.mispainted(within, far) for leaf, within in own]  # of textures, (u, v) and colours

    def crowd(self, canvas: tuple[int, int]) -> float:
        """Mean number of objects that reach a place on the canvas."""
        every, half = np.isinf(self.reach), np.array(canvas)[:, None] / min(canvas)
        low, high = self.frames.boxes(np.where(every, 0.0, self.reach))
        sides = np.where(every, 2 * half, np.fmin(high, half) - np.fmax(low, -half)).clip(0.0) / (2 * half)
        return float((sides[0] * sides[1]).sum())

    def distance(self, which: Index, q: Floats) -> Interval:
        """Distances (P,) of objects (P,) at leaf coordinates (2, P)."""
        low, high = np.full(len(which), -NOTHING), np.full(len(which), NOTHING)
        finite = np.isfinite(q).all(0)
        for name, own in self._shapes.items():
            some = np.flatnonzero(own[which] & finite)
            if not len(some):
                continue
            p = q[:, some]
            if name in self.unknown:
                length = np.hypot(*p)
                result = Interval(length - 1, length + 1)
            else:
                result = Interval(*[leaf_distance(name, p)] * 2)
            low[some], high[some] = result
        bare = Interval(low, high)
        return _worn(bare, *self._skins[:, which]) if self._skins.any() else bare

    def colour(self, which: Index, q: Floats, sampled: bool) -> Interval:
        """Colours (3 or 4, P), as of `State`, of objects at leaf coordinates, or of textures around them."""
        low, high = self._plain[:, which], self._plain[:, which]
        for at in np.unique(which[self._painted[which]]).tolist():
            some, look = which == at, self._leaves[at].look
            low[:, some], high[:, some] = 0.0, 1.0
            if sampled:
                p = carry_back(look.texture, q[:, some])
                seen, (torn, lost) = colour_at(look, p).T, self._off[at]
                off = lost * np.ones(len(p[0]))
                if isinstance(look.element, Gradient):
                    s, edges = along(look.element, p[0], p[1]), look.element.edges or (np.inf,)
                    off[np.any([abs(s - edge) <= torn + HARD for edge in edges], 0)] = 1.0
                low[:, some], high[:, some] = np.fmax(seen - off, 0.0), np.fmin(seen + off, 1.0)
        if self._opacity is None:
            return Interval(low, high)
        opacity = self._opacity[which]
        return Interval(*(np.vstack([side * opacity, opacity]) for side in (low, high)))


def _worn(d: Interval, first: Floats, wall: Floats, last: Floats) -> Interval:
    """Intervals of ``|d - first| - wall - last``, or of ``d - first - last`` where there is no wall."""
    low, high = d.low - first, d.high - first
    nearest = np.maximum(np.maximum(low, -high), 0.0)
    low, high = _chosen(wall > 0.0, (nearest, np.maximum(-low, high)), (low, high))
    return Interval(low - (wall + last), high - (wall + last))


SIDES = 16, 8, 4, 2, 1  # of regions, samples
FLAT = 5e-4  # of a channel: a region that is known so well is not cut


class Band:
    """Some rows of pixels, and what is ``shown`` there (rows, width, K), ``behind`` (K,) where nothing is;
    ``along`` the side of a pixel there are so many samples.
    """

    def __init__(
        self, stream: Stream, canvas: tuple[int, int], rows: range, behind: Floats, along: int = 2
    ) -> None:
        self._stream, self._behind, self._reach, self._along = stream, behind, stream.reach, along
        width, height = canvas
        finer = range(along * rows.start, along * rows.stop)
        self._grid = grid = raster((along * width, along * height), finer, largest=SIDES[0])
        self._every = np.empty((2, grid.high // along, grid.wide // along, len(behind)))
        self._every[:] = behind
        self.shown = Interval(*self._every[:, : len(rows), :width])
        pairs = grid.reached(stream.frames, self._reach)
        for side in [side for side in SIDES if side >= along]:
            columns, shown, pairs = self._looked(pairs, side)
            known = (shown.high - shown.low).max(0) <= FLAT
            x, y = grid.place(columns[known], side)
            for every, values in zip(self._every, shown, strict=True):
                pixels = side // along
                blocks = every.reshape(grid.high // side, pixels, -1, pixels, len(behind))
                blocks[y // side, :, x // side] = values.T[known, None, None]
            done = np.zeros(grid.wide * grid.high // side**2, bool)
            done[columns[known]] = True
            pairs = pairs.take(~done[pairs.block])
            if side > along:
                pairs = pairs.split(grid.wide // side, 2)
        self._sampled(pairs)

    def _looked(self, pairs: Pairs, side: int) -> tuple[Index, Interval, Pairs]:
        """Regions, what they show (K, B), and the pairs that have to be asked again."""
        stream, grid = self._stream, self._grid
        place, half = np.stack(grid.place(pairs.block, side)), (side - 1) / 2
        centre = np.array([[grid.left], [grid.top]]) + (place + half) * [[grid.px], [-grid.px]]
        world = np.full(len(pairs), half * 2**0.5 * grid.px)
        q, radius = stream.frames.blocks(pairs.object, centre, world)
        radius = radius + stream.rounding[pairs.object]
        some = np.flatnonzero(~(np.hypot(*q) - radius > self._reach[pairs.object]))
        pairs = pairs.take(some)
        meetings, source = meetings_of(pairs)
        thing, some = meetings.pairs.object, some[source]
        q, radius, scale = q[:, some], radius[some], stream.frames.scale[thing]
        exact, colour = stream.distance(thing, q), stream.colour(thing, q, side == 1)
        # what is not a number bounds nothing
        low = np.fmax((exact.low - radius) * scale, -NOTHING)
        world_distance = Interval(low, np.fmin((exact.high + radius) * scale, NOTHING))
        joins, nest = stream.joins.some(thing), None
        if stream.groups.deepest:
            nest = nesting(meetings, stream.groups)
        else:
            joins = joins._replace(free=~blended(meetings, stream.rounds[thing]))
        behind, changing = self._behind, np.empty(len(pairs), bool)
        shown, left = enclosed(meetings, world_distance, colour, joins, behind, nest, stream.group_joins)
        changing[source] = left
        return meetings.columns, shown, pairs.take(changing)

    def _sampled(self, pixels: Pairs) -> None:
        """Ask for the samples of pixels that they have to tell, and take their means."""
        along = self._along
        wide = self._grid.wide // along
        columns, shown, _ = self._looked(pixels.split(wide, along), 1)
        x, y = self._grid.place(columns, 1)
        for every, values in zip(self._every, shown, strict=True):
            flat = every.reshape(-1, len(self._behind))
            flat[pixels.block] = self._behind
            np.add.at(flat, y // along * wide + x // along, (values.T - self._behind) / along**2)


BAND = 1 << 17  # pixels at a time, at least a row of the largest regions
CROWD = 32  # objects in reach of a place, above which fewer pixels are asked at a time
ROUNDING = 2e-7  # of a channel: what is lost where pictures are kept in float32


def prove_image(
    lowered: Graph,
    graph: Graph,
    manifest: Manifest,
    image: Image,
    *,
    redraw: bool = False,
    until_s: float = inf,
) -> tuple[Image, Proof]:
    """Prove by how much each pixel of an image, whoever drew it, differs from the exact one at most: the
    picture and its proof, from the scene as written and its stream of leaves.

    If ``redraw``, pixels not proved right to `PROVED` are drawn again. Raises as `check_proved`
    and, at ``until_s``, `check_time`.
    """
    check_proved(manifest)
    stream = Stream(lowered, graph, manifest)
    (width, height), behind = graph.canvas, np.zeros(4)
    if graph.background is not None:
        behind = np.asarray(graph.background, np.float64)
    if image.shape != (height, width, len(behind)):
        raise RenderError(f"a picture of {image.shape}, where the scene has {(height, width, len(behind))}")
    picture = np.array(image, np.float64)
    if clear := graph.background is None:
        picture[..., :3] *= picture[..., 3:]
    bound, redrawn = np.empty((height, width), np.float32), 0
    rows = -(-max(1, int(BAND / width / (1 + stream.crowd(graph.canvas) / CROWD))) // SIDES[0]) * SIDES[0]
    for top in range(0, height, rows):
        check_time(until_s)
        part = range(top, min(top + rows, height))
        band = Band(stream, graph.canvas, part, behind, isqrt(graph.samples))
        drawn = picture[part.start : part.stop]
        result = _off(drawn, band.shown)
        if redraw and (bad := result > PROVED).any():
            middle = (band.shown.low + band.shown.high) / 2
            bad &= _off(middle, band.shown) <= PROVED  # what stays open stays as it was drawn
            drawn[bad] = middle[bad]
            result = _off(drawn, band.shown)
            redrawn += int(bad.sum())
        bound[part.start : part.stop] = result
    if redrawn:
        credit = image.credit
        image = from_samples(picture[..., :3], picture[..., 3] if clear else None)
        image.credit = credit
    return image, Proof(bound, redrawn, stream.unproved)


def _off(drawn: Floats, shown: Interval) -> Floats:
    """Greatest difference of pixels (H, W, K) from an enclosed picture, over their channels."""
    far = np.maximum(shown.high - drawn, drawn - shown.low)
    worst: Floats = reduce(np.maximum, np.moveaxis(far, -1, 0))  # faster than `far.max(-1)`
    return worst + ROUNDING


def check_proved(manifest: Manifest) -> None:
    """Raise `RenderError` for a model that is not of the plane, or that learned where points lie."""
    if manifest.dimension != 2:
        raise RenderError("pictures of solids are not proved, those of the plane are")
    if not manifest.framed:
        raise RenderError(f"pictures of `{manifest.name}` are not proved, as it learned where points lie too")
