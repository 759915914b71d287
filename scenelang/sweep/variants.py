"""One scene with the values of each row, as the frames of a clip."""

from __future__ import annotations

from dataclasses import replace

from scenelang.animation.clip import Clip, Shot
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.evaluate.evaluation import Evaluation, Source
from scenelang.sweep.values import Rows


class Variants(Clip):
    """Scenes whose number is that of a row; the text is prepared once, and run for each.

    Args:
        source: the scene, parsed, with the values that all rows share.
        rows: values of params.
        frame: which one of an animation.
        diagnostics: as for `Clip`.
    """

    def __init__(self, source: Source, rows: Rows, frame: int, diagnostics: Diagnostics) -> None:
        self._source, self._rows, self._frame = source, rows, frame
        super().__init__(source.evaluation(diagnostics), diagnostics)
        self._memory = None  # no object is that of another row

    def shot(self, number: int) -> Shot:
        assert isinstance(self._evaluation, Evaluation)
        self._evaluation.inputs.values = self._source.values | dict(self._rows[number])
        return replace(super().shot(self._frame), number=number)

    def mend(self) -> None:
        """Forget the errors of a row, so that others can be run."""
        old, self.diagnostics = self.diagnostics, Diagnostics()
        for d in old:
            if d.severity == "warning":
                self.diagnostics.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
        self._evaluation = self._source.evaluation(self.diagnostics)
