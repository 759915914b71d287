"""One file while it is prepared and run."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from scenelang.diagnostics.span import SourceFile, Span
from scenelang.scene.scope import Env, Frame, Scope, file_frame
from scenelang.scene.session import Session
from scenelang.syntax import nodes

if TYPE_CHECKING:
    from scenelang.scene.imports import Loader
    from scenelang.scene.params import Defines


@dataclass(slots=True)
class Unit:
    """The state of one file.

    Args:
        source: its text.
        session: the evaluation it belongs to.
        loader: finds what it imports.
        defines: values for params.
        path: where it was read from, resolved; None for text without a file.
        prefix: how the first file calls its params: empty, or ``lib.``.
    """

    source: SourceFile
    session: Session
    loader: Loader
    defines: Defines
    path: Path | None = None
    prefix: str = ""
    frame: Frame = field(default_factory=file_frame)
    scope: Scope = field(init=False)
    nesting: int = 0
    weight: int = 0
    first: nodes.Stmt | None = None
    lost: frozenset[str] = frozenset()
    """Words inside what recovery skipped: a definition may have been among it."""

    def __post_init__(self) -> None:
        self.scope = Scope(self.frame)
        self.session.roots.append(self.root_env)

    @property
    def root_env(self) -> Env:
        """The live slots of the file."""
        assert self.frame.root is not None
        return self.frame.root

    def find_lost(self, file: nodes.File) -> None:
        """Note the words that recovery skipped, so that their absence is no second mistake."""
        words: set[str] = set()
        for span in _bad_spans(file.statements):
            words.update(re.findall(r"[A-Za-z_]\w*", span.text))
        self.lost = frozenset(words)


def _bad_spans(statements: tuple[nodes.Stmt, ...]) -> Iterator[Span]:
    """Spans of unreadable statements, in all blocks."""
    stack: list[nodes.Stmt] = list(statements)
    while stack:
        stmt = stack.pop()
        match stmt:
            case nodes.BadStmt():
                yield stmt.span
            case nodes.For() | nodes.Module() | nodes.Node():
                stack.extend(stmt.body.statements)
            case nodes.Call() | nodes.MaterialUse():
                if stmt.body:
                    stack.extend(stmt.body.statements)
            case nodes.Combined():
                stack.append(stmt.child)
            case nodes.If():
                stack.extend(stmt.then.statements)
                if isinstance(stmt.otherwise, nodes.If):
                    stack.append(stmt.otherwise)
                elif stmt.otherwise:
                    stack.extend(stmt.otherwise.statements)
            case _:
                pass
