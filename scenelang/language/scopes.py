"""Scopes within scopes, and the meaning of a name that heads a statement, for all that reads scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final, Literal, Protocol, TypeVar

from scenelang.language import tree
from scenelang.language.words import GEOMETRIES, LANGUAGE, NEWER, SETTINGS

T_co = TypeVar("T_co", covariant=True)
S = TypeVar("S")

VALUES: Final = ("let", "param", "argument", "loop")
"""Kinds of names that stand for values."""


class NameScope(Protocol[T_co]):
    """The names of a block, and the block around it."""

    @property
    def parent(self) -> NameScope[T_co] | None: ...
    @property
    def names(self) -> Mapping[str, T_co]: ...


def outwards(nested: S) -> Iterator[S]:
    """A scope or a call, and those around it."""
    around: Any = nested
    while around is not None:
        yield around
        around = around.parent


def find(scope: NameScope[T_co], name: str) -> T_co | None:
    """The innermost definition of a name that is in sight of a scope."""
    return next((around.names[name] for around in outwards(scope) if name in around.names), None)


def head_of(stmt: tree.Call, own: Any, kind: str) -> Literal["setting", "move", "own", "leaf"]:
    """Meaning of the name that heads a statement in a kind of block, by the rules of hiding.

    A module, or a value without parentheses, hides a word that the first scenes did not have, but for the
    operations of a material. In a module named like a leaf the name without parentheses is the leaf.
    ``own`` is the definition in sight, None for a word of `LANGUAGE`. A ``move`` is a transform or an
    operation, a ``leaf`` any name that is not defined.
    """
    name, bare, what = stmt.name.text, stmt.args is None, own.kind if own is not None else ""
    hidden = what in ("module", "poison") or (bare and what in VALUES)
    if name in SETTINGS and not hidden:
        return "setting"
    moves = name in LANGUAGE or (name in NEWER and name not in SETTINGS)
    if moves and (kind == "material" or not hidden):
        return "move"
    inside = bare and what == "module" and own.node.span.start <= stmt.span.start < own.node.span.end
    return "leaf" if own is None or (inside and name in GEOMETRIES) else "own"
