"""Processes that compile and draw, next to the one that answers: forked warm, and ended where they hang.

A job that takes too long, that nobody wants any more or that needs too much memory ends with its process.
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

from scenelang.play import worker
from scenelang.play.answer import Answer, JobFailed

Said = Callable[[float], None]
_CONTEXT: Final[Any] = multiprocessing.get_context("spawn" if sys.platform == "win32" else "forkserver")
_ENDED: Final = "the process that drew has ended; perhaps the scene needs more memory than it may have"


class Worker:
    """A process that does one job after the other; raises `OSError` or `EOFError` where none starts."""

    def __init__(self, nice: int) -> None:
        _CONTEXT.set_forkserver_preload(["scenelang.play.warm"])
        self._pipe, other = _CONTEXT.Pipe()
        self.process = _CONTEXT.Process(target=worker.serve, args=(other, nice), daemon=True)
        self.process.start()
        other.close()

    def do(self, job: dict[str, Any], said: Said) -> Answer:
        """Have a job done, a file in a folder that lasts as long; raises `JobFailed`."""
        is_file = job["do"] == "file"
        with TemporaryDirectory(prefix="scenelang-") if is_file else nullcontext() as folder:
            try:
                self._pipe.send({**job, "folder": folder})
                while isinstance(told := self._pipe.recv(), float):
                    said(told)
            except (EOFError, OSError):
                self.process.join()
                raise JobFailed(_ENDED) from None
        if isinstance(told, JobFailed):
            raise told
        answer: Answer = told
        return answer


class Pool:
    """A number of processes, the last one that was used first.

    Args:
        most: processes at the same time.
        nice: how much they stand back for others, as of ``nice``.
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
            job: JSON data, as `scenelang.play.jobs` has them, but for the folder.
            limit_s: how long it may take, without the wait for others.
            said: is told the share done.

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
