"""One file while it is prepared and run."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.inputs import Defines
from scenelang.evaluate.loader import Loader
from scenelang.evaluate.names import Env, Frame, Scope, file_frame
from scenelang.evaluate.report.suppression import NONE, Damage
from scenelang.evaluate.session import Session
from scenelang.syntax import nodes


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
    damage: Damage = NONE

    def __post_init__(self) -> None:
        self.scope = Scope(self.frame)
        self.session.roots.append(self.root_env)

    @property
    def root_env(self) -> Env:
        """The live slots of the file."""
        assert self.frame.root is not None
        return self.frame.root

    @property
    def lost(self) -> frozenset[str]:
        """Words inside what syntax mistakes have damaged: a definition may have been among it."""
        return self.damage.words
