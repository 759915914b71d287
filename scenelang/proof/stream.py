"""A compiled scene as its proof sees it: exact ways to the leaves, and what is certain at points there."""

from __future__ import annotations

import numpy as np

from scenelang.graph.chain import split_levels
from scenelang.graph.nodes import Graph
from scenelang.graph.spaces import PLANE
from scenelang.lifting.exact import lift_many
from scenelang.models.manifest import Manifest
from scenelang.program.emit import tokens_of
from scenelang.program.groups import anchored, felt, read_groups, widths_of
from scenelang.proof.errors import Errors
from scenelang.proof.fold import NOTHING, Enclosure, Floats, Joins
from scenelang.proof.rounding import EPS, written
from scenelang.reference.field import carry_back, leaf_distance
from scenelang.reference.textures import colour_at
from scenelang.renderers.frames import Frames
from scenelang.renderers.meetings import Index
from scenelang.words import TOKENS


class Stream:
    """N objects.

    Args:
        lowered: the scene as written.
        graph: its stream of leaves.
        manifest: of the model that it was compiled for.
        known: of geometries, by their names.

    Attributes:
        frames: ways from the world to the leaves, in float64.
        groups: of the stream.
        joins, group_joins: how objects and groups join; a blend that is free of others is not known here.
        rounds: (N,) which objects join by a blend, or begin a group that does.
        reach: (N,) leaf units from its origin beyond which an object has no say. Without it the fold is the
            same, or both folds are so far outside of everything that the blends to come, each of which brings
            them nearer by its width at most, leave them outside.
        rounding: (N,) leaf units by which float64 may misplace points within reach, or the fold's distance.
        unknown: geometries of which nothing is known but that they lie in the unit disc.
    """

    def __init__(self, lowered: Graph, graph: Graph, manifest: Manifest, known: dict[str, Errors]) -> None:
        rows = graph.rows()
        self._leaves = [row.leaf for row in rows]
        levels = [split_levels(leaf.steps, manifest.limits, PLANE) for leaf in self._leaves]
        self.frames = Frames(lift_many(levels, [(0.0,) * 4] * len(levels)))
        self.groups = groups = read_groups(tokens_of(rows))
        raw = np.array([TOKENS[row.op] for row in rows], np.intp)
        widths = widths_of(raw, np.array([row.k for row in rows]))
        seen = felt(groups, widths)
        reach = np.where(seen.everywhere | anchored(groups), np.inf, 1.0 + seen.total / self.frames.scale)
        objects, far = written(lowered.root), np.hypot(*graph.canvas) / min(graph.canvas)
        leaves = [objects[leaf.number] for leaf in self._leaves]
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
        self._known = {name: errors for name, errors in known.items() if name not in graph.elements}
        self.unknown = tuple(sorted(set(names) - self._known.keys()))
        self._shapes = {name: np.array([own == name for own in names]) for name in dict.fromkeys(names)}
        self._plain = np.array([leaf.look.colour() for leaf in self._leaves]).reshape(-1, 3).T
        self._painted = np.array([leaf.look.element is not None for leaf in leaves], bool)
        self._discoloured = [leaf.discoloured(within, far) for leaf, within in own]

    def crowd(self, canvas: tuple[int, int]) -> float:
        """How many objects a place on the canvas is in reach of, in the mean."""
        every, half = np.isinf(self.reach), np.array(canvas)[:, None] / min(canvas)
        low, high = self.frames.boxes(np.where(every, 0.0, self.reach))
        sides = np.where(every, 2 * half, np.fmin(high, half) - np.fmax(low, -half)).clip(0.0) / (2 * half)
        return float((sides[0] * sides[1]).sum())

    def distance(self, which: Index, q: Floats, exactly: bool) -> Enclosure:
        """Exact distances (P,) of objects (P,) at leaf coordinates (2, P), leaf units.

        Args:
            exactly: by the language's formulas, not by learned distances.
        """
        low, high = np.full(len(which), -NOTHING), np.full(len(which), NOTHING)
        finite = np.isfinite(q).all(0)
        for name, own in self._shapes.items():
            some = np.flatnonzero(own[which] & finite)
            if not len(some):
                continue
            p = q[:, some]
            if name in self.unknown:
                length = np.hypot(*p)
                found = Enclosure(length - 1, length + 1)
            elif exactly:
                found = Enclosure(*[leaf_distance(name, p)] * 2)
            else:
                found = self._known[name].exact(p)
            low[some], high[some] = found
        return Enclosure(low, high)

    def colour(self, which: Index, q: Floats, sampled: bool) -> Enclosure:
        """Colours (3, P) of objects at leaf coordinates, or in regions about them, which textures vary in."""
        low, high = self._plain[:, which], self._plain[:, which]
        for at in np.unique(which[self._painted[which]]).tolist():
            some, look = which == at, self._leaves[at].look
            low[:, some], high[:, some] = 0.0, 1.0
            if sampled:
                seen, off = colour_at(look, carry_back(look.texture, q[:, some])).T, self._discoloured[at]
                low[:, some], high[:, some] = np.fmax(seen - off, 0.0), np.fmin(seen + off, 1.0)
        return Enclosure(low, high)
