"""How far long work is, and where the time of a command went."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

PATIENCE_S = 1.0


class Clock:
    """Seconds spent in each of a command's stages, in the order in which they first ran."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        started = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - started

    def report(self) -> str:
        """One line with all stages."""
        parts = [f"{stage} {1000 * seconds:.0f}" for stage, seconds in self.seconds.items()]
        return f"time (ms): {', '.join(parts)}"


class Bar:
    """How far something is and how long it will take, shown on a terminal once it took `PATIENCE_S`."""

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
                from rich.console import Console
                from rich.progress import Progress

                self._shown = Progress(console=Console(stderr=True), transient=True)
                self._shown.add_task("")
                self._shown.start()
            task = self._shown.task_ids[0]
            if done < self._done:
                self._shown.reset(task)
            self._done = done
            self._shown.update(task, description=what, completed=done, total=total)
