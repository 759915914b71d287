"""The solid's exact field: points of the world to distance, kind of material, colour and gradient."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.graph.nodes import Fold, Leaf, Node
from scenelang.graph.steps import Step
from scenelang.reference.field import Array, Brought
from scenelang.reference.solid.body import Body

FAR = 1e9  # distance to what is not there
OUT, MEDIUM, OPAQUE = range(3)

_MARGIN = 2e-2
"""Balls are this much larger than what they hold, in world units: more than the least step of a ray."""


@dataclass(frozen=True, slots=True)
class State:
    """What a fold carries: distance (M,), whether the material is a medium, and what else was asked for.

    Args:
        d: distance.
        medium: a bool, or an array (M,).
        near: no nearer than this does the kind of material change inside.
        rgb: linear colour, (3, 1) or (3, M).
        slope: gradient of d, (3, M).
        owner: number of the object whose material holds, from 1.
    """

    d: Any
    medium: Any
    near: Any = None
    rgb: Any = None
    slope: Any = None
    owner: Any = None

    def kind(self) -> npt.NDArray[np.int8]:
        """`OUT`, `MEDIUM` or `OPAQUE`, (M,)."""
        kind = np.where(self.d < 0.0, np.where(self.medium, MEDIUM, OPAQUE), OUT)
        return np.asarray(kind, np.int8)


NOTHING = State(np.float64(FAR), np.False_, np.float64(FAR), np.zeros((3, 1)), np.zeros((3, 1)), 0)


def join(op: str, k: float, a: State, b: State) -> State:
    """One step of the fold; of two operands of equal distance the gradient is the later's."""
    near = None if a.near is None or b.near is None else np.minimum(a.near, b.near)
    paint: Any = None
    side = 1.0
    if op == "union":
        d, paint, turn = np.minimum(a.d, b.d), b.d < np.maximum(a.d, 0.0), b.d <= a.d
    elif op == "smooth":
        h = np.clip(0.5 + 0.5 * (a.d - b.d) / k, 0.0, 1.0)
        d, paint, turn = (1.0 - h) * a.d + h * b.d - k * h * (1.0 - h), h, h
        near = None if near is None else np.minimum(near, abs(a.d - b.d) / 2.0)
    else:
        side = -1.0 if op == "subtract" else 1.0
        cut = side * b.d
        d, turn = np.maximum(a.d, cut), cut >= a.d
        if k:
            h = np.clip(0.5 + 0.5 * (cut - a.d) / k, 0.0, 1.0)
            d, turn = (1.0 - h) * a.d + h * cut + k * h * (1.0 - h), h
    slope = None if a.slope is None or b.slope is None else a.slope + (side * b.slope - a.slope) * turn
    if paint is None:
        return State(d, a.medium, near, a.rgb, slope, a.owner)
    medium = np.where(paint > 0.5, b.medium, a.medium)
    rgb = None if a.rgb is None or b.rgb is None else a.rgb + (b.rgb - a.rgb) * paint
    owner = None if a.owner is None or b.owner is None else np.where(paint > 0.5, b.owner, a.owner)
    return State(d, medium, near, rgb, slope, owner)


class Field:
    """The objects of a graph's root, with every step into the world.

    Folds may nest; the boolean rule is not needed.

    Args:
        brought: shapes of elements.
    """

    def __init__(self, root: Fold, brought: Brought | None = None) -> None:
        self.root = root
        found = list(_leaves(root))
        # A leaf far from a point changes no sign there if it is further than all blends together can reach,
        # and one that is taken away further than anything is deep.
        blends = 1.25 * sum(_blends(root))
        deep = max((Body(leaf, steps, 0.0).deep for leaf, steps, _ in found), default=0.0)
        self.bodies = [
            Body(leaf, steps, _MARGIN + blends + (deep if blends and taken else 0.0), brought)
            for leaf, steps, taken in found
        ]
        kinds = {body.medium for body in self.bodies}
        self.mixed = len(kinds) > 1
        self.media = True in kinds

    def spans(self, o: Array, d: Array) -> Array:
        """`Body.span` of all objects, (3, N, M)."""
        spans = np.empty((3, len(self.bodies), o.shape[1]))
        for index, body in enumerate(self.bodies):
            spans[:, index] = body.span(o, d)
        return spans

    def probe(self, p: Array, met: Array, speed: Array) -> tuple[Array, npt.NDArray[np.int8], Array]:
        """Distance, kind (`OUT`, `MEDIUM`, `OPAQUE`) and how far the kind stays the same, (M,) each.

        Args:
            p: world points (3, M).
            met: (N, M), in which objects' balls they lie; the others count as far away.
            speed: (N, M), as `spans` tells, of the rays on which they lie.
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

        def known() -> State:
            body, row = next(rows)
            return State(row, np.bool_(body.medium), abs(row) if self.mixed else None)

        state = _fold(self.root, known)
        way = abs(state.d)
        if self.mixed:
            way = np.where(state.d < 0.0, np.minimum(way, state.near), way)
        return state.d, state.kind(), np.minimum(way / fastest, most)

    def at(self, p: Array, *, gradient: bool = False) -> State:
        """All that the fold carries at world points (3, M), near left out, the gradient only if asked for."""
        bodies = enumerate(self.bodies, 1)

        def known() -> State:
            number, body = next(bodies)
            slope = body.gradient(p) if gradient else None
            return State(body.distance(p)[0], np.bool_(body.medium), None, body.colour(p), slope, number)

        return _fold(self.root, known)


def _fold(node: Node, known: Callable[[], State]) -> State:
    """The fold of a node; ``known`` is called for each leaf in order."""
    if isinstance(node, Leaf):
        return known()
    if not node.links:
        return NOTHING
    state = _fold(node.links[0].node, known)
    for link in node.links[1:]:
        state = join(link.op, link.width, state, _fold(link.node, known))
    return state


def _leaves(
    node: Node, outer: tuple[Step, ...] = (), taken: bool = False
) -> Iterator[tuple[Leaf, tuple[Step, ...], bool]]:
    """Leaves in order with all their steps, and whether a `subtract` takes them away."""
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        yield node, steps, taken
    else:
        for at, link in enumerate(node.links):
            yield from _leaves(link.node, steps, taken or (at > 0 and link.op == "subtract"))


def _blends(fold: Fold) -> Iterator[float]:
    """Widths of all blends."""
    for at, link in enumerate(fold.links):
        if at and link.width:
            yield link.width
        if isinstance(link.node, Fold):
            yield from _blends(link.node)
