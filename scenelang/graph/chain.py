"""The algebra of chains of moves: what merges, what commutes, the normal form that follows from it, and the
levels of a model's exact lifting that a chain is sorted into.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from scenelang.graph import affine
from scenelang.graph.nodes import Move
from scenelang.graph.space import Space
from scenelang.graph.steps import IDENTITY, Affine, Rows, Step, Warp
from scenelang.records import Record

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
      ``[Warp(t, 0), Warp(u, b)] = [Warp(t + u, b)]``.
    - In the plane, a similarity about the origin trades places with the warp after it. Let
      M be s times an orthogonal matrix. A point q goes back through the warp (t, b) to R(t|q| + b.q) q;
      with q = M u, |q| = s|u| and b.q = (M^T b).u, while M^-1 R(a) M is R(a) for a rotation and R(-a)
      for a reflection. So ``[M, Warp(t, b)] = [Warp(+-s t, +-M^T b), M]``.
    - Steps that do nothing vanish, and neighbouring affine maps compose.
    """
    out: list[Move] = []
    for move in moves:
        if isinstance(move.step, Warp):
            _append_warp(out, move.step, move, space)
        else:
            _append_affine(out, move.step.rows, move)
    return tuple(out)


def _append_affine(out: list[Move], rows: Rows, move: Move) -> None:
    if out and isinstance(last := out[-1].step, Affine):
        move = out.pop()
        rows = affine.compose(rows, last.rows)
    if rows != IDENTITY:
        out.append(Move(Affine(rows), move.span))


def _append_warp(out: list[Move], warp: Warp, move: Move, space: Space) -> None:
    held: Move | None = None
    if out and isinstance(last := out[-1].step, Affine):
        before = space.before(last.rows, warp)
        if before is not None:
            warp = before
            held = out.pop()
    if out and isinstance(inner := out[-1].step, Warp) and inner.bend == (0.0, 0.0):
        move = out.pop()
        warp = Warp(inner.twirl + warp.twirl, warp.bend)
    if not warp.idle:
        out.append(Move(warp, move.span))
    if held is not None and isinstance(held.step, Affine):
        _append_affine(out, held.step.rows, held)


class Levels(Record):
    """A chain of steps as a model's lifting takes it.

    A world point goes back through ``affine``, then ``outer`` from its last to its first, then ``middle``,
    then ``inner`` from its last to its first.

    Args:
        inner: warps next to the leaf, nearest the leaf first.
        middle: the affine map between the two groups of warps; `IDENTITY` where there is none.
        outer: warps after ``middle``, nearest the leaf first.
        affine: the last map, into the world; `IDENTITY` where there is none.
    """

    inner: tuple[Warp, ...] = ()
    middle: Rows = IDENTITY
    outer: tuple[Warp, ...] = ()
    affine: Rows = IDENTITY


class LevelsError(ValueError):
    """Raised where a chain of steps needs more levels than a model's lifting holds."""


def split_levels(steps: Sequence[Step], limits: Mapping[str, int]) -> Levels:
    """Sort a chain into the levels of a lifting.

    A single run of warps fills ``inner`` first and then ``outer``, with no middle map between.

    Args:
        steps: nearest the leaf first, normalised (no two affine maps are neighbours; see `fold_warps`).
        limits: a manifest's ``limits``; reads ``inner_warps`` and ``outer_warps``.

    Raises:
        LevelsError: the chain does not fit.
    """
    most_inner, most_outer = limits.get("inner_warps", 0), limits.get("outer_warps", 0)
    runs: list[list[Warp]] = [[]]
    maps: list[Rows] = []
    for step in steps:
        if isinstance(step, Warp):
            runs[-1].append(step)
        else:
            maps.append(step.rows)
            runs.append([])
    # w… | w… A | w… A w… | w… A w… A, where the first run may be empty and the last one is if A is last.
    first = runs[0]
    if len(maps) == 0 or (len(maps) == 1 and not runs[1]):
        if len(first) > most_inner + most_outer:
            raise LevelsError(f"{len(first)} deformations in a row, at most {most_inner + most_outer} fit")
        last = maps[0] if maps else IDENTITY
        return Levels(tuple(first[:most_inner]), IDENTITY, tuple(first[most_inner:]), last)
    second = runs[1]
    if len(maps) > 2 or (len(maps) == 2 and runs[2]):
        raise LevelsError(
            f"{len(maps)} affine maps with deformations between them, at most one between and one after fit"
        )
    if len(first) > most_inner:
        raise LevelsError(f"{len(first)} deformations before an affine map, at most {most_inner} fit")
    if len(second) > most_outer:
        raise LevelsError(f"{len(second)} deformations after an affine map, at most {most_outer} fit")
    return Levels(tuple(first), maps[0], tuple(second), maps[1] if len(maps) == 2 else IDENTITY)
