"""Walking a graph without recursion, so that depth costs memory and never the interpreter's stack."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

from scenelang.graph.nodes import Fold, Graph, Leaf, Link, Node

T = TypeVar("T")


def bottom_up(root: Node, leaf: Callable[[Leaf], T], fold: Callable[[Fold, list[T]], T]) -> T:
    """The value of ``root``: a leaf is worth ``leaf(it)``, a fold ``fold(it, its children's values)``."""
    if isinstance(root, Leaf):
        return leaf(root)
    open_folds: list[tuple[Fold, list[T]]] = [(root, [])]
    while True:
        node, done = open_folds[-1]
        if len(done) < len(node.links):
            child = node.links[len(done)].node
            if isinstance(child, Leaf):
                done.append(leaf(child))
            else:
                open_folds.append((child, []))
            continue
        value = fold(node, done)
        open_folds.pop()
        if not open_folds:
            return value
        open_folds[-1][1].append(value)


def nodes(root: Node) -> Iterator[tuple[Node, int]]:
    """Every node with its depth, parents before children, in file order."""
    stack: list[tuple[Node, int]] = [(root, 0)]
    while stack:
        node, depth = stack.pop()
        yield node, depth
        if isinstance(node, Fold):
            stack.extend([(link.node, depth + 1) for link in reversed(node.links)])


def leaves(root: Node) -> Iterator[Leaf]:
    """Every leaf, in file order."""
    return (node for node, _ in nodes(root) if isinstance(node, Leaf))


def map_leaves(graph: Graph, change: Callable[[Leaf], Leaf], name: str) -> Graph:
    """The graph with ``change`` applied to every leaf.

    Args:
        graph: any graph.
        change: depends on nothing but the leaf and the graph's space; gives the leaf itself where it stays.
        name: of the change, under which leaves that stay from frame to frame note what became of them.
    """

    def leaf(node: Leaf) -> Node:
        return change(node) if node.notes is None else node.noted(name, change)

    def fold(node: Fold, children: list[Node]) -> Fold:
        links = [Link(link.op, child, link.k) for link, child in zip(node.links, children, strict=True)]
        return Fold(node.kind, tuple(links), node.moves, node.span)

    return graph.rooted(fold(graph.root, [bottom_up(link.node, leaf, fold) for link in graph.root.links]))
