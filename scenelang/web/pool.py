"""Processes that compile and draw, and the jobs of one page.

A job that takes too long, is cancelled or needs too much memory ends with its process.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext
from tempfile import TemporaryDirectory
from typing import Any, Final

from scenelang.web import worker
from scenelang.web.folder import Answer, JobFailed, Json, Refused

Said = Callable[[float], None]
_CONTEXT: Final[Any] = multiprocessing.get_context("spawn" if sys.platform == "win32" else "forkserver")
_ENDED: Final = "the process that drew has ended; perhaps the scene needs more memory than it may have"


class Worker:
    """A process that does one job after the other; raises `OSError` or `EOFError` where none starts."""

    def __init__(self, nice: int) -> None:
        _CONTEXT.set_forkserver_preload(["scenelang.web.warm"])
        self._pipe, other = _CONTEXT.Pipe()
        self.process = _CONTEXT.Process(target=worker.serve, args=(other, nice), daemon=True)
        self.process.start()
        other.close()

    def do(self, job: dict[str, Any], said: Said) -> Answer:
        """Have a job done, one that makes a file in a folder for the duration; raises `JobFailed`."""
        is_file = job["do"] == "file"
        with TemporaryDirectory(prefix="scenelang-") if is_file else nullcontext() as folder:
            try:
                self._pipe.send({**job, "folder": folder})
                while isinstance(reply := self._pipe.recv(), float):
                    said(reply)
            except (EOFError, OSError):
                self.process.join()
                raise JobFailed(_ENDED) from None
        if isinstance(reply, JobFailed):
            raise reply
        answer: Answer = reply
        return answer


class Pool:
    """Processes for jobs; the one that was used last is used first.

    Args:
        most: processes at the same time.
        nice: their niceness.
    """

    def __init__(self, most: int, nice: int = 0) -> None:
        self._nice, self._free = nice, asyncio.Semaphore(most)
        self._threads = ThreadPoolExecutor(most + 1)  # in which processes are started and waited for
        self._idle: list[Future[Worker]] = []
        self._busy: set[Future[Worker]] = set()

    def start(self) -> None:
        """Have a process wait for the next job."""
        if not self._idle:
            self._idle.append(self._threads.submit(Worker, self._nice))

    async def run(self, job: dict[str, Any], limit_s: float, said: Said | None = None) -> Answer:
        """Do a job in a process; where this is cancelled the process is ended.

        Args:
            job: JSON data, as `scenelang.web.jobs` has them, but for the folder.
            limit_s: seconds that it may take, without the wait for others.
            said: called with the share done.

        Raises:
            JobFailed: it failed, took too long, or its process ended.
        """
        loop = asyncio.get_running_loop()

        def tell(share: float) -> None:
            if said is not None:
                loop.call_soon_threadsafe(said, share)

        async with self._free:
            self.start()
            started = self._idle.pop()
            self._busy.add(started)
            doing = self._threads.submit(lambda: started.result().do(job, tell))
            try:
                async with asyncio.timeout(limit_s):
                    return await asyncio.wrap_future(doing)
            except TimeoutError:
                raise JobFailed(f"it took more than {limit_s:g} seconds") from None
            except (EOFError, OSError) as error:
                raise JobFailed(f"a process to draw in does not start: {error}") from None
            finally:
                self._busy.discard(started)
                unasked = doing.cancel()  # where no thread has taken it up
                if unasked or (doing.done() and _lives(started)):
                    self._idle.append(started)
                else:
                    started.add_done_callback(_kill)
                    self.start()

    async def close(self) -> None:
        """End all processes."""
        ended = (*self._busy, *self._idle)
        for started in ended:
            started.add_done_callback(_kill)
        await asyncio.to_thread(self._threads.shutdown)
        for started in ended:
            if not started.exception():
                await asyncio.to_thread(started.result().process.join)


def _lives(started: Future[Worker]) -> bool:
    return not started.exception() and bool(started.result().process.is_alive())


def _kill(started: Future[Worker]) -> None:
    if not started.exception():
        started.result().process.kill()


LIMITS_S: Final = {"view": 20.0, "network": 60.0, "reference": 300.0, "difference": 300.0, "figures": 300.0}
FILE_S: Final = 3600.0
MOST_JOBS: Final = 100
Slot = tuple[str, str]
Took = Callable[[Answer], None]


class Jobs:
    """The jobs of a page, one in each slot.

    Args:
        tell: sends the page a message, or the text of one.
    """

    def __init__(self, tell: Callable[[Json | str], None]) -> None:
        self._tell = tell
        self._tasks: dict[Slot, tuple[asyncio.Task[None], Any, str]] = {}

    def start(self, slot: Slot, id: Any, file: str, job: Json, pool: Pool, done: Took | None) -> None:
        """Start a job of `scenelang.web.jobs`; the one that has its slot is cancelled.

        Args:
            id: the page's name of it; None where it has none.
            done: called with the answer before the page gets it.

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
        """Cancel the jobs whose slot, id and file ``wanted`` is true of."""
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
