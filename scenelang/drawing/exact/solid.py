"""The exact picture of solids in float64: leaves, field, rays, light, shadows and media, by docs/language.md.

A world point goes back through maps and turns. A turn is a warp or a twist: ``p -> R(a) p`` in the plane of x
and another axis, with ``a = twirl |p| + slope . p``.

A ray steps as far as the field says that nothing changes, and at least `STEP`; so it may miss things that are
thinner than that along the ray.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.records import Record
from scenelang.compiler.geometries import GEOMETRIES
from scenelang.compiler.graph import Fold, Leaf, Node
from scenelang.compiler.spaces import AMBIENT, EXTINCTION, LIFT, NEAREST, Light, Sky, Stage
from scenelang.compiler.steps import Affine, Displace, Own, Shell, Skin, Step, Twist, Warp
from scenelang.drawing.exact.field import (
    Array,
    Brought,
    carry_back,
    colour_at,
    distance_scale,
    folded,
    leaf_distance,
    placed_leaves,
    sample_points,
    worn,
)
from scenelang.drawing.image import Image, from_light
from scenelang.drawing.size import sized_root
from scenelang.language.words import TOKENS

Ints = npt.NDArray[np.int64]
Kinds = npt.NDArray[np.int32]
_REACH = 0.15
_TINY = 1e-300  # added to lengths that something is divided by


def length(p: Array) -> Array:
    """Lengths (M,) of vectors (3, M)."""
    x, y, z = p
    return np.sqrt(x * x + y * y + z * z)


class ExactMap(NamedTuple):
    """``p -> inverse p + shift``, (3, 3) and (3, 1), and the largest stretch of the inverse."""

    inverse: Array
    shift: Array
    grows: float

    def __call__(self, p: Array) -> Array:
        return self.inverse @ p + self.shift

    def stretch(self, most: Array | float) -> float:
        """As `ExactTurn.stretch`."""
        return self.grows

    def pull(self, p: Array, g: Array) -> Array:
        """As `ExactTurn.pull`."""
        return self.inverse.T @ g


class ExactTurn(NamedTuple):
    """See the module; ``other`` is the index of the other axis."""

    other: int
    twirl: float
    slope: tuple[float, float, float]

    def trig(self, p: Array) -> tuple[Array, Array]:
        """Cosine and sine of the angle at points."""
        a = self.twirl * length(p) if self.twirl else 0.0
        for factor, c in zip(self.slope, p, strict=True):
            if factor:
                a = a + factor * c
        return np.cos(a), np.sin(a)

    def __call__(self, p: Array) -> Array:
        cos, sin = self.trig(p)
        q = p.copy()
        q[0] = cos * p[0] + sin * p[self.other]
        q[self.other] = cos * p[self.other] - sin * p[0]
        return q

    def stretch(self, most: Array | float) -> Array:
        """The largest stretch over all points no longer than ``most``.

        With u = dR/da p, v = grad a and m = |u| |v| it is ``(m + sqrt(m² + 4 + 4 u.v)) / 2``, the larger
        singular value of 1 + u v^T.
        """
        m = most * (abs(self.twirl) + np.linalg.norm(self.slope))
        across = most * np.hypot(self.slope[0], self.slope[self.other])
        return (m + np.sqrt(m * m + 4.0 + 4.0 * across)) / 2.0

    def pull(self, p: Array, g: Array) -> Array:
        """A gradient after the turn as the one before it, at p."""
        cos, sin = self.trig(p)
        x, y = cos * p[0] + sin * p[self.other], cos * p[self.other] - sin * p[0]
        along = g[0] * y - g[self.other] * x  # the gradient times dR/da p
        out = g + along * np.reshape(self.slope, (3, 1))
        out[0] += (cos - 1.0) * g[0] - sin * g[self.other]
        out[self.other] += (cos - 1.0) * g[self.other] + sin * g[0]
        if self.twirl:
            out += along * self.twirl / (length(p) + _TINY) * p
        return out


def way_back(steps: Sequence[Step]) -> Any:
    """Maps and turns, the world's first, which is a map; neighbouring affine maps are one."""
    back: list[ExactMap | ExactTurn] = []
    pending = np.eye(4)

    def affine() -> ExactMap:
        inverse: Array = np.linalg.inv(pending[:3, :3])
        return ExactMap(inverse, -inverse @ pending[:3, 3:], float(np.linalg.norm(inverse, 2)))

    for step in reversed(steps):
        if isinstance(step, Affine):
            pending = pending @ np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)])
        elif not isinstance(step, Own):
            if not back or (pending != np.eye(4)).any():
                back.append(affine())
                pending = np.eye(4)
            slope = (0.0, step.twist, 0.0) if isinstance(step, Twist) else (*step.bend, 0.0)
            turn = ExactTurn(1, step.twirl, slope) if isinstance(step, Warp) else ExactTurn(2, 0.0, slope)
            back.append(turn)
    return back if back and (pending == np.eye(4)).all() else [*back, affine()]


