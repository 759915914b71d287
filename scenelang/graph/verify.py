"""What must hold of a graph between two passes. A broken invariant is a bug of the compiler."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum

from scenelang.graph.nodes import Fold, Graph, Leaf, Move
from scenelang.graph.space import Space
from scenelang.graph.steps import Affine


class Invariant(Enum):
    """A property that a pass establishes and every later one keeps."""

    NO_IDENTITIES = "no move leaves every point where it is"
    COMPOSITE = "every fold below the root has at least two links"
    LOOKS = "the look of a constant material is one colour"
    MERGED = "no two affine maps are neighbours"
    AT_LEAVES = "no fold has moves"
    STREAM = "every child of the root is a leaf"


Sound = dict["_Check", dict[int, Leaf]]


class InternalError(RuntimeError):
    """A bug of the compiler, not of the scene."""


def verify(graph: Graph, stage: str, holds: Collection[Invariant] = (), sound: Sound | None = None) -> Graph:
    """Check a graph after ``stage``, the name of a pass or ``lower``.

    Args:
        graph: any graph.
        stage: whom to name.
        holds: what this stage and those before it established.
        sound: leaves that an earlier stage left sound and this one may have kept; takes those of this graph.

    Returns:
        The graph itself.

    Raises:
        InternalError: an invariant is broken.
    """
    fault = None
    if graph.root.kind != "scene" or graph.root.moves:
        fault = "the root is a scene without moves"
    check = _Check(
        graph.space,
        Invariant.NO_IDENTITIES in holds,
        Invariant.MERGED in holds,
        Invariant.LOOKS in holds,
    )
    sound = {} if sound is None else sound
    if check not in sound:
        sound.clear()
    leaves = sound.setdefault(check, {})
    folds = [graph.root]
    while folds and fault is None:
        fold = folds.pop()
        fault = _fold_fault(fold, fold is graph.root, holds) or check.moves_fault(fold.moves)
        for link in fold.links:
            node = link.node
            if isinstance(node, Fold):
                folds.append(node)
                continue
            if node.notes is not None:  # a leaf of a frame before, checked then
                if check in node.notes:
                    continue
                node.notes[check] = True
            elif leaves.get(id(node)) is node:
                continue
            else:
                leaves[id(node)] = node
            r, g, b = node.look.rgb
            if not (0.0 <= r <= 1.0 and 0.0 <= g <= 1.0 and 0.0 <= b <= 1.0):
                fault = "colours lie in [0, 1]"
            elif check.folded and node.look.folded() is not node.look:
                fault = Invariant.LOOKS.value
            elif node.moves:
                fault = fault or check.moves_fault(node.moves)
    if fault is not None:
        raise InternalError(f"internal error after pass `{stage}`: it does not hold that {fault}")
    return graph


def _fold_fault(fold: Fold, root: bool, holds: Collection[Invariant]) -> str | None:
    if fold.links and fold.links[0].op != "union":
        return "the first link of a fold is a union"
    if fold.moves and Invariant.AT_LEAVES in holds:
        return Invariant.AT_LEAVES.value
    if root:
        return None
    if Invariant.STREAM in holds:
        return Invariant.STREAM.value
    if Invariant.COMPOSITE in holds and len(fold.links) < 2:
        return Invariant.COMPOSITE.value
    return None


@dataclass(frozen=True, slots=True)
class _Check:
    """What must hold of each leaf: maps of the space, no identities, no neighbouring maps, a folded look."""

    space: Space
    tidy: bool
    merged: bool
    folded: bool

    def moves_fault(self, moves: tuple[Move, ...]) -> str | None:
        after_map = False
        for move in moves:
            step = move.step
            if isinstance(step, Affine):
                if not self.space.holds(step.rows):
                    return "a map stays within the space of its model"
                if self.merged and after_map:
                    return Invariant.MERGED.value
            after_map = isinstance(step, Affine)
            if self.tidy and step.idle:
                return Invariant.NO_IDENTITIES.value
        return None
