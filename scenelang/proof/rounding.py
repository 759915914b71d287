"""Bounds of what float64 may lose on the way to a leaf.

They are of the chain as written, so that they cover what the passes make of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf, sqrt
from typing import Any, NamedTuple

import numpy as np

from scenelang.graph.affine import compose
from scenelang.graph.looks import Look
from scenelang.graph.nodes import Fold, Leaf, Node
from scenelang.graph.spaces import ALIKE
from scenelang.graph.steps import IDENTITY, Affine, Rows, Step, Warp

TAME = 1e-9  # leaf units: what is allowed for in any case
EPS = 32 * 2.0**-52  # of a number: what one step may lose of it


class Written(NamedTuple):
    """An object as written.

    Args:
        look: before it was folded.
        steps: into the world, nearest the leaf first.
    """

    look: Look
    steps: tuple[Step, ...]

    def misplaced(self, reach: float, far: float) -> float:
        """Leaf units by which points within a reach of the leaf, and ``far`` from the world's, may be off."""
        return TAME + _misplaced(self.steps, min(reach, _seen(self.steps, far)))

    def discoloured(self, reach: float, far: float) -> float:
        """Of a channel, by how much the colours of a texture may be off there."""
        if self.look.element is None:
            return 0.0
        reach = min(reach, _seen(self.steps, far))
        off = _misplaced((*self.look.texture, *self.steps), _seen(self.look.texture, reach))
        off *= max(self.look.element.sizes)
        for kind, *numbers in self.look.colours:
            if kind == "hue":
                off = 6 * (off + EPS * abs(numbers[0]))
            else:  # shares clamp nothing and tear no colours apart
                off *= 1 + 2 * max(0.0, max(numbers) - 1.0, -min(numbers))
        return off


def written(root: Fold) -> dict[int, Written]:
    """All objects of a lowered graph, by number."""
    found: dict[int, Written] = {}
    todo: list[tuple[Node, tuple[Step, ...]]] = [(root, ())]
    while todo:
        node, outer = todo.pop()
        steps = (*[move.step for move in node.moves], *outer)
        if isinstance(node, Leaf):
            found[node.number] = Written(node.look, steps)
        else:
            todo += [(link.node, steps) for link in node.links]
    return found


def _seen(steps: Sequence[Step], far: float) -> float:
    """How long leaf coordinates are at most of points that are no longer than ``far`` in the world."""
    size = np.full(2, far)
    for step in reversed(steps):
        if isinstance(step, Affine):
            _, back, moved = _sizes(step)
            size = back @ (size + moved)
        else:
            size[:] = np.hypot(*size)
    return float(np.hypot(*size))


def _misplaced(steps: Sequence[Step], far: float) -> float:
    """How far float64 may put points, no longer than ``far`` in the leaf, from where they are there.

    Everything is by coordinates, without signs: `size` of points behind the steps so far, `ways` how far they
    move in the leaf as they move there, `forth` the reverse.
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
    """What is lost of a point where a warp moves past a map that counts as similar, None where none does."""
    a, b, _, x, c, d, _, y = rows[:8]
    turned, mirrored = max(abs(a - d), abs(b + c)), max(abs(a + d), abs(b - c))
    off = max(min(turned, mirrored), abs(x), abs(y)) / (sqrt(abs(a * d - b * c)) or 1.0)
    return 4 * off if off < 2 * ALIKE else None


def _sizes(step: Affine) -> tuple[Any, Any, Any]:
    """A map of the plane, its inverse (2, 2) and its shift (2,), without signs."""
    a, b, _, x, c, d, _, y = map(abs, step.rows[:8])
    det = abs(step.rows[0] * step.rows[5] - step.rows[1] * step.rows[4])
    return np.array([[a, b], [c, d]]), np.array([[d, b], [c, a]]) / det, np.array([x, y])
