"""Each object's chain must fit the model's lifting and have an inverse."""

from __future__ import annotations

from functools import partial
from math import hypot

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.graph import affine
from scenelang.graph.levels import LevelsError, split_levels
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.space import REACH, Space
from scenelang.graph.steps import Affine, Step, Twist, Warp
from scenelang.graph.walk import leaves
from scenelang.passes.context import Context


def check_levels(graph: Graph, context: Context) -> Graph:
    """Report objects whose deformations or affine maps the model cannot hold; the graph is unchanged.

    Before: the normal form of `fold_warps`.
    """
    check = partial(_check, space=graph.space, context=context)
    for leaf in leaves(graph.root):
        leaf.noted("check_levels", check)
    return graph


def _check(leaf: Leaf, space: Space, context: Context) -> None:
    manifest = context.manifest
    if manifest.lifting == "exact" and any(not isinstance(move.step, Affine) for move in leaf.moves):
        try:  # other liftings take any chain
            split_levels(leaf.steps, manifest.limits, space)
        except LevelsError as error:
            inner, outer = manifest.limits.get("inner_warps", 0), manifest.limits.get("outer_warps", 0)
            fact = f"the deformations of `{leaf.geometry}` do not fit model `{manifest.name}`: {error}"
            help = (
                f"the model holds up to {inner} deformations, an affine map, up to {outer} deformations "
                "and an affine map; a `twirl` merges with the deformation after it, also across rotations "
                "and uniform scales about the origin"
            )
            context.diagnostics.add("E0506", fact, leaf.span, labels=_places(leaf), help=help)
            return
    # Each map is lifted by itself, so each needs an inverse, and so does what they compose to.
    maps = [move.step.rows for move in leaf.moves if isinstance(move.step, Affine)]
    maps += [affine.composed(leaf.steps)] if len(maps) > 1 else []
    bad = next((rows for rows in maps if not space.usable(rows)), None)
    if bad is not None:
        smallest, largest = space.stretches(bad)
        fact = f"the transforms of `{leaf.geometry}` compose to a singular one, which stretches by "
        fact, help = f"{fact}{smallest:.3g} to {largest:.3g}", "scale less along one direction, or less often"
    elif not all(_mild(move.step) for move in leaf.moves):
        fact, help = f"the deformations of `{leaf.geometry}` compose to one beyond float32", "deform less"
    else:
        return
    context.diagnostics.add("E0406", fact, leaf.span, labels=_places(leaf), help=help)


def _mild(step: Step) -> bool:
    if isinstance(step, Warp):
        return abs(step.twirl) < REACH and hypot(*step.bend) < REACH
    if isinstance(step, Twist):
        return abs(step.twist) < REACH
    return isinstance(step, Affine) or max(abs(step.amount), abs(step.frequency)) < REACH


def _places(leaf: Leaf) -> list[Label]:
    found: list[Label] = []
    seen: set[Span] = {leaf.span} if leaf.span else set()
    for move in leaf.moves:
        if move.span is not None and move.span not in seen:
            seen.add(move.span)
            what = "affine from here on" if isinstance(move.step, Affine) else "deforms here"
            found.append(Label(move.span, what))
    return found[:8]
