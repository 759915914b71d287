"""The solids' field: what it answers at points of space, and where along a ray it has to be asked.

Each object's frame (`solid_frames.py`) carries points into its own space, where the network meets them. An
object lies in a ball; farther than its blends reach beyond that, it changes nothing and is not asked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from scenelang.renderers.arrays import Array, Arrays, Layers
from scenelang.renderers.field import INTERSECT, SMOOTH, SUBTRACT, UNION
from scenelang.renderers.solid.frames import SolidFrame, read_solid_frame
from scenelang.renderers.solid.network import BLEND, EMPTY, RADIUS, Cell, SolidNetwork, Wanted

_ROWS = (1, 2, 5)  # of a point's memory, by `Wanted`
INF = float("inf")
SLACK = 0.002  # leaf units by which a learned surface may leave the unit ball


@dataclass(frozen=True, slots=True)
class Solid:
    """One object, ready to be met.

    Args:
        frame: where it lies.
        token: how it joins what came before.
        look: colour and medium (4, 1).
        layers: its decoder.
        radius: leaf units from its origin beyond which it changes nothing.
        centre, extent: a ball (3,) of the world around that.
        cells: of its token, by what is wanted.
    """

    frame: SolidFrame
    token: int
    look: Array
    layers: Layers
    radius: float
    centre: Array
    extent: float
    cells: tuple[Cell, ...]

    @property
    def draws(self) -> bool:
        """Whether something may be seen, where it is met, of what was empty before."""
        return self.token in (UNION, SMOOTH)


class Meeting(NamedTuple):
    """What the field answers at points (M,).

    Args:
        distance: D.
        register: colour and medium (4, M), the medium alone (1, M), or nothing (0, M).
        gradient: of D (3, M), if asked for.
        change: a bound on D and on how far another object's material may begin, if asked for.
        met: pairs of points and objects that met.
    """

    distance: Array
    register: Array
    gradient: Array = None
    change: Array = None
    met: int = 0


class SolidField:
    """A program's objects with their weights, ready to be met by points.

    Args:
        network: trained parameters, on any device.
        vectors: (N, 64) float32, geometry and material vectors.
        tokens: (N,) boolean tokens 0 to 3.

    Raises:
        ProgramError: an object's vector holds no way from the world to a leaf.
    """

    def __init__(self, network: SolidNetwork, vectors: np.ndarray, tokens: np.ndarray) -> None:
        self.network, self.xp = network, network.xp
        with self.xp.inference():
            self.solids = self._solids(vectors, tokens)
        draws = [i for i, solid in enumerate(self.solids) if solid.draws]
        self.draws = None if len(draws) == len(self.solids) else draws
        """The objects that draw, None if all do."""
        self.media = any(float(solid.look[3, 0]) > 0.5 for solid in self.solids)
        """Whether some object is a medium."""
        self.mixed = self.media and any(float(solid.look[3, 0]) <= 0.5 for solid in self.solids)
        """Whether not all are."""

    def _solids(self, vectors: np.ndarray, tokens: np.ndarray) -> list[Solid]:
        xp, layout, like = self.xp, self.network.layout, self.network.codes
        solids: list[Solid] = []
        frames = [read_solid_frame(vector[: layout.geometry], layout) for vector in vectors]
        deepest = max((frame.scale * (1 + abs(frame.amount)) for frame in frames), default=0.0)
        smooths, widest = 0, 0.0  # of the blends from an object on
        for frame, vector, token in zip(frames[::-1], vectors[::-1], tokens[::-1].tolist(), strict=True):
            g, m = vector[: layout.geometry], vector[layout.geometry :]
            smooth = token == SMOOTH
            smooths, widest = smooths + smooth, max(widest, frame.blend * smooth)
            layers = self.network.decoder(xp.array(g[: layout.code].copy(), like))
            look = self.network.look(xp.array(m[layout.material_code].copy(), like))
            matrix = xp.array(m[layout.colour].reshape(3, 4).copy(), like)
            colour = (matrix[:, :3] @ look[:3] + matrix[:, 3]).clip(0.0, 1.0)
            outer = frame.outer.placed(xp, like)
            steps = [step.placed(xp, like) for step in frame.steps]
            blends = widest * (1 + smooths / 4)
            if smooths and token == SUBTRACT:  # it says how deep points inside others lie
                blends += deepest
            radius = 1 + SLACK + abs(frame.amount) + blends / frame.scale
            back = np.linalg.inv(frame.outer.linear.astype(np.float64))
            centre = (-back @ frame.outer.shift).astype(np.float32)
            solids.append(
                Solid(
                    frame=replace(frame, outer=outer, steps=tuple(steps)),
                    token=token,
                    look=xp.concat([colour, look[3:]], 0)[:, None],
                    layers=layers,
                    radius=radius,
                    centre=xp.array(centre, like),
                    extent=float(np.linalg.norm(back, 2)) * frame.ball(radius),
                    cells=self.network.cell(token, frame.blend if smooth else BLEND),
                )
            )
        return solids[::-1]

    def near(self, origin: Array, way: Array) -> Array:
        """Which rays (k,) may meet any object: those within a cone around its ball."""
        xp = self.xp
        found = way[0] > INF
        for solid in self.solids:
            if not solid.draws:
                continue
            to = solid.centre - origin
            far = float(xp.sqrt(to @ to))
            if far <= solid.extent:
                return xp.where(way[0] < INF)
            found = found | (to @ way >= far * (1 - (solid.extent / far) ** 2) ** 0.5 - 1e-5 * far)
        return xp.where(found)

    def spans(self, origin: Array, way: Array, limit: Array) -> tuple[Array, Array, Array]:
        """Where rays may meet each object: begin and end (N, M), inf and -inf for never, and a bound (N, M)
        on how fast its distance changes along them.

        Args:
            origin: of all rays (3,).
            way: unit directions (3, M).
            limit: where the rays end (M,).
        """
        xp, count = self.xp, way.shape[1]
        shape = len(self.solids), count
        begin, end, rate = (xp.full(shape, v, way) for v in (INF, -INF, 1.0))
        for i, solid in enumerate(self.solids):
            frame = solid.frame
            a = frame.outer.linear @ way
            b = frame.outer.linear @ origin + frame.outer.shift
            square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
            middle = -(b @ a) / square
            near = b[:, None] + middle * a  # the point closest to the ball's centre
            left = frame.ball(solid.radius) ** 2 - near[0] * near[0] - near[1] * near[1] - near[2] * near[2]
            half = xp.sqrt((left / square).clip(0.0))
            first, last = (middle - half).clip(0.0), xp.minimum(middle + half, limit)
            hit = (left > 0) & (first <= last)
            begin[i] = xp.select(hit, first, begin[i])
            end[i] = xp.select(hit, last, end[i])
            rate[i] = (frame.scale * frame.growth(solid.radius)) * xp.sqrt(square)
            if solid.token == INTERSECT:  # outside its ball nothing is left of what came before
                begin[:i] = xp.maximum(begin[:i], begin[i])
                end[:i] = xp.minimum(end[:i], end[i])
                begin[:i] = xp.select(begin[:i] <= end[:i], begin[:i], xp.full((), INF, way))
        return begin, end, rate

    def meet(
        self, p: Array, inside: Array, wanted: Wanted, gradient: bool = False, change: bool = False
    ) -> Meeting:
        """Let points meet the objects.

        Args:
            p: world points (3, M).
            inside: of each object, which points (N, M) may be in its reach.
            wanted: what of the register to answer beside the distance.
            gradient, change: what else.
        """
        xp, count, pairs = self.xp, p.shape[1], 0
        memory = xp.full((_ROWS[wanted], count), 0.0, p)
        memory[0] = EMPTY
        slope = xp.full((3, count), 0.0, p) if gradient else None
        bound = xp.full((count,), EMPTY, p) if change else None
        touched = None if self.draws is None else inside[0] & ~inside[0]
        for solid, mask in zip(self.solids, inside, strict=True):
            if touched is not None:
                if solid.draws:
                    touched = touched | mask
                else:
                    mask = mask & touched
            index = xp.where(mask)
            met = len(index)
            if not met:
                continue
            pairs += met
            place = None if met == count else index
            before = _part(xp, memory, place)
            d, own = self.distance(solid, _part(xp, p, place), gradient)
            cell = solid.cells[wanted]
            found, take = self.network.join(d, before, solid.look, cell, wanted)
            if bound is not None:
                gap = abs(d)
                if solid.token == SMOOTH:
                    gap = xp.minimum(gap, abs(before[0] - d) / 2)
                bound = _update(xp, bound, place, xp.minimum(_part(xp, bound, place), gap))
            if slope is not None:
                by_own, by_past = self.network.partials(d, before[0], take, cell)
                past = _part(xp, slope, place)
                slope = _update(xp, slope, place, by_own * own + by_past * past)
            memory = _update(xp, memory, place, found)
        if bound is not None:
            bound = xp.minimum(bound, abs(memory[0]))
        return Meeting(memory[0], memory[1:], slope, bound, pairs)

    def distance(self, solid: Solid, p: Array, gradient: bool) -> tuple[Array, Array | None]:
        """An object's world distance (M,) at world points (3, M), and its gradient (3, M) if asked for."""
        xp, network, frame = self.xp, self.network, solid.frame
        scale = frame.scale
        q = frame.local(xp, p)
        rim = length = None
        at = q
        if solid.radius > RADIUS:
            length = xp.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
            rim = RADIUS / length.clip(RADIUS)
            at = q * rim
        if gradient:
            d, g = network.gradient(at, solid.layers)
        else:
            d, g = network.distance(at, solid.layers), None
        if rim is not None and length is not None:
            d = d + (length - RADIUS).clip(0.0)
            if g is not None:
                n = q / length.clip(1e-9)
                radial = g[0] * n[0] + g[1] * n[1] + g[2] * n[2]
                g = xp.select(length > RADIUS, rim * (g - radial * n) + n, g)
        if frame.amount:
            f = frame.frequency
            s, c = xp.sin(f * q), xp.cos(f * q)
            d = d + frame.amount * (s[0] * s[1] * s[2])
            if g is not None:
                more = xp.stack([c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]], 0)
                g = g + (frame.amount * f) * more
        return d * scale, None if g is None else frame.pulled(xp, p, g) * scale


def _part(xp: Arrays, whole: Array, index: Array | None) -> Array:
    """Entries (…, k) of an array (…, M), or all."""
    return whole if index is None else xp.take(whole, index)


def _update(xp: Arrays, whole: Array, index: Array | None, values: Array) -> Array:
    """An array (…, M) with new values (…, k) at some places, or at every one."""
    if index is None:
        return values
    xp.put(whole, index, values)
    return whole