class ExactBody:
    """A leaf of linear colours with all steps into the world, and the ball of distances below a margin."""

    def __init__(
        self, leaf: Leaf, steps: Sequence[Step], margin: float, brought: Brought | None = None
    ) -> None:
        self.geometry, self.brought = leaf.geometry, brought or {}
        self.look, self.rgb = leaf.look, np.reshape(leaf.look.colour(), (3, 1))
        self.sigma = (leaf.look.density or EXTINCTION) if leaf.look.material == "volumetric" else 0.0
        self.glow = np.reshape(leaf.look.glow, (3, 1))
        self.medium = 0  # number of its medium in a field
        self.own = [step for step in steps if isinstance(step, Own) and not step.idle]
        self.first, *self.back = way_back(steps)
        self.scale = distance_scale(steps, 3)
        self.rate, self.deep = self.scale, self.scale  # deep: no point is further inside
        radius = 1.0 + margin / self.scale
        skin = Skin.of(self.own)
        self.rate *= 1.0 + abs(skin.amount * skin.frequency)
        self.deep += self.scale * max(skin.reach, 0.0)
        radius += skin.reach
        # How far around a point the rate that `distance` tells holds: without turns anywhere.
        self.reach = _REACH * self.scale if self.back else np.inf
        centre = np.zeros((3, 1))
        for step in reversed(self.back):
            if isinstance(step, ExactMap):
                matrix = np.linalg.inv(step.inverse)
                centre, radius = matrix @ (centre - step.shift), radius * float(np.linalg.norm(matrix, 2))
            else:  # it keeps lengths
                centre, radius = np.zeros((3, 1)), radius + float(np.linalg.norm(centre))
        self.centre, self.radius = centre, radius

    def span(self, o: Array, d: Array) -> tuple[Array, Array, Array]:
        """Entry and exit t of rays o + t d through the ball, inf and -inf if none, and speed there."""
        o, d = self.first(o) - self.centre, self.first.inverse @ d
        a, b, c = (d * d).sum(0), (o * d).sum(0), (o * o).sum(0) - self.radius**2
        root = b * b - a * c
        hit = root > 0.0
        root = np.sqrt(np.where(hit, root, 0.0))
        return np.where(hit, (-b - root) / a, np.inf), np.where(hit, (root - b) / a, -np.inf), np.sqrt(a)

    def distance(self, p: Array) -> tuple[Array, Any]:
        """World distances, and how fast they may change within `reach` of the points, by a ray's speed."""
        p, far, rate = self.first(p), self.reach * self.first.grows, self.rate
        for step in self.back:
            stretch = step.stretch(length(p) + far)
            rate, far, p = rate * stretch, far * stretch, step(p)
        d = worn(self.own, leaf_distance(self.geometry, p, self.brought), p)
        return d * self.scale, rate

    def colour(self, p: Array) -> Array:
        """Linear colours (3, M) or, of one everywhere, (3, 1)."""
        if self.look.element is None:
            return self.rgb
        for step in (self.first, *self.back):
            p = step(p)
        own = carry_back(self.look.texture, p)[: self.look.element.dimension]
        return colour_at(self.look, own, light=True).T

    def gradient(self, p: Array) -> Array:
        """Gradients (3, M) of the world distance."""
        back = [self.first, *self.back]
        points = [p]
        for step in back:
            points.append(step(points[-1]))
        q = points[-1]
        if self.geometry in self.brought:
            g = self.brought[self.geometry].slopes(q.T).T
        else:
            slopes = GEOMETRIES[self.geometry].slopes
            assert slopes is not None
            g = np.stack(slopes(q)[1:])
        for at, step in enumerate(self.own):
            if isinstance(step, Shell):
                d = worn(self.own[:at], leaf_distance(self.geometry, q, self.brought), q)
                g = np.where(d < 0.0, -g, g)
            elif isinstance(step, Displace):
                f = step.frequency
                (sx, sy, sz), (cx, cy, cz) = np.sin(f * q), np.cos(f * q)
                g = g + step.amount * f * np.stack([cx * sy * sz, sx * cy * sz, sx * sy * cz])
        for step, at in zip(reversed(back), reversed(points[:-1]), strict=True):
            g = step.pull(at, g)
        return g * self.scale


