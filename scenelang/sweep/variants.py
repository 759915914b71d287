"""One scene with the values of each row, as the frames of a clip."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from scenelang.animation.clip import Clip, Shot
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.evaluate.evaluation import Evaluation
from scenelang.sweep.values import Rows


class Variants(Clip):
    """Scenes whose number is that of a row; the text is prepared once, and run for each.

    Args:
        begin: prepares the scene, and reports to diagnostics.
        rows: values of params.
        fixed: values that all rows share.
        frame: which one of an animation.
        diagnostics, model, size: as for `Clip`.
    """

    def __init__(
        self,
        begin: Callable[[Diagnostics], Evaluation],
        *,
        rows: Rows,
        fixed: Mapping[str, Any],
        frame: int = 0,
        diagnostics: Diagnostics,
        model: str | None = None,
        size: tuple[int, int] | None = None,
    ) -> None:
        self._begin, self._fixed, self._rows, self._frame = begin, dict(fixed), rows, frame
        super().__init__(begin(diagnostics), diagnostics=diagnostics, model=model, size=size)
        self._memory = None  # no object is that of another row

    def shot(self, number: int) -> Shot:
        assert isinstance(self._evaluation, Evaluation)
        self._evaluation.inputs.values = self._fixed | dict(self._rows[number])
        return replace(super().shot(self._frame), number=number)

    def mend(self) -> None:
        """Forget the errors of a row, so that others can be run."""
        old, self.diagnostics = self.diagnostics, Diagnostics()
        for d in old:
            if d.severity == "warning":
                self.diagnostics.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
        self._evaluation = self._begin(self.diagnostics)
