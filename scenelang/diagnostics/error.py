"""What the library raises for a scene with errors."""

from __future__ import annotations

from collections.abc import Iterable

from scenelang.diagnostics.diagnostic import Diagnostic


class SceneError(Exception):
    """Raised by the library where a scene has errors; ``diagnostics`` is all that was found."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        from scenelang.diagnostics.render_text import render_text

        super().__init__(render_text(self.diagnostics, fixable=0))
