"""A bar for long work: on standard error, only on a terminal, only after a while."""

from __future__ import annotations

import sys
import threading
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

PATIENCE_S = 1.0


class Bar:
    """Shows how far something is and how long it will take, once it has taken longer than `PATIENCE_S`."""

    def __init__(self) -> None:
        self._wanted = sys.stderr.isatty()
        self._started = time.perf_counter()
        self._lock = threading.Lock()
        self._shown: Progress | None = None
        self._done = 0.0

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._shown is not None:
            self._shown.stop()

    def __call__(self, what: str, done: float, total: float) -> None:
        """Say how much of the total is done, from any thread; less than before begins the next stage."""
        if not self._wanted:
            return
        with self._lock:
            if self._shown is None:
                if time.perf_counter() - self._started < PATIENCE_S:
                    return
                self._shown = _show()
            task = self._shown.task_ids[0]
            if done < self._done:
                self._shown.reset(task)
            self._done = done
            self._shown.update(task, description=what, completed=done, total=total)


def _show() -> Progress:
    from rich.console import Console
    from rich.progress import Progress

    shown = Progress(console=Console(stderr=True), transient=True)
    shown.add_task("")
    shown.start()
    return shown
