"""The Graph: leaves and folds, each with the moves that carry it into its parent's space.

A leaf is one object. A fold is a boolean node, a group or a chain: its links are joined from the left,
``(first op second) op third …``. Moves are nearest the leaf first. Everything is frozen; a pass builds a
new graph. Walks are without recursion, so that depth costs memory and never the interpreter's stack.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import field
from math import inf
from operator import attrgetter
from typing import Any, NamedTuple, TypeVar, cast

from scenelang.diagnostics.span import Span
from scenelang.elements.element import Element
from scenelang.graph.looks import Look
from scenelang.graph.space import Box, Space
from scenelang.graph.stage import Stage
from scenelang.graph.steps import Step
from scenelang.records import Record
from scenelang.words import BLEND, Combine

MOST_OPEN = 15  # groups of a stream within each other: a token has four bits for how many end
BELOW = 1e-3  # world units below the ground that count as seen: more than a renderer's step behind a surface
T = TypeVar("T")


class Move(Record):
    """A step and where it was written; a step that merges several keeps the place of the first."""

    step: Step
    span: Span | None = None


class Leaf(Record):
    """One object: a leaf geometry of a model, its look and its moves.

    Args:
        moves: steps into the parent's space, nearest the leaf first.
        number: of the object in the scene as written, from 1; not part of the value.
        notes: what was worked out about a leaf that stays from frame to frame of an animation, by what it
            is; None for a leaf that is used once. It is not part of the value.
    """

    geometry: str
    look: Look
    moves: tuple[Move, ...] = ()
    span: Span | None = None
    number: int = 0
    notes: dict[Any, Any] | None = None

    _key = attrgetter("geometry", "look", "moves", "span")

    def changed(self, look: Look, moves: tuple[Move, ...]) -> Leaf:
        """The same object with another look or other moves."""
        return Leaf(self.geometry, look, moves, self.span, self.number, None if self.notes is None else {})

    def noted(self, key: object, make: Callable[[Leaf], T]) -> T:
        """What ``make`` gives for this leaf, noted under ``key`` where the leaf takes notes."""
        if self.notes is None:
            return make(self)
        if key not in self.notes:
            self.notes[key] = make(self)
        return cast("T", self.notes[key])

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps of its moves."""
        return tuple([move.step for move in self.moves])


class Link(Record):
    """A child of a fold with the operator that joins it to what came before; the first is a union.

    ``k`` is the width of its blend as it was written, in world units, 0 where none was.
    """

    op: Combine
    node: Node
    k: float = 0.0

    @property
    def width(self) -> float:
        """The width of the blend: of a `smooth` `BLEND` unless written; 0 for a sharp edge."""
        return self.k or (BLEND if self.op == "smooth" else 0.0)


class Fold(Record):
    """Children folded from the left. Without links it is the empty set: distance +infinity.

    Args:
        kind: the word it was written with: ``scene``, ``group``, ``chain`` or a boolean.
        moves: steps that apply to all children, nearest the leaf first.
    """

    kind: str
    links: tuple[Link, ...]
    moves: tuple[Move, ...] = ()
    span: Span | None = None


Node = Leaf | Fold


class Row(NamedTuple):
    """A leaf of a stream.

    Args:
        op: joins it to what stands before it in its group; of the first leaf of a group it joins that.
        k: the width of that as written, 0 where none was.
        begins: whether it is the first leaf of a group.
        ends: how many groups end behind it.
        cuts: whether something takes it away, or a group around it.
    """

    op: Combine
    leaf: Leaf
    k: float
    begins: bool
    ends: int
    cuts: bool


class Graph(Record):
    """A whole scene as a graph for one model.

    Args:
        root: the top level, a fold of kind ``scene``; after `flatten` folds within it are groups of a stream.
        background: colour in [0, 1] as written, or None for transparency.
        stage: of a scene of solids, None in the plane.
        elements: geometries that users brought, by name.
    """

    root: Fold
    canvas: tuple[int, int]
    background: tuple[float, float, float] | None
    space: Space
    stage: Stage | None = None
    elements: dict[str, Element] = field(default_factory=dict)

    def rooted(self, root: Fold) -> Graph:
        """The same scene with another root."""
        return Graph(root, self.canvas, self.background, self.space, self.stage, self.elements)

    def rows(self) -> list[Row]:
        """The leaves in order; folds among the links of folds are groups, whose first link is a leaf."""
        found: list[Row] = []
        open_folds = [(iter(self.root.links), False)]
        first: Link | None = None  # of a group, before its first leaf
        while open_folds:
            links, cut = open_folds[-1]
            link = next(links, None)
            if link is None:
                open_folds.pop()
                if open_folds:
                    found[-1] = found[-1]._replace(ends=found[-1].ends + 1)
                continue
            cuts = cut or link.op == "subtract"
            if isinstance(link.node, Fold):
                first = link
                open_folds.append((iter(link.node.links), cuts))
                continue
            op, k = (link.op, link.k) if first is None else (first.op, first.k)
            found.append(Row(op, link.node, k, first is not None, 0, cuts))
            first = None
        return found

    def window(self) -> Box:
        """The part of the world that decides the picture.

        In the plane it is what the canvas shows. In space nothing below the ground is seen from above it,
        nor stands before a light above it; all else may at least throw a shadow on what is seen.
        """
        if (stage := self.stage) is not None:
            floor = -inf if stage.ground is None else stage.ground.y
            seen = stage.camera.eye[1] > floor and stage.light.position[1] > floor
            return (-inf, floor - BELOW if seen else -inf, inf, inf, -inf, inf)
        width, height = self.canvas
        side = min(width, height)
        return -width / side, -height / side, width / side, height / side, 0.0, 0.0


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


def nodes(root: Node) -> Iterator[Node]:
    """Every node, parents before children, in file order."""
    stack: list[Node] = [root]
    while stack:
        node = stack.pop()
        yield node
        if isinstance(node, Fold):
            stack.extend([link.node for link in reversed(node.links)])


def leaves(root: Node) -> Iterator[Leaf]:
    """Every leaf, in file order."""
    return (node for node in nodes(root) if isinstance(node, Leaf))


def links_within(fold: Fold) -> Iterator[Link]:
    """Every link of a fold and of those within it."""
    return (link for node in nodes(fold) if isinstance(node, Fold) for link in node.links)


def map_leaves(graph: Graph, change: Callable[[Leaf], Leaf], name: str) -> Graph:
    """The graph with ``change`` applied to every leaf.

    Args:
        change: depends on nothing but the leaf and the graph's space; gives the leaf itself where it stays.
        name: of the change, under which leaves that stay from frame to frame note what became of them.
    """

    def leaf(node: Leaf) -> Node:
        return change(node) if node.notes is None else node.noted(name, change)

    def fold(node: Fold, children: list[Node]) -> Fold:
        links = [Link(link.op, child, link.k) for link, child in zip(node.links, children, strict=True)]
        return Fold(node.kind, tuple(links), node.moves, node.span)

    return graph.rooted(fold(graph.root, [bottom_up(link.node, leaf, fold) for link in graph.root.links]))
