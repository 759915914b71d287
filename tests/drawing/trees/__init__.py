"""Trees of booleans over solids: random ones, their streams and graphs, and a slow fold in float64."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from scenelang.compiler.graph import Fold, Node
from scenelang.compiler.groups import BEGINS, ENDS
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.network import SolidNetwork
from scenelang.language.words import BLEND, COMBINE, TOKENS, Combine
from tests.drawing.solids import (
    LAYOUT,
    LEAVES,
    MATERIALS,
    Object,
    leaf,
    link,
    moved,
    network,
    scaled,
    turned,
    vector,
)


class Join(NamedTuple):
    """An operand of a tree with the operator and width by which it joins those before it."""

    op: Combine
    node: Tree | Object
    k: float = 0.0


class Tree(tuple[Join, ...]):
    """Operands from the left."""


class Row(NamedTuple):
    """An object of a stream."""

    o: Object
    op: Combine
    k: float
    begins: bool = False
    ends: int = 0

    @property
    def token(self) -> int:
        return TOKENS[self.op] | BEGINS * self.begins | self.ends << ENDS


def rows(node: Tree | Object) -> list[Row]:
    """The stream of a tree: operands that are trees are groups, but for the first, which goes on."""
    if isinstance(node, Object):
        return [Row(node, "union", 0.0)]
    found = rows(node[0].node)
    for op, operand, k in node[1:]:
        more = rows(operand)
        more[0] = more[0]._replace(op=op, k=k)
        if isinstance(operand, Tree):
            more[0], last = more[0]._replace(begins=True), more[-1]
            more[-1] = more[-1]._replace(ends=last.ends + 1)
        found += more
    return found


def tree_field(tree: Tree | Sequence[Row], net: SolidNetwork | None = None) -> SolidField:
    """The field of a tree, or of its rows."""
    net, stream = net or network(), rows(tree) if isinstance(tree, Tree) else tree
    vectors = np.array([vector(row.o._replace(k=0.0), net) for row in stream])
    vectors[:, LAYOUT.places.width] = [row.k for row in stream]
    return SolidField(net, vectors, np.array([row.token for row in stream], np.int8))


def tree_graph(node: Tree | Object) -> Node:
    """The same as a graph, for the reference."""
    if isinstance(node, Object):
        return leaf(node)
    return Fold("scene", tuple(link(join.op, join.k, tree_graph(join.node)) for join in node))


class Answer(NamedTuple):
    """Distance (M,), whether the material is a medium (M,), colour (3, M) and gradient (3, M)."""

    d: np.ndarray
    medium: np.ndarray
    rgb: np.ndarray
    slope: np.ndarray


def fold(node: Tree | Object, known: Callable[[Object], Answer]) -> Answer:
    """What a tree comes to, from the language's formulas."""
    if isinstance(node, Object):
        return known(node)
    state = fold(node[0].node, known)
    for op, operand, k in node[1:]:
        state = joined(op, k, state, fold(operand, known))
    return state


def joined(op: Combine, k: float, a: Answer, b: Answer) -> Answer:
    """One step."""
    if op == "union":
        paint, later = b.d < np.maximum(a.d, 0), b.d < a.d
        d, slope = np.minimum(a.d, b.d), np.where(later, b.slope, a.slope)
    elif op == "smooth":
        k = k or BLEND
        paint = h = np.clip(0.5 + 0.5 * (a.d - b.d) / k, 0, 1)
        d, slope = a.d + (b.d - a.d) * h - k * h * (1 - h), a.slope + h * (b.slope - a.slope)
    else:
        side = -1.0 if op == "subtract" else 1.0
        paint, e, edge = 0.0 * a.d, side * b.d, side * b.slope
        h = np.clip(0.5 - 0.5 * (e - a.d) / k, 0, 1) if k else 1.0 * (a.d > e)
        d, slope = h * a.d + (1 - h) * e + k * h * (1 - h), edge + h * (a.slope - edge)
    medium = np.where(paint > 0.5, b.medium, a.medium)
    return Answer(d, medium, a.rgb + paint * (b.rgb - a.rgb), slope)


def random_tree(rng: np.random.Generator, depth: int, media: float = 0.0) -> Tree:
    """Up to so deep; operators are equally likely, and a third of all cuts have rounded edges."""

    def node(left: int) -> Tree | Object:
        if left == 0 or (left < depth and rng.random() < 0.4):
            steps = (
                scaled(*rng.uniform(0.35, 0.75, 3)),
                turned(rng.uniform(0, 6)),
                moved(*rng.uniform(-0.5, 0.5, 3)),
            )
            kind = MATERIALS[int(rng.random() < media)]
            return Object(str(rng.choice(LEAVES)), steps, kind, tuple(rng.uniform(0.1, 0.9, 3).tolist()))
        joins = []
        for at in range(int(rng.integers(2, 4))):
            op: Combine = "union" if at == 0 else COMBINE[rng.integers(4)]
            wide = op != "union" and rng.random() < 1 / 3
            joins.append(Join(op, node(left - 1), float(np.float32(rng.uniform(0.05, 0.5))) if wide else 0.0))
        return Tree(joins)

    found = node(depth)
    assert isinstance(found, Tree)
    return found
