"""What must hold of a graph between two passes. A broken invariant is a bug of the compiler."""

from __future__ import annotations

from collections.abc import Collection
from enum import Enum

from scenelang.graph.nodes import MOST_OPEN, Fold, Graph, Leaf, Move
from scenelang.graph.space import Space
from scenelang.graph.steps import Affine


class Invariant(Enum):
    """A property that a pass establishes and every later one keeps."""

    NO_IDENTITIES = "no move leaves every point where it is"
    COMPOSITE = "every fold below the root has at least two links"
    LOOKS = "the look of a constant material is one colour"
    MERGED = "no two affine maps are neighbours"
    AT_LEAVES = "no fold has moves"
    STREAM = "folds within folds are groups: none is a first link, and few lie within each other"


Checked = tuple[Space, bool, bool, bool]
"""What must hold of each leaf: its maps are the space's; NO_IDENTITIES, MERGED and LOOKS or not."""

Sound = dict[Checked, dict[int, Leaf]]  # leaves by identity, by what was checked of them


class InternalError(RuntimeError):
    """A bug of the compiler, not of the scene."""


def verify(graph: Graph, stage: str, holds: Collection[Invariant] = (), sound: Sound | None = None) -> Graph:
    """Check a graph after ``stage``, the name of a pass or ``lower``, and give it back.

    Args:
        holds: what this stage and those before it established.
        sound: leaves that an earlier stage left sound and this one may have kept; takes those of this graph.

    Raises:
        InternalError: an invariant is broken.
    """
    fault = _fault(graph, frozenset(holds), {} if sound is None else sound)
    if fault is not None:
        raise InternalError(f"internal error after pass `{stage}`: it does not hold that {fault}")
    return graph


def _fault(graph: Graph, holds: frozenset[Invariant], sound: Sound) -> str | None:
    if graph.root.kind != "scene" or graph.root.moves:
        return "the root is a scene without moves"
    of_leaves = (i in holds for i in (Invariant.NO_IDENTITIES, Invariant.MERGED, Invariant.LOOKS))
    checked: Checked = (graph.space, *of_leaves)  # type: ignore[assignment]
    if checked not in sound:
        sound.clear()
    leaves = sound.setdefault(checked, {})
    folds = [(graph.root, 0)]
    while folds:
        fold, depth = folds.pop()
        fault = _fold_fault(fold, depth, holds) or _moves_fault(fold.moves, checked)
        if fault is not None:
            return fault
        for link in fold.links:
            node = link.node
            if isinstance(node, Fold):
                folds.append((node, depth + 1))
            elif leaves.get(id(node)) is not node:
                leaves[id(node)] = node
                fault = node.noted(checked, lambda leaf: _leaf_fault(leaf, checked))
                if fault is not None:
                    return fault
    return None


def _fold_fault(fold: Fold, depth: int, holds: frozenset[Invariant]) -> str | None:
    if fold.links and fold.links[0].op != "union":
        return "the first link of a fold is a union"
    if fold.moves and Invariant.AT_LEAVES in holds:
        return Invariant.AT_LEAVES.value
    if Invariant.STREAM in holds and (
        depth > MOST_OPEN or (fold.links and isinstance(fold.links[0].node, Fold))
    ):
        return Invariant.STREAM.value
    if depth and Invariant.COMPOSITE in holds and len(fold.links) < 2:
        return Invariant.COMPOSITE.value
    return None


def _leaf_fault(leaf: Leaf, checked: Checked) -> str | None:
    r, g, b = leaf.look.rgb
    if not (0.0 <= r <= 1.0 and 0.0 <= g <= 1.0 and 0.0 <= b <= 1.0):
        return "colours lie in [0, 1]"
    if checked[3] and leaf.look.folded() is not leaf.look:
        return Invariant.LOOKS.value
    return _moves_fault(leaf.moves, checked)


def _moves_fault(moves: tuple[Move, ...], checked: Checked) -> str | None:
    space, tidy, merged, _ = checked
    after_map = False
    for move in moves:
        step = move.step
        if tidy and step.idle:
            return Invariant.NO_IDENTITIES.value
        if isinstance(step, Affine):
            if not space.holds(step.rows):
                return "a map stays within the space of its model"
            if merged and after_map:
                return Invariant.MERGED.value
            after_map = True
        else:
            after_map = False
    return None
