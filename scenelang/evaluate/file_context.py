"""One file while it is prepared and run, and where a statement stands in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple

from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.loader import Loader
from scenelang.evaluate.names import UNBOUND, Env, Scope, Slots
from scenelang.evaluate.report.reporter import Reporter
from scenelang.evaluate.session import Defines, Session
from scenelang.syntax import nodes

Kind = Literal["file", "group", "chain", "object", "material", "unknown"]
"""What a block may hold. ``unknown`` is the block of something misspelt: nothing is out of place there."""

Action = Callable[[Env, Builder], None]


@dataclass(slots=True)
class FileContext:
    """The state of one file.

    Args:
        path: where it was read from, resolved; None for text without a file.
        prefix: how the first file calls its params: empty, or ``lib.``.
        weight: half evaluation steps of what has been prepared of the block at hand.
        materials: what a Scene calls those of a file of elements.
        has_params: whether it, or a file that it imports, has params.
    """

    source: SourceFile
    session: Session
    loader: Loader
    defines: Defines
    path: Path | None = None
    prefix: str = ""
    env: Env = field(default_factory=lambda: [UNBOUND])
    scope: Scope = field(init=False)
    nesting: int = 0
    weight: int = 0
    first: nodes.Stmt | None = None
    materials: dict[str, str] = field(default_factory=dict)
    has_params: bool = False

    def __post_init__(self) -> None:
        self.scope = Scope(Slots(root=self.env))
        self.session.roots.append(self.env)


class Place(NamedTuple):
    """Where a statement or an expression stands.

    Args:
        kind: the kind of block around it.
        nested: whether a ``for`` or ``if`` stands between it and that block's braces.
        repeated: whether a ``for`` stands around it, however far out.
        block: the names of that block, which tell it from others.
    """

    file: FileContext
    scope: Scope
    kind: Kind
    nested: bool = False
    repeated: bool = False
    block: Scope | None = None

    @property
    def session(self) -> Session:
        """The evaluation."""
        return self.file.session

    @property
    def report(self) -> Reporter:
        """Where mistakes go."""
        return self.file.session.report

    def inner(self, kind: Kind | None = None) -> Place:
        """The place inside a block: a new scope, and a new kind unless control flow passes it on."""
        scope = Scope(self.scope.slots, self.scope)
        if kind is None:
            return self._replace(scope=scope, nested=True)
        return Place(self.file, scope, kind, False, self.repeated, scope)
