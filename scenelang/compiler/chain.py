"""Chains of moves: what merges and commutes, the normal form, and the levels of a model's lifting."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from scenelang.assets.records import Record
from scenelang.compiler.graph import Move
from scenelang.compiler.spaces import PLANE, Space
from scenelang.compiler.steps import BARE, IDENTITY, Affine, Rows, Skin, Step, Turn, Twist, Warp, compose

Moves = tuple[Move, ...]


def merged(moves: Iterable[Move]) -> Moves:
    """The same chain with neighbouring affine maps composed into one."""
    out: list[Move] = []
    for move in moves:
        last = out[-1].step if out else None
        if isinstance(move.step, Affine) and isinstance(last, Affine):
            out[-1] = Move(Affine(compose(move.step.rows, last.rows)), out[-1].span)
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
      `scenelang.compiler.spaces`.
    - Steps that do nothing vanish, and neighbouring affine maps compose.
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
        rows = compose(rows, last.rows)
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


class Levels(Record):
    """A chain of steps as a model's lifting takes it.

    A world point goes back through ``affine``, then ``outer`` from its last to its first, ``middle``, and
    ``inner`` likewise, to the leaf with its ``skin``. A lifting has room for turns in slots of three
    strengths: in the plane a warp's twirl and bend; in space its twirl, its bend along x, and the twist
    after it on the way back.
    """

    inner: tuple[Turn, ...] = ()
    middle: Rows = IDENTITY
    outer: tuple[Turn, ...] = ()
    affine: Rows = IDENTITY
    skin: Skin = BARE


class LevelsError(ValueError):
    """Raised where a chain of steps needs more levels than a model's lifting holds."""


def slots(turns: Sequence[Turn], dimension: int) -> list[tuple[float, float, float]]:
    """The strengths of the slots that a run of turns, nearest the leaf first, takes."""
    out: list[tuple[float, float, float]] = []
    for turn in turns:
        if isinstance(turn, Twist):
            out.append((0.0, 0.0, turn.twist))
        elif dimension == 2:
            out.append((turn.twirl, *turn.bend))
        elif out and out[-1][:2] == (0.0, 0.0):
            out[-1] = (turn.twirl, turn.bend[0], out[-1][2])
        else:
            out.append((turn.twirl, turn.bend[0], 0.0))
    return out


def split_levels(steps: Sequence[Step], limits: Mapping[str, int], space: Space = PLANE) -> Levels:
    """Sort a normal chain, nearest the leaf first, into the levels of ``limits``; raises `LevelsError`.

    A single run of turns fills ``inner`` first and then ``outer``, with no middle map between. Turns that
    the normal form brought before the first map go back behind it where ``inner`` has no room.
    """
    most_inner, most_outer = limits.get("inner_warps", 0), limits.get("outer_warps", 0)

    def taken(turns: Sequence[Turn]) -> int:
        return len(slots(turns, space.dimension))

    runs: list[list[Turn]] = [[]]
    maps: list[Rows] = []
    for step in steps:
        if isinstance(step, Turn):
            runs[-1].append(step)
        elif isinstance(step, Affine):
            maps.append(step.rows)
            runs.append([])
        elif maps or runs[0]:
            raise LevelsError(f"a `{type(step).__name__.lower()}` that does not stand first")
    skin = Skin.of(steps)
    # w… | w… A | w… A w… | w… A w… A, where the first run may be empty and the last one is if A is last.
    first = runs[0]
    if len(maps) == 0 or (len(maps) == 1 and not runs[1]):
        if taken(first) > most_inner + most_outer:
            raise LevelsError(f"{len(first)} deformations in a row, at most {most_inner + most_outer} fit")
        inside = next(n for n in range(len(first), -1, -1) if taken(first[:n]) <= most_inner)
        last = maps[0] if maps else IDENTITY
        return Levels(tuple(first[:inside]), IDENTITY, tuple(first[inside:]), last, skin)
    second = runs[1]
    if len(maps) > 2 or (len(maps) == 2 and runs[2]):
        fact = f"{len(maps)} affine maps with deformations between them"
        raise LevelsError(f"{fact}, at most one between and one after fit")
    while taken(first) > most_inner and (turn := space.after(maps[0], first[-1])) is not None:
        second.insert(0, turn)
        first.pop()
    if taken(first) > most_inner:
        raise LevelsError(f"{len(first)} deformations before an affine map, at most {most_inner} fit")
    if taken(second) > most_outer:
        raise LevelsError(f"{len(second)} deformations after an affine map, at most {most_outer} fit")
    return Levels(tuple(first), maps[0], tuple(second), maps[1] if len(maps) == 2 else IDENTITY, skin)
