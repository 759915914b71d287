"""Names and where their values live.

Names are resolved while a file is prepared, before it runs. A running file, function or module has one
list of slots; slot 0 of a function's or module's list is the list it was defined in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final, Literal

from scenelang.diagnostics.span import Span
from scenelang.syntax import nodes

Env = list[Any]


class Unbound:
    """What a slot holds before its ``let``, ``param`` or ``animate`` has run."""

    __slots__ = ()


UNBOUND: Final = Unbound()


@dataclass(slots=True, eq=False)
class Needs:
    """What a statement, a function's or a module's body depends on.

    Args:
        frame: it reads ``t``, ``u`` or ``frame`` itself.
        on: the needs of the names in it.
    """

    frame: bool = False
    on: list[Needs] = field(default_factory=list)

    def varies(self) -> bool:
        """Whether it may differ from frame to frame; ask when everything is prepared."""
        seen = {id(self)}
        stack = [self]
        while stack:
            needs = stack.pop()
            if needs.frame:
                return True
            for other in needs.on:
                if id(other) not in seen:
                    seen.add(id(other))
                    stack.append(other)
        return False


@dataclass(slots=True)
class Frame:
    """The slots of a file, or of one call of a function or module.

    Args:
        parent: the frame it was defined in; None for a file.
        root: a file's live slots, which exist while it is prepared; None for a call.
    """

    parent: Frame | None = None
    root: Env | None = None
    size: int = 1

    def slot(self) -> int:
        """A new slot."""
        self.size += 1
        if self.root is not None:
            self.root.append(UNBOUND)
        return self.size - 1


def file_frame() -> Frame:
    """The frame of a file."""
    return Frame(root=[UNBOUND])


@dataclass(slots=True)
class Definition:
    """A fn or module: what calls refer to; ``run`` is set once its body is prepared.

    Args:
        node: its statement.
        frame: where it was defined.
        run: for a fn ``run(env) -> value``; for a module ``run(env, out)``.
        defaults: how to get each parameter's default.
        slots: number of slots of a call.
        weight: evaluation steps of one call.
    """

    node: nodes.Fn | nodes.Module
    frame: Frame
    run: Any = None
    defaults: tuple[Any, ...] = ()
    slots: int = 1
    weight: int = 1
    needs: Needs = field(default_factory=Needs)
    """What its body depends on besides its arguments."""


BindingKind = Literal["let", "param", "argument", "loop", "fn", "module", "import", "constant", "poison"]


@dataclass(slots=True)
class Binding:
    """What a name stands for.

    Args:
        kind: how it came about.
        span: where; None for the language's own names.
        frame: the frame that holds its slot.
        slot: its slot.
        value: a `Definition`, an imported file, or a constant's value.
        known: whether ``value`` is the value of a ``let`` that never changes.
        needs: what the value of a ``let`` depends on.
    """

    kind: BindingKind
    span: Span | None = None
    frame: Frame | None = None
    slot: int = 0
    value: Any = None
    known: bool = False
    needs: Needs | None = None


@dataclass(slots=True, eq=False)
class Scope:
    """The names of one block, and the block around it."""

    frame: Frame
    parent: Scope | None = None
    names: dict[str, Binding] = field(default_factory=dict)
    later: dict[str, Span] = field(default_factory=dict)
    """Names that a later line of this block defines."""

    def find(self, name: str) -> Binding | None:
        """What ``name`` stands for here."""
        scope: Scope | None = self
        while scope is not None:
            found = scope.names.get(name)
            if found is not None:
                return found
            scope = scope.parent
        return None

    def defined_later(self, name: str) -> Span | None:
        """Where a later line of this block, or of one around it, defines ``name``."""
        scope: Scope | None = self
        while scope is not None:
            if name in scope.later:
                return scope.later[name]
            scope = scope.parent
        return None

    def visible(self) -> Iterator[tuple[str, Binding]]:
        """All names that can be used here, inner ones first."""
        scope: Scope | None = self
        while scope is not None:
            yield from scope.names.items()
            scope = scope.parent

    def hops(self, frame: Frame) -> int:
        """How many frames outwards from here ``frame`` is."""
        count, at = 0, self.frame
        while at is not frame:
            count += 1
            if at.parent is None:
                raise LookupError("a frame that does not enclose this scope")
            at = at.parent
        return count