FAR = 1e9  # distance to what is not there
OPAQUE, OUT, MEDIUM = range(-1, 2)  # media of other extinctions come after MEDIUM

_MARGIN = 2e-2
"""Balls are this much larger than what they hold, in world units: more than the least step of a ray."""


_INSIDE = 1e-7  # how far behind a surface its colour is asked for
_EQUAL = 1e-10  # of distances: what is left of rounding


class ExactState(Record):
    """State of a fold, and optional values."""

    d: Any  # distance (M,)
    medium: Any  # number of the medium that the material is, 0 for an opaque one: an int, or an array (M,)
    near: Any = None  # no nearer than this does the kind of material change inside
    rgb: Any = None  # linear colour, (3, 1) or (3, M)
    slope: Any = None  # gradient of d, (3, M)
    owner: Any = None  # number of the object whose material holds, from 1
    glow: Any = None  # light that it sends of itself, (3, 1) or (3, M)

    def kind(self) -> Kinds:
        """`OUT`, `OPAQUE` or the number of a medium, (M,)."""
        kind = np.where(self.d < 0.0, np.where(self.medium, self.medium, OPAQUE), OUT)
        return np.asarray(kind, np.int32)


_ZERO = np.zeros((3, 1))
NOTHING = ExactState(np.float64(FAR), np.int32(0), np.float64(FAR), _ZERO, _ZERO, 0, _ZERO)


def join(op: str, k: float, a: ExactState, b: ExactState) -> ExactState:
    """One step of the fold; of two operands of equal distance the gradient is the later's."""
    d, paint, turn = folded(np, TOKENS[op], k, a.d, b.d)
    near = None if a.near is None or b.near is None else np.minimum(a.near, b.near)
    if near is not None and op == "smooth":
        near = np.minimum(near, abs(a.d - b.d) / 2.0)
    side = -1.0 if op == "subtract" else 1.0
    slope = None if a.slope is None or b.slope is None else a.slope + (side * b.slope - a.slope) * turn
    if paint is None:
        return ExactState(d, a.medium, near, a.rgb, slope, a.owner, a.glow)
    medium = np.where(paint > 0.5, b.medium, a.medium)
    if op == "union":  # on surfaces in one plane the earlier one's shows, as where d is 0
        plane = (abs(a.d - b.d) < _EQUAL) & (abs(b.d) < 2 * _INSIDE) & (a.medium == 0) & (b.medium == 0)
        paint = paint & ~plane
    rgb = None if a.rgb is None or b.rgb is None else a.rgb + (b.rgb - a.rgb) * paint
    owner = None if a.owner is None or b.owner is None else np.where(paint > 0.5, b.owner, a.owner)
    glow = None if a.glow is None or b.glow is None else a.glow + (b.glow - a.glow) * paint
    return ExactState(d, medium, near, rgb, slope, owner, glow)


