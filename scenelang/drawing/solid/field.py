"""The solids' field: a Program's objects with their weights, asked at points and along rays by the kernel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from scenelang.assets.element import Element
from scenelang.compiler.groups import OPERATOR, SMOOTH, SUBTRACT, UNION, read_groups
from scenelang.compiler.program import Paint, ProgramError
from scenelang.drawing.arrays import Array
from scenelang.drawing.kernel import Asked, load_kernel
from scenelang.drawing.solid.march import HALVINGS, STEPS, Pieces, Trail, Work
from scenelang.drawing.solid.network import SolidNetwork
from scenelang.drawing.tables import DRAWS, SKINNED, Rows, Tables

AWAY = 50.0  # leaf units by which objects are moved that are not to be met


class Material(NamedTuple):
    """A material at points (M,); colours are linear."""

    colour: Array  # (3, M)
    medium: Array  # a mask
    glow: Array  # (3, M)
    density: Array  # extinction per world unit, where it is a medium
    roughness: Array  # of what is glossy, minus it of metal, 0 of others


class SolidField:
    """A program's objects with their weights, ready to be asked.

    Of rows of vectors (N, 64) and tokens (N,), ``brought`` and ``paints`` are elements and textures, None
    where a row has the geometry or the colour of its vector. Raises `ProgramError` where a vector holds no
    way to a leaf, or an element is damaged. Distances hold up to ``reach`` around objects, at least.
    """

    def __init__(
        self,
        network: SolidNetwork,
        vectors: np.ndarray,
        tokens: np.ndarray,
        brought: Sequence[Element | None] | None = None,
        paints: Sequence[Paint | None] | None = None,
        reach: float = 0.0,
    ) -> None:
        self.network, self.xp, self.reach = network, network.xp, reach
        self.rows, self.paints = (vectors, tokens, brought), paints
        self.tables = tables = Tables(network, *self.rows, paints, reach)
        self.objects, looks, xp, like = tables.objects, tables.looks, self.xp, network.codes
        self.looks, self.density = xp.array(looks.register, like), xp.array(looks.density, like)
        self.hues, self.switched, self.sigma = looks.hues, looks.switched, looks.sigma
        self.glowing, self.rough = looks.glowing, looks.rough
        self.edged, self.detail = tables.edged, tables.objects.rows["detail"]
        self.textures = self.hues > 3
        self.skinned = self.objects.flagged(SKINNED)
        self.draws = bool(self.objects.flagged(DRAWS).all())  # whether all objects draw
        self.media, self.mixed = (bool(tables.scene[name]) for name in ("media", "mixed"))

    def __len__(self) -> int:
        return len(self.objects.rows)

    @property
    def hollow(self) -> bool:
        """Whether there may be hollows, which take more to light."""
        return bool(self.skinned.any()) or not self.draws

    def glow(self, register: Array) -> Array:
        """The light (3, M) that materials of registers (R, M) give off, linear."""
        return register[self.hues : self.hues + 3] if self.glowing else 0 * register[:3]

    def extinction(self, register: Array) -> Array:
        """The extinction (M,) of media with registers (R, M), per world unit."""
        return 0 * register[0] + self.sigma if self.sigma else register[-self.switched]

    def material(self, met: Asked) -> Material:
        """The material at points that were asked for all, as it holds wherever D < 0."""
        register = met.register
        parts = self.glow(register), self.extinction(register), register[-2] * self.rough
        return Material(register[:3], register[-1] > 0.5, *parts)

    def near(self, p: Array, reach: Array | float, gradient: bool = False, every: bool = False) -> Asked:
        """As `Kernel.field`, at points (3, M) anywhere: exact where D is less than a reach, (M,) or one."""
        return load_kernel().field(self.tables, p, reach, gradient, every)

    def own(self, objects: Array, p: Array, gradient: bool = True) -> tuple[Array, Array]:
        """Distances (K,) from objects, whatever else is at points (3, K), and gradients (3, K) if asked."""
        return load_kernel().own(self.tables, objects, p, gradient)

    def worn(self, objects: Array, p: Array) -> Array:
        """Colours (3, K) of objects, whatever else is at points (3, K)."""
        return load_kernel().worn(self.tables, objects, p)

    def march(
        self,
        origin: Array,
        way: Array,
        limit: Array,
        *,
        start: Array | float = 0.0,
        gap: float,
        halvings: int = HALVINGS,
        steps: int = STEPS,
        whole: bool = False,
    ) -> Trail:
        """Follow rays from an origin (3,), or one each (3, M), along unit directions (3, M), from ``start``
        (M,) up to a limit (M,), in ``steps`` at most.

        ``halvings`` of the interval find where a medium gives way to a solid; ``gap`` is that of
        `MarchSettings`. If ``whole``, nobody asks for pieces of media.
        """
        found = load_kernel().rays(
            self.tables,
            *(origin, way, limit, start),
            gap=gap,
            steps=steps,
            halvings=halvings,
            parted=not whole,
            until_s=self.network.until_s,
        )
        pieces = Pieces(*(np.ascontiguousarray(found.pieces[name]) for name in Pieces._fields))
        work = Work(near=found.near, steps=found.steps, met=found.met, lost=found.lost)
        return Trail(found.hit, found.length, found.soft, found.depth, pieces, work)

    def shown(self, at: Array, radius: float, p: Array, n: Array) -> tuple[Array, Work]:
        """Shares (K,) of a lamp's light that lets through what is opaque to points (3, K) outside of the
        lamp, and what it took. Surfaces have normals n (3, K); in media, where one edge is enough, 0.
        """
        share, near, met = load_kernel().cones(self.tables, at, radius, p, n, self.network.until_s)
        return share, Work(near=near, met=met)

    shades = True  # whether `shade` can be asked

    def shade(self, stage: Rows, band: range) -> tuple[Array, Work]:
        """Rows of a picture (rows, W, 3 or 4) as `Kernel.shade`; raises `ProgramError` for numbers that are
        none.
        """
        picture, counts = load_kernel().shade(self.tables, stage, band, self.network.until_s)
        lights, near, steps, met, refined, lost, bad = counts
        if bad:
            raise ProgramError("numbers that the network cannot draw with")
        rays = picture[..., 0].size * (stage["every"] == 0) + refined * int(stage["count"])
        return picture, Work(int(rays), lights, near, steps, met, refined, lost)

    def opaque(self, reach: float) -> SolidField:
        """The field of what is opaque alone, with distances up to a reach around it.

        A later medium takes away what is opaque before it. In a group that is not of media alone, one that
        comes first is moved away.
        """
        vectors, tokens, brought = self.rows
        if self.media:
            medium, tree = self._medium(), read_groups(tokens)
            vectors, tokens = vectors.copy(), tokens.copy()
            whole = [bool(medium[(tree.path == group).any(1)].all()) for group in range(len(tree.joins))]
            for row in np.flatnonzero(medium).tolist():
                groups = [whole[group] for group in tree.path[row].tolist() if group >= 0]
                begins = bool(tree.first[row])
                if sum(groups) > begins * groups[-1:].count(True):
                    continue  # in a group of media, which goes as one
                if (begins and not groups[-1]) or not row:
                    vectors[row, self.network.layout.places.frame][3::4] += AWAY
                elif tokens[row] & OPERATOR <= SMOOTH:
                    tokens[row] = tokens[row] & ~OPERATOR | SUBTRACT
                    vectors[row, self.network.layout.places.width] = 0.0
        return type(self)(self.network, vectors, tokens, brought, None, reach)

    def hazy(self) -> SolidField:
        """The field of what is not opaque alone, where all is joined by plain unions; elsewhere itself."""
        vectors, tokens, brought = self.rows
        tree = read_groups(tokens)
        if not self.mixed or tree.deepest or (tree.tokens != UNION).any():
            return self
        medium = self._medium()
        kept = [brought[i] for i in np.flatnonzero(medium).tolist()] if brought else None
        return type(self)(self.network, vectors[medium], tokens[medium], kept)

    def _medium(self) -> np.ndarray:
        return np.asarray(self.tables.looks.register[-1] > 0.5)

    def texels(self, origin: Any, way: Array, begin: Array, end: Array) -> Array:
        """Texels (M,) that parts of rays may cross in a world unit, 0 where they pass no ball of an object
        with a texture; of an origin (3,) or (3, M), unit ways (3, M), begins and ends (M,).
        """
        xp, rows, result = self.xp, self.objects.rows, 0 * begin
        for i in np.flatnonzero(self.detail).tolist():
            to = xp.array(rows["centre"][i][:, None], begin) - origin
            middle = xp.minimum(xp.maximum((to * way).sum(0), begin), end)
            off = to - way * middle
            result = result + float(self.detail[i]) * ((off * off).sum(0) <= float(rows["extent"][i]) ** 2)
        return result
