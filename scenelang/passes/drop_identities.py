"""Moves that leave every point where it is vanish."""

from __future__ import annotations

from scenelang.graph.chain import Moves, is_identity
from scenelang.graph.nodes import Graph
from scenelang.graph.walk import map_moves
from scenelang.passes.context import Context


def drop_identities(graph: Graph, context: Context) -> Graph:
    """Drop identity maps and warps of zero angle, exactly those; no float changes.

    Maps that only compose to the identity are left to `fold_warps`.
    """
    return map_moves(graph, _kept, "drop_identities")


def _kept(moves: Moves) -> Moves:
    return tuple(move for move in moves if not is_identity(move))