class ExactField:
    """The objects of a graph's root, with every step into the world."""

    def __init__(self, root: Fold, brought: Brought | None = None) -> None:
        self.root = root
        result = list(placed_leaves(root))
        # A leaf far from a point changes no sign there if it is further than all blends together can reach,
        # and one that is taken away further than anything is deep.
        blends = 1.25 * sum(_blends(root))
        deep = max((ExactBody(leaf, steps, 0.0).deep for leaf, steps, _ in result), default=0.0)
        self.bodies = [
            ExactBody(leaf, steps, _MARGIN + blends + (deep if blends and taken else 0.0), brought)
            for leaf, steps, taken in result
        ]
        sigmas = sorted({body.sigma for body in self.bodies})
        self.mixed = len(sigmas) > 1
        self.sigma = np.array([0.0, *(sigma for sigma in sigmas if sigma)])  # of media, by number
        self.media = len(self.sigma) > 1
        for body in self.bodies:
            body.medium = int(np.searchsorted(self.sigma, body.sigma))
        self.rough = np.array([0.0, *(body.look.roughness for body in self.bodies)])  # of owners
        self.glows = any(body.glow.any() for body in self.bodies)

    def probe(self, p: Array, met: Array, speed: Array) -> tuple[Array, Kinds, Array]:
        """Distance, kind as of `ExactState` and how far the kind stays the same, (M,) each, at world
        points (3, M); ``met`` (N, M) says in which objects' balls they lie, ``speed`` is as `ExactBody.span`
        tells.
        """
        count = p.shape[1]
        fastest, most = np.full(count, 1e-9), np.full(count, FAR)
        d = np.full(met.shape, FAR)
        for body, row, here, fast in zip(self.bodies, d, met, speed, strict=True):
            at = np.nonzero(here)[0]
            if len(at):
                row[at], rate = body.distance(p if len(at) == count else p.take(at, 1))
                fastest[at] = np.maximum(fastest[at], rate * fast[at])
                if body.back:
                    most[at] = np.minimum(most[at], body.reach)
        rows = zip(self.bodies, d, strict=True)

        def known() -> ExactState:
            body, row = next(rows)
            return ExactState(row, np.int32(body.medium), abs(row) if self.mixed else None)

        state = _fold(self.root, known)
        way = abs(state.d)
        if self.mixed:
            way = np.where(state.d < 0.0, np.minimum(way, state.near), way)
        return state.d, state.kind(), np.minimum(way / fastest, most)

    def at(self, p: Array, *, gradient: bool = False) -> ExactState:
        """All that the fold carries at world points (3, M), near left out, the gradient only if asked for."""
        bodies = enumerate(self.bodies, 1)

        def known() -> ExactState:
            number, body = next(bodies)
            slope = body.gradient(p) if gradient else None
            glow = body.glow if self.glows else None
            d, medium = body.distance(p)[0], np.int32(body.medium)
            return ExactState(d, medium, None, body.colour(p), slope, number, glow)

        return _fold(self.root, known)


def _fold(node: Node, known: Callable[[], ExactState]) -> ExactState:
    """The fold of a node; ``known`` is called for each leaf in order."""
    if isinstance(node, Leaf):
        return known()
    if not node.links:
        return NOTHING
    state = _fold(node.links[0].node, known)
    for link in node.links[1:]:
        state = join(link.op, link.width, state, _fold(link.node, known))
    return state


def _blends(fold: Fold) -> Iterator[float]:
    """Widths of all blends."""
    for at, link in enumerate(fold.links):
        if at and link.width:
            yield link.width
        if isinstance(link.node, Fold):
            yield from _blends(link.node)


STEP = 2e-3
STEPS = 5_000  # of a ray at most


class Changes(NamedTuple):
    """Changes of material along M rays, up to their end or the first opaque surface."""

    first: Kinds  # where each ray starts (M,)
    last: Kinds  # where it ends
    ray: Ints  # of each change (K,)
    t: Array  # its place, in order along each ray
    before: Kinds
    after: Kinds

    def media(self, end: Array) -> tuple[Ints, Array, Array, Kinds]:
        """Stretches in media of rays with ends (M,): ray, entry, exit and kind, in order along each ray."""

        def sorted_(edge: Kinds, kinds: Kinds, at: Array) -> tuple[Ints, Array, Kinds]:
            whole, part = np.nonzero(edge >= MEDIUM)[0], kinds >= MEDIUM
            ray, t = np.concatenate([self.ray[part], whole]), np.concatenate([self.t[part], at[whole]])
            order = np.lexsort((t, ray))
            return ray[order], t[order], np.concatenate([kinds[part], edge[whole]])[order]

        ray, enter, kind = sorted_(self.first, self.after, np.zeros_like(end))
        return ray, enter, sorted_(self.last, self.before, end)[1], kind


