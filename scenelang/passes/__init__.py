"""Graph to Graph: `PASSES` is the order, and the only place that says it.

Sharing equal subgraphs is left out on purpose: every row of a stream is lifted in one vectorised call,
which costs less than finding the equal ones would.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import NamedTuple

from scenelang.deep import deep_stack
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.lower import Memory, Spans, lower
from scenelang.graph.nodes import Graph
from scenelang.graph.verify import Invariant, Sound, verify
from scenelang.models.manifest import Manifest
from scenelang.passes.check_eye import check_eye
from scenelang.passes.check_seen import check_seen
from scenelang.passes.checks import check_levels, check_trained
from scenelang.passes.context import Context
from scenelang.passes.drop import drop_empty, drop_hidden, drop_unseen
from scenelang.passes.flatten import flatten
from scenelang.passes.leaves import fold_looks, fold_warps, push_transforms
from scenelang.scene.schema import Scene


class Pass(NamedTuple):
    """A step of the compiler and the invariants that hold after it, and ever after."""

    run: Callable[[Graph, Context], Graph]
    establishes: frozenset[Invariant] = frozenset()

    @property
    def name(self) -> str:
        """The name of its function and of its tests."""
        return self.run.__name__


PASSES: tuple[Pass, ...] = (
    Pass(drop_empty, frozenset({Invariant.COMPOSITE})),
    Pass(fold_looks, frozenset({Invariant.LOOKS})),
    Pass(push_transforms, frozenset({Invariant.AT_LEAVES, Invariant.MERGED})),
    Pass(fold_warps, frozenset({Invariant.NO_IDENTITIES})),
    Pass(check_levels),
    Pass(flatten, frozenset({Invariant.STREAM})),
    Pass(check_eye),
    Pass(check_seen),
    Pass(drop_unseen),
    Pass(drop_hidden),
    Pass(check_trained),
)


OPTIONAL = frozenset({"drop_unseen", "drop_hidden"})
"""Passes that only save work: no later stage needs what they do."""


def check_scene(
    scene: Scene,
    spans: Spans | None,
    diagnostics: Diagnostics,
    manifest: Manifest,
    after: Callable[[str, Graph], None] | None = None,
    without: Collection[str] = (),
    memory: Memory | None = None,
) -> Graph:
    """Everything that can be said of a scene before it is lifted: lower it and run all passes in order.

    The graph is verified after each. No numpy is imported.

    Args:
        spans: where its nodes were written, None if it did not come from text.
        after: called with ``"lower"`` and each pass's name and the graph it left.
        without: names of `OPTIONAL` passes to leave out.
        memory: as for `lower`.

    Returns:
        The stream; it stands for the scene only if no error was reported.

    Raises:
        ValueError: a pass that others need is to be left out.
    """
    if not OPTIONAL.issuperset(without):
        raise ValueError(f"passes that cannot be left out: {', '.join(sorted(set(without) - OPTIONAL))}")
    after = after or (lambda name, graph: None)
    before, holds, sound = len(diagnostics.errors), frozenset[Invariant](), Sound()
    with deep_stack():
        graph = verify(lower(scene, manifest, spans, diagnostics, memory), "lower", sound=sound)
        whole, moves = len(diagnostics.errors) == before, scene.animation is not None
        context = Context(manifest, diagnostics, whole, moves)
        after("lower", graph)
        for step in PASSES:
            if step.name in without:
                continue
            given, graph = graph, step.run(graph, context)
            if graph is not given or step.establishes:
                holds |= step.establishes
                verify(graph, step.name, holds, sound)
            after(step.name, graph)
            if diagnostics.errors:
                if step.run is flatten:
                    break  # every mistake is found, and what is left is not the scene
                # Without sound chains no bound means anything: look for refusals only.
                context = Context(manifest, diagnostics, whole=False)
    return graph
