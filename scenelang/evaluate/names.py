"""Names and where their values live.

Names are resolved while a file is prepared, before it runs. A running file, function or module has one
list of slots; slot 0 of a function's or module's list is the list it was defined in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import field
from typing import Any, Final, Literal

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.records import Record
from scenelang.syntax import nodes

Env = list[Any]

UNBOUND: Final = object()
"""What a slot holds before its ``let``, ``param`` or ``animate`` has run."""


class Needs(Record, frozen=False):
    """What a statement, or the body of a function or module, depends on.

    Args:
        frame: it reads ``t``, ``u`` or ``frame`` itself.
        on: the needs of the names in it.
    """

    frame: bool = False
    on: list[Needs] = field(default_factory=list)

    def varies(self) -> bool:
        """Whether it may differ from frame to frame; ask when everything is prepared."""
        seen, stack = {self}, [self]
        while stack:
            needs = stack.pop()
            if needs.frame:
                return True
            stack += [other for other in needs.on if other not in seen]
            seen.update(needs.on)
        return False


class Slots(Record, frozen=False):
    """The slots of a file, or of one call of a function or module.

    Args:
        parent: those of where it was defined; None for a file.
        root: a file's live slots, which exist while it is prepared; None for a call.
        owner: the name of the function or module that is called.
    """

    parent: Slots | None = None
    root: Env | None = None
    owner: Span | None = None
    size: int = 1

    def add(self) -> int:
        """A new slot."""
        self.size += 1
        if self.root is not None:
            self.root.append(UNBOUND)
        return self.size - 1


class Definition(Record, frozen=False):
    """A fn or module: what calls refer to; ``run`` is set once its body is prepared.

    Args:
        outer: the slots of where it was defined.
        run: of a fn ``run(env) -> value``; of a module its block's actions.
        defaults: how to get each parameter's default.
        size: number of slots of a call.
        weight: evaluation steps of one call.
        needs: what its body depends on besides its arguments.
    """

    node: nodes.Fn | nodes.Module
    outer: Slots
    run: Any = None
    defaults: tuple[Any, ...] = ()
    size: int = 1
    weight: int = 1
    needs: Needs = field(default_factory=Needs)


class Binding(Record, frozen=False):
    """What a name stands for.

    Args:
        span: where; None for the language's own names.
        slots: what holds its slot.
        value: a `Definition`, an imported file, what a Scene calls an element, or the value of a ``let`` that
            never changes.
        known: whether ``value`` is that of such a ``let``.
        needs: what the value of a ``let`` depends on.
    """

    kind: Literal["let", "param", "argument", "loop", "fn", "module", "import", "element", "poison"]
    span: Span | None = None
    slots: Slots | None = None
    slot: int = 0
    value: Any = None
    known: bool = False
    needs: Needs | None = None

    def labels(self, words: str = "defined here") -> tuple[Label, ...]:
        """A label for its definition, if that has a place."""
        return () if self.span is None else (Label(self.span, words),)


class Scope(Record, frozen=False):
    """The names of one block, and the block around it."""

    slots: Slots
    parent: Scope | None = None
    names: dict[str, Binding] = field(default_factory=dict)
    later: dict[str, Span] = field(default_factory=dict)
    """Names that a later line of this block defines."""

    def outwards(self) -> Iterator[Scope]:
        """This block, and those around it."""
        scope: Scope | None = self
        while scope is not None:
            yield scope
            scope = scope.parent

    def find(self, name: str) -> Binding | None:
        """What ``name`` stands for here."""
        return next((scope.names[name] for scope in self.outwards() if name in scope.names), None)

    def visible(self) -> Iterator[tuple[str, Binding]]:
        """All names that can be used here, inner ones first."""
        for scope in self.outwards():
            yield from scope.names.items()

    def reach(self, slots: Slots) -> Callable[[Env], Env]:
        """How to get the live ``slots``, which enclose this scope, from those of here."""
        root = slots.root
        if root is not None:
            return lambda env: root
        hops, at = 0, self.slots
        while at is not slots:
            assert at.parent is not None
            hops, at = hops + 1, at.parent

        def outer(env: Env) -> Env:
            for _ in range(hops):
                env = env[0]
            return env

        return outer
