"""The boolean rule: a tree of booleans becomes one stream of leaves, or is refused.

The renderer folds from the left, so an operand that is itself composite has to be taken apart:

====================  =========================================================================
``S u (x u y)``       ``S u x u y``, exact everywhere, colours too
``S - (x u y)``       ``S - x - y``, exact everywhere
``S n (x n y)``       ``S n x n y``, exact everywhere; so is ``S n (x - y)`` as ``S n x - y``
``S u (x op y)``      where bounds prove it: ``S u x op y`` or ``x op y u S``, see `scenelang.graph.stream`;
                      the picture stays the same, distances outside do not, so never before a `smooth`
otherwise             refused: ``S - (x n y)``, ``S - (x - y)``, ``S n (x u y)``, ``S smooth (…)``
====================  =========================================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

from scenelang.diagnostics.diagnostic import Label
from scenelang.graph.nodes import BLEND, Fold, Graph, Leaf, Link, Node
from scenelang.graph.space import Space
from scenelang.graph.stream import Stream
from scenelang.passes.context import Context
from scenelang.records import Record
from scenelang.words import Combine


class _Frame(Record, frozen=False):
    """One fold being streamed.

    Args:
        refused: it is only read for its mistakes.
        todo: links still to come, the next one last, each with the operand it was written after.
        smooths: how many of those are `smooth`.
    """

    fold: Fold
    stream: Stream
    refused: bool = False
    todo: list[tuple[Link, Node]] = field(default_factory=list)
    smooths: int = 0

    def put(self, links: Sequence[Link], before: Node) -> None:
        """Put links before all that are still to come; ``before`` is the operand they were written after."""
        self.todo.extend((link, before) for link in reversed(links))
        self.smooths += sum(link.op == "smooth" for link in links)


def linearise(graph: Graph, context: Context) -> Graph:
    """Stream the whole graph as one left fold of leaves.

    Before: COMPOSITE, AT_LEAVES. After: STREAM, with the same picture (samples on an edge aside). What
    cannot be streamed is reported as E0401 to E0404 and left out.
    """
    stack = [_frame(graph.root, graph.space)]
    while True:
        here = stack[-1]
        if here.todo:
            composite = _advance(here, context)
            if composite is not None:
                stack.append(composite)
            continue
        stack.pop()
        if not stack:
            links = tuple(Link(op, leaf, k) for op, leaf, k in here.stream.rows)
            return graph.rooted(Fold("scene", links))
        if not here.refused:
            _attach(stack[-1], here, context)


def _frame(fold: Fold, space: Space, refused: bool = False) -> _Frame:
    frame = _Frame(fold, Stream(space), refused)
    if fold.links:
        frame.put(fold.links, fold.links[0].node)
    return frame


def _advance(here: _Frame, context: Context) -> _Frame | None:
    """Take the next link; returns the frame of a composite that has to be streamed by itself."""
    link, before = here.todo.pop()
    op, node = link.op, link.node
    here.smooths -= op == "smooth"
    if isinstance(node, Leaf):
        here.stream.push(op, node, link.k)
        return None
    if not here.stream.rows:
        here.put(node.links, node.links[0].node)
        return None
    core = _core(op, node)
    tail = node.links[core:]
    here.put(tail if op == "intersect" else [Link(op, after.node) for after in tail], before)
    if core == 1:
        here.put([Link(op, node.links[0].node)], before)
        return None
    rest = node if not tail else Fold(node.kind, node.links[:core], (), node.span)
    refused = op != "union" or here.smooths > 0
    if refused:
        _refuse(op, rest, before, context)
    return _frame(rest, here.stream.space, refused)


def _core(op: Combine, node: Fold) -> int:
    """How many of the first links of a composite operand have to stay together; 1: none."""
    if op == "smooth":
        return len(node.links)
    apart = ("intersect", "subtract") if op == "intersect" else ("union",)
    for at in range(len(node.links) - 1, 0, -1):
        if node.links[at].op not in apart:
            return at + 1
    return 1


def _attach(above: _Frame, done: _Frame, context: Context) -> None:
    """Join a finished composite to the frame above by union, or say why it cannot be."""
    rows = done.stream.rows
    if len(rows) == 1:
        above.stream.push("union", rows[0][1], BLEND)
        return
    if not context.whole:
        above.stream.append(done.stream)
        return
    pair = above.stream.attach(done.stream)
    if pair is None:
        return
    mine, theirs = pair
    labels = []
    if mine.span is not None:
        labels.append(Label(mine.span, "this stands before it in the union"))
    if theirs.span is not None and theirs.span != mine.span:
        labels.append(Label(theirs.span, f"this may reach the `{mine.geometry}`"))
    context.diagnostics.add(
        "E0401",
        f"{_named(done.fold)} in a union, whose bounds meet those of a `{mine.geometry}` before it",
        done.fold.span,
        labels=labels,
        help="only one composite can be streamed and it comes first: put it before the others where it "
        "may be drawn below them, or move them apart",
    )


_REFUSALS: dict[Combine, tuple[str, str, str, str]] = {
    "union": (
        "E0401",
        "in a union that a `smooth` follows",
        "stands before it in the union",
        "put it before the others, or give the `smooth` to a leaf of its own",
    ),
    "subtract": (
        "E0402",
        "as an operand of `subtract`",
        "is subtracted from",
        "only leaves and unions of them can be subtracted",
    ),
    "intersect": (
        "E0403",
        "as an operand of `intersect`",
        "is intersected",
        "only leaves, intersections and differences can be intersected with: put the composite first "
        "where its colours may show",
    ),
    "smooth": (
        "E0404",
        "as an operand of `smooth` that is not the first",
        "is blended",
        "put it first: of two operands `smooth` makes the same picture either way round",
    ),
}
"""Code, where a composite stands, what its left operand does, and advice."""


def _refuse(op: Combine, fold: Fold, before: Node, context: Context) -> None:
    code, where, what, advice = _REFUSALS[op]
    labels = [Label(before.span, f"this {what}")] if before.span is not None else []
    context.diagnostics.add(code, f"{_named(fold)} {where}", fold.span, labels=labels, help=advice)


def _named(fold: Fold) -> str:
    return f"a composite `{fold.kind}` of {len(fold.links)}"
