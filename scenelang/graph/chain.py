"""The algebra of chains of moves: what merges, what commutes, and the normal form that follows from it."""

from __future__ import annotations

from collections.abc import Iterable

from scenelang.graph import affine
from scenelang.graph.nodes import Move
from scenelang.graph.space import Space
from scenelang.graph.steps import IDENTITY, Affine, Rows, Step, Turn, Twist, Warp

Moves = tuple[Move, ...]


def merged(moves: Iterable[Move]) -> Moves:
    """The same chain with neighbouring affine maps composed into one."""
    out: list[Move] = []
    for move in moves:
        last = out[-1].step if out else None
        if isinstance(move.step, Affine) and isinstance(last, Affine):
            out[-1] = Move(Affine(affine.compose(move.step.rows, last.rows)), out[-1].span)
        else:
            out.append(move)
    return tuple(out)


def normal(moves: Iterable[Move], space: Space) -> Moves:
    """The chain with its deformations as near to the leaf, and as few steps, as the three rules allow.

    - A warp without a bend and the warp after it are one warp, because a warp keeps every point's length:
      ``[Warp(t, 0), Warp(u, b)] = [Warp(t + u, b)]``. Two twists are one, because a twist keeps y.
    - A map that only turns, mirrors and scales about a turn's axis trades places with it. In the plane, let
      M be s times an orthogonal matrix. A point q goes back through the warp (t, b) to R(t|q| + b.q) q;
      with q = M u, |q| = s|u| and b.q = (M^T b).u, while M^-1 R(a) M is R(a) for a rotation and R(-a)
      for a reflection. So ``[M, Warp(t, b)] = [Warp(+-s t, +-M^T b), M]``. For space see
      `scenelang.graph.solid`.
    - Steps that do nothing vanish, and neighbouring affine maps compose.

    Args:
        moves: nearest the leaf first.
        space: the model's.
    """
    out: list[Move] = []
    for move in moves:
        if isinstance(move.step, Turn):
            _append_turn(out, move.step, move, space)
        elif isinstance(move.step, Affine):
            _append_affine(out, move.step.rows, move)
        elif not move.step.idle:
            out.append(move)
    return tuple(out)


def _append_affine(out: list[Move], rows: Rows, move: Move) -> None:
    if out and isinstance(last := out[-1].step, Affine):
        move = out.pop()
        rows = affine.compose(rows, last.rows)
    if rows != IDENTITY:
        out.append(Move(Affine(rows), move.span))


def _append_turn(out: list[Move], turn: Turn, move: Move, space: Space) -> None:
    held: Move | None = None
    if out and isinstance(last := out[-1].step, Affine):
        before = space.before(last.rows, turn)
        if before is not None:
            turn = before
            held = out.pop()
    if out and (both := _joined(out[-1].step, turn)) is not None:
        move = out.pop()
        turn = both
    if not turn.idle:
        out.append(Move(turn, move.span))
    if held is not None and isinstance(held.step, Affine):
        _append_affine(out, held.step.rows, held)


def _joined(inner: Step, outer: Turn) -> Turn | None:
    if isinstance(inner, Twist) and isinstance(outer, Twist):
        return Twist(inner.twist + outer.twist)
    if isinstance(inner, Warp) and isinstance(outer, Warp) and inner.bend == (0.0, 0.0):
        return Warp(inner.twirl + outer.twirl, outer.bend)
    return None