def march(field: ExactField, o: Array, d: Array, end: Array, *, exact: bool = False) -> Changes:
    """Follow rays o + t d, t from 0 to ``end`` (M,), to 1e-9 or so if ``exact``, otherwise to 1e-6."""
    enter, leave, speed = spans = np.empty((3, len(field.bodies), o.shape[1]))
    for index, body in enumerate(field.bodies):
        spans[:, index] = body.span(o, d)
    leave = np.minimum(leave, end)
    enter = np.where(leave > np.maximum(enter, 0.0), enter, np.inf)
    first, last = np.full((2, o.shape[1]), OUT, np.int32)
    ray = np.nonzero((enter < np.inf).any(0))[0]
    enter, leave = enter[:, ray], np.where(enter < np.inf, leave, -np.inf)[:, ray]
    stop, t = leave.max(0, initial=-np.inf), np.maximum(enter.min(0, initial=np.inf), 0.0)
    origin, along, speed = o.take(ray, 1), d.take(ray, 1), speed.take(ray, 1)
    lower: Any = None
    result: list[tuple[Any, ...]] = []
    taken = 0
    while len(ray):
        taken += 1
        if taken > STEPS:
            raise ValueError(f"a ray of the exact picture takes more than {STEPS:,} steps")
        value, kind, way = field.probe(origin + t * along, (enter <= t) & (t <= leave), speed)
        if lower is None:
            first[ray] = np.where(t == 0.0, kind, OUT)
            lower = t, np.full_like(t, FAR), first[ray]
        at = np.nonzero(kind != lower[2])[0]
        if len(at):
            result.append((ray[at], *(v[at] for v in (*lower, t, value, kind))))
        last[ray] = kind
        following = np.where(enter > t, enter, np.inf).min(0)
        lower, t = (t, value, kind), np.minimum(np.minimum(t + np.maximum(way, STEP), following), stop)
        going = np.nonzero((kind != OPAQUE) & (lower[0] < stop))[0]
        if len(going) < len(ray):
            ray, t, stop, lower = ray[going], t[going], stop[going], tuple(v[going] for v in lower)
            parts = origin, along, enter, leave, speed
            origin, along, enter, leave, speed = (part.take(going, 1) for part in parts)
    if not result:
        return Changes(first, last, np.zeros(0, int), np.zeros(0), first[:0], first[:0])
    ray, low, low_d, before, high, high_d, after = (np.concatenate(v) for v in zip(*result, strict=True))
    # Where d passes through 0 a straight line finds the place; where the material alone changes, halving.
    surface = (before == OUT) != (after == OUT)
    halvings = 20 if exact else 11
    for at, rounds in ((np.nonzero(surface)[0], 2 * exact), (np.nonzero(~surface)[0], halvings)):
        for _ in range(rounds if len(at) else 0):
            low_at, high_at = low[at], high[at]
            share = low_d[at] / (low_d[at] - high_d[at]) if rounds == 2 else 0.5
            middle = low_at + share * (high_at - low_at)
            here = field.at(o.take(ray[at], 1) + middle * d.take(ray[at], 1))
            same = here.kind() == before[at]
            low[at], low_d[at] = np.where(same, middle, low_at), np.where(same, here.d, low_d[at])
            high[at], high_d[at] = np.where(same, high_at, middle), np.where(same, high_d[at], here.d)
    line = low + low_d / np.where(surface, low_d - high_d, 1.0) * (high - low)
    return Changes(first, last, ray, np.where(surface, line, high), before, after)


TILE = 1 << 15  # samples at a time
TOLERANCE = 2e-4  # A part of a ray in a medium is halved until its scattered light changes by less

HALVINGS = 9
SPOTS = 64  # places on a lamp of a radius that a sample of a surface is lit from
SPOTS_IN_MEDIA = 16

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4) + np.array([[1.0], [0.0]])
_GOLDEN = (5.0**0.5 - 1.0) / 2.0


