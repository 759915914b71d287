"""What every pass is given beside the graph."""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.models.manifest import Manifest
from scenelang.records import Record


class Context(Record):
    """The model a graph is compiled for and where its mistakes go.

    Args:
        diagnostics: receives E04xx, E05xx and warnings.
        whole: False after an earlier error, when leaves may lack moves and no bound means anything.
        moves: the scene is a frame of an animation, where nothing may be in sight for a while.
    """

    manifest: Manifest
    diagnostics: Diagnostics
    whole: bool = True
    moves: bool = False
