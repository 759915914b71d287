"""A bar for long work: on standard error, only on a terminal, only after a while."""

from __future__ import annotations

import sys
import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

PATIENCE_S = 1.0


class Bar:
    """Shows how far something is, once it has taken longer than `PATIENCE_S`.

    Args:
        what: a word or two in front of the bar.
        total: what `to` counts up to.
        count: show how many of them are done, too.
    """

    def __init__(self, what: str, total: float, *, count: bool = False) -> None:
        self.what, self.total, self.count = what, total, count
        self._wanted = sys.stderr.isatty()
        self._started = time.perf_counter()
        self._lock = threading.Lock()
        self._shown: Progress | None = None

    def __enter__(self) -> Bar:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._shown is not None:
            self._shown.stop()

    def to(self, done: float) -> None:
        """Say that ``done`` of the total is done; from any thread."""
        if not self._wanted:
            return
        with self._lock:
            if self._shown is None:
                if time.perf_counter() - self._started < PATIENCE_S:
                    return
                self._shown = self._show()
            self._shown.update(self._shown.task_ids[0], completed=done)

    def part(self, index: int, share: float) -> None:
        """Say that ``share`` of item ``index`` is done; for items of length 1."""
        self.to(index + share)

    def _show(self) -> Progress:
        from rich.console import Console
        from rich.progress import MofNCompleteColumn, Progress

        columns = (*Progress.get_default_columns(), *([MofNCompleteColumn()] if self.count else []))
        shown = Progress(*columns, console=Console(stderr=True), transient=True)
        shown.add_task(self.what, total=self.total)
        shown.start()
        return shown