def solid_image(
    root: Fold,
    stage: Stage,
    canvas: tuple[int, int],
    *,
    per_side: int = 2,
    brought: Brought | None = None,
    progress: Callable[[float], None] = lambda _: None,
    light: Callable[[ExactField, Stage, Array], Array] | None = None,
) -> Image:
    """Draw the exact picture of solids, as `reference_image`; `ValueError` for a faulty stage, too.

    ``light`` is `radiance` unless given, or finds light twice by chance: ``noise`` is half the difference.
    """
    if fault := stage.fault():
        raise ValueError(fault)
    root, stage, _ = sized_root(root, stage)
    field = ExactField(root, brought)
    width, height = canvas
    step = max(1, TILE // (width * per_side * per_side))
    parts = []
    for top in range(0, height, step):
        rows = range(top, min(top + step, height))
        samples = (light or radiance)(field, stage, ways(stage, canvas, rows, per_side))
        parts.append(samples.reshape(-1, 4, len(rows), per_side, width, per_side).mean((3, 5)))
        progress(rows.stop / height)
    found = np.concatenate(parts, 2)
    shown = partial(from_light, transparent=stage.transparent, exposure=stage.camera.exposure)
    image = shown(found.mean(0))
    if len(found) == 2:
        one, other = (np.asarray(shown(half), np.float64) for half in found)
        image.noise = float(np.sqrt(np.mean((one - other) ** 2))) / 2.0
    return image


def radiance(field: ExactField, stage: Stage, d: Array) -> Array:
    """Linear light, premultiplied, and alpha (4, M), that comes to the eye along unit directions d (3, M),
    without what the sky sends.
    """
    behind = np.zeros((4, d.shape[1]))
    if not stage.transparent:
        behind[:3], behind[3] = heaven(stage, d), 1.0
    o, view = seen_along(field, stage, d)
    if stage.ground:
        seen = np.nonzero((view.end < np.inf) & (view.last != OPAQUE))[0]
        p = o[:, seen] + view.end[seen] * d[:, seen]
        upright = np.broadcast_to([[0.0], [1.0], [0.0]], p.shape)
        shade = np.reshape(stage.ground.rgb, (3, 1)) * _received(field, stage, p, upright)
        clear = np.exp(-(p[0] ** 2 + p[2] ** 2) / stage.ground.fade**2)
        behind[:3, seen] = clear * shade + (1.0 - clear) * np.reshape(stage.horizon, (3, 1))
        behind[3, seen] = 1.0
    seen = np.nonzero(view.last == OPAQUE)[0]
    p = o[:, seen] + view.end[seen] * d[:, seen]
    state, normal = facing(field, p, d[:, seen])
    behind[:3, seen] = state.rgb * _received(field, stage, p, normal)
    if field.glows:
        behind[:3, seen] += state.glow
    behind[3, seen] = 1.0
    if not field.media:
        return behind
    ray, through = view.ray, np.exp(-view.total)
    light = _scattered(field, stage, o[:, ray], d[:, ray], view)
    out = behind * through
    for row, values in zip(out, light, strict=False):
        row += np.bincount(ray, values, d.shape[1])
    out[3] += 1.0 - through
    return out


def heaven(stage: Stage | Sky, d: Array) -> Array:
    """Colours (3, M) of a sky along unit directions d (3, M), as it is written."""
    horizon, zenith = np.reshape(stage.horizon, (3, 1)), np.reshape(stage.zenith, (3, 1))
    return horizon + (zenith - horizon) * np.clip(d[1] / 0.5, 0.0, 1.0)


class Sight(NamedTuple):
    """All that M rays meet up to their first opaque surface or the ground; see `Changes`."""

    end: Array  # how far each ray goes (M,), inf where it escapes, 0 where it starts in something opaque
    first: Kinds
    last: Kinds  # `OPAQUE` where it ends at something opaque
    ray: Ints  # of each stretch in a medium (K,), in order along each ray
    enter: Array
    leave: Array
    sigma: Array  # extinction
    depth: Array  # optical depth
    before: Array  # that of the ray before it

    @property
    def total(self) -> Array:
        """Optical depths (M,)."""
        return np.bincount(self.ray, self.depth, len(self.end))

    def flown(self, depth: Array) -> Array:
        """Places t (M,) where rays have an optical depth (M,) behind them, inf for none."""
        t, own = np.full(len(depth), np.inf), depth[self.ray] - self.before
        ends = (own >= 0.0) & (own < self.depth)
        t[self.ray[ends]] = self.enter[ends] + own[ends] / self.sigma[ends]
        return t


def sight(field: ExactField, o: Array, d: Array, end: Array, *, exact: bool = False) -> Sight:
    """Follow rays as `march`; their ends are changed to where they meet something opaque."""
    changes = march(field, o, d, end, exact=exact)
    hit = changes.after == OPAQUE
    end[changes.ray[hit]] = changes.t[hit]
    end[changes.first == OPAQUE] = 0.0
    ray, enter, leave, kind = changes.media(end)
    sigma = field.sigma[kind]
    depth = sigma * (leave - enter)
    before = np.cumsum(depth) - depth
    before -= before[np.searchsorted(ray, ray)]  # of the ray's own
    return Sight(end, changes.first, changes.last, ray, enter, leave, sigma, depth, before)


def seen_along(field: ExactField, stage: Stage, d: Array, o: Array | None = None) -> tuple[Array, Sight]:
    """Origins (3, M) of rays along d, the eye's unless given, and what they meet, the ground from above."""
    eyes = o is None
    o = np.repeat(np.reshape(stage.camera.eye, (3, 1)), d.shape[1], 1) if o is None else o
    end = np.full(d.shape[1], np.inf)
    if stage.ground:
        down = np.nonzero((d[1] < 0.0) & (o[1] > stage.ground.y))[0]
        end[down] = (stage.ground.y - o[1, down]) / d[1, down]
    view = sight(field, o, d, end, exact=eyes)
    if eyes and (view.first == OPAQUE).any():
        raise ValueError("the eye is inside an opaque object")
    return o, view


def ways(stage: Stage, canvas: tuple[int, int], rows: range, per_side: int) -> Array:
    """Unit directions (3, M) of the samples of some pixel rows, row by row of samples."""
    forward, right, up = (np.reshape(axis, (3, 1)) for axis in stage.camera.axes())
    x, y = sample_points(canvas, rows, per_side)
    way: Array = forward / np.tan(stage.camera.fov_rad / 2.0) + x * right + y * up
    return way / length(way)


def facing(field: ExactField, p: Array, d: Array) -> tuple[ExactState, Array]:
    """The state just behind surface points that rays along d met, and unit normals against d."""
    state = field.at(p + _INSIDE * d, gradient=True)
    normal = state.slope / np.maximum(length(state.slope), 1e-12)
    return state, np.where((normal * d).sum(0) > 0.0, -normal, normal)


def sideways(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors (3, M) square to unit vectors and to each other."""
    side = np.cross(axis, np.where(abs(axis[0]) < 0.6, [[1.0], [0.0], [0.0]], [[0.0], [1.0], [0.0]]), axis=0)
    side /= length(side)
    return side, np.cross(axis, side, axis=0)


def aimed(light: Light, p: Array, share: Any, turn: Any) -> tuple[Array, Array, Array]:
    """Places (3, M) on a lamp that points p (3, M) see, unit ways there, and by what its power is divided,
    (M,): r² for a point, inf within the lamp. Ways are even over the solid angle: ``share`` of it lies nearer
    the middle, ``turn`` is about that. A surface receives the mean of ``power cos / divisor``.
    """
    centre = np.reshape(light.position, (3, 1))
    way = centre - p
    away = length(way)
    r = np.maximum(away, NEAREST)
    axis = way / r
    if not light.radius:
        return np.broadcast_to(centre, p.shape), axis, r**2
    square = np.minimum(light.radius / r, 1.0) ** 2
    least = np.sqrt(1.0 - square)
    short = share * square / (1.0 + least)  # 1 - cosine
    sine2 = short * (2.0 - short)
    side, up = sideways(axis)
    across = np.cos(2.0 * np.pi * turn) * side + np.sin(2.0 * np.pi * turn) * up
    unit = (1.0 - short) * axis + np.sqrt(sine2) * across
    reach = r * (1.0 - short) - np.sqrt(np.maximum(light.radius**2 - r**2 * sine2, 0.0))
    return p + reach * unit, unit, np.where(away > light.radius, r**2 * (1.0 + least) / 2.0, np.inf)


def _received(field: ExactField, stage: Stage, p: Array, normal: Array) -> Array:
    """Light (3, M) that surfaces of a normal receive, ambient and direct."""
    turned = np.arange(p.shape[1]) * _GOLDEN  # so that neighbours err differently

    def cosine(way: Array) -> Array:
        return np.maximum((normal * way).sum(0), 0.0)

    direct = _direct(field, stage, p, LIFT * normal, cosine, SPOTS, turned)
    return direct + AMBIENT[0] + AMBIENT[1] * normal[1]


def _direct(
    field: ExactField, stage: Stage, p: Array, lift: Any, weigh: Any, count: int, turned: Array
) -> Array:
    """Light (3, M) of all lamps at points p, seen from p + lift, unit ways weighed by ``weigh``.

    Ways to a sphere are ``count``, in pairs across its middle, which is their mean, ``turned`` about it.
    """
    total: Any = 0.0
    for light in stage.lights:
        spots, sides = (count // 2, (0.0, 0.5)) if light.radius else (1, (0.0,))
        direct = np.zeros(p.shape[1])
        for at, side in product(range(spots), sides):
            to, way, divisor = aimed(light, p, (at + 0.5) / spots, at * _GOLDEN + side + turned)
            part = light.power * weigh(way) / divisor
            lit = np.nonzero(part > 0.0)[0]
            part[lit] *= visible(field, (p + lift)[:, lit], to[:, lit])
            direct += part / (spots * len(sides))
        total = total + np.reshape(light.rgb, (3, 1)) * direct
    return total


def visible(field: ExactField, p: Array, to: Array) -> Array:
    """Transmittance (M,) between points (3, M)."""
    way = to - p
    r = length(way)
    view = sight(field, p, way / np.maximum(r, 1e-300), r)
    return (view.last != OPAQUE) * np.exp(-view.total)


def _scattered(field: ExactField, stage: Stage, o: Array, d: Array, view: Sight) -> Array:
    """Light (3, K) that stretches of rays in media, o + t d, send and scatter to the eye."""
    opaque, weight = -np.expm1(-view.depth), np.exp(-view.before)

    def part(at: Ints, low: Array, high: Array) -> Array:
        """Gauss-Legendre quadrature over what shares ``low`` to ``high`` of a part's opacity."""
        share = low + (high - low) / 2.0 * _NODES[:, None]
        t = (view.enter[at] - np.log1p(-share * opaque[at]) / view.sigma[at]).ravel()
        p = np.tile(o[:, at], len(_NODES)) + t * np.tile(d[:, at], len(_NODES))
        turned = np.tile(at, len(_NODES)) * _GOLDEN
        arrives = _direct(field, stage, p, 0.0, lambda _: 0.25, SPOTS_IN_MEDIA, turned)
        state = field.at(p)
        source = state.rgb * (arrives + AMBIENT[0])
        if field.glows:
            source = source + state.glow
        mean = np.einsum("cnk,n->ck", source.reshape(3, len(_NODES), -1), _WEIGHTS)
        return mean * (high - low) / 2.0 * opaque[at] * weight[at]

    at, low = np.arange(len(opaque)), np.zeros(len(opaque))
    high = low + 1.0
    value, total = part(at, low, high), np.zeros((3, len(opaque)))
    for left in reversed(range(HALVINGS)):
        middle = (low + high) / 2.0
        halves = part(np.tile(at, 2), np.concatenate([low, middle]), np.concatenate([middle, high]))
        both = halves.reshape(3, 2, -1).sum(1)
        rough = (abs(both - value).max(0) > TOLERANCE) & (left > 0)
        for row, values in zip(total, both[:, ~rough], strict=True):
            row += np.bincount(at[~rough], values, len(row))
        value, rough = halves[:, np.tile(rough, 2)], np.nonzero(rough)[0]
        at = np.tile(at[rough], 2)
        low, high = (
            np.concatenate([low[rough], middle[rough]]),
            np.concatenate([middle[rough], high[rough]]),
        )
    return total
