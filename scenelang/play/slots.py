"""The jobs of one page: each has a slot, and the newest of a slot is the one that is done."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, Final

from scenelang.play.answer import Answer, JobFailed
from scenelang.play.folder import Refused
from scenelang.play.messages import Json
from scenelang.play.pool import Pool

LIMITS_S: Final = {"view": 20.0, "network": 60.0, "reference": 300.0, "difference": 300.0, "figures": 300.0}
FILE_S: Final = 3600.0
MOST_JOBS: Final = 100
Slot = tuple[str, str]
Took = Callable[[Answer], None]


class Jobs:
    """What is done for a page, which is told of it.

    Args:
        tell: sends the page a message, or the text of one.
    """

    def __init__(self, tell: Callable[[Json | str], None]) -> None:
        self._tell = tell
        self._tasks: dict[Slot, tuple[asyncio.Task[None], Any, str]] = {}

    def start(self, slot: Slot, id: Any, file: str, job: Json, pool: Pool, done: Took | None) -> None:
        """Do a job, for `scenelang.play.jobs`; the one that has its slot is cancelled.

        Args:
            id: the page's name of it; None where it has none.
            done: is given the answer, before the page is.

        Raises:
            Refused: there are too many.
        """
        if slot in self._tasks:
            self._tasks[slot][0].cancel()
        elif len(self._tasks) >= MOST_JOBS:
            raise Refused("too many drawings at the same time")
        task = asyncio.create_task(self._work(id, file, job, pool, done))
        self._tasks[slot] = task, id, file

        def ended(_: object) -> None:
            if task.cancelled() and id is not None:  # perhaps before it began
                self._tell({"kind": "cancelled", "id": id})
            if slot in self._tasks and self._tasks[slot][0] is task:
                del self._tasks[slot]

        task.add_done_callback(ended)

    def cancel(self, wanted: Callable[[Slot, Any, str], bool]) -> None:
        """Cancel those of which slot, name and file are wanted."""
        for slot, (task, id, file) in list(self._tasks.items()):
            if wanted(slot, id, file):
                task.cancel()

    def close(self) -> None:
        """Cancel all of them."""
        self.cancel(lambda slot, id, file: True)

    async def _work(self, id: Any, file: str, job: Json, pool: Pool, done: Took | None) -> None:
        def said(share: float) -> None:
            self._tell({"kind": "progress", "id": id, "done": round(share, 4)})

        try:
            limit = LIMITS_S.get(job["do"], FILE_S)
            answer = await pool.run(job, limit, said if job["do"] == "file" else None)
        except JobFailed as error:
            if job["do"] == "view":
                problem = {"code": "", "severity": "error", "message": str(error), "line": 1, "column": 1}
                self._tell({**job["message"], "view": None, "problems": [problem], "ms": None})
            else:
                self._tell({"kind": "error", "id": id, "file": file, "message": str(error)})
            return
        if done is not None:
            done(answer)
        if job["do"] != "file":
            self._tell(answer.data.decode())
