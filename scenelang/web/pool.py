"""Processes that compile and draw, one job after the other.

A job that takes too long, is cancelled or needs too much memory ends with its process.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import multiprocessing
import os
import sys
import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing.connection import Connection
from tempfile import TemporaryDirectory
from typing import Any, Final

from scenelang.web.folder import Answer, JobFailed

Said = Callable[[float], None]
MOST_MEMORY: Final = 4 << 30
"""Bytes of addresses that a process may have, where the system counts them."""
_REPORT_S: Final = 0.1  # between two reports of the share done
_DEEP: Final = 10_000
_CONTEXT: Final[Any] = multiprocessing.get_context("spawn" if sys.platform == "win32" else "forkserver")
_ENDED: Final = "the process that drew has ended; perhaps the scene needs more memory than it may have"


class Worker:
    """A process that does one job after the other; raises `OSError` or `EOFError` where none starts."""

    def __init__(self, nice: int) -> None:
        _CONTEXT.set_forkserver_preload(["scenelang.web.warm"])
        self._pipe, other = _CONTEXT.Pipe()
        self.process = _CONTEXT.Process(target=serve, args=(other, nice), daemon=True)
        self.process.start()
        other.close()

    def do(self, job: dict[str, Any], said: Said) -> Answer:
        """Have a job done, one that makes a file in a folder for the duration; raises `JobFailed`."""
        is_file = job["do"] == "file"
        with TemporaryDirectory(prefix="scenelang-") if is_file else contextlib.nullcontext() as folder:
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
    """Processes for jobs, so many at the same time; the one that was used last is used first."""

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
        """Do a job in a process, which ends where this is cancelled; raises `JobFailed` if that fails.

        It also fails after ``limit_s`` seconds, the wait not counted, and where its process ends.
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
                idle = doing.cancel()  # where no thread has taken it up
                if idle or (doing.done() and not started.exception() and started.result().process.is_alive()):
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


def _kill(started: Future[Worker]) -> None:
    if not started.exception():
        started.result().process.kill()


def serve(pipe: Connection, nice: int) -> None:
    """Take jobs from a pipe, and of each send shares done (floats), then an `Answer` or `JobFailed`."""
    server = multiprocessing.parent_process()
    assert server is not None

    def end_with_server() -> None:
        server.join()
        os._exit(0)

    threading.Thread(target=end_with_server, daemon=True).start()
    with contextlib.suppress(AttributeError, OSError):
        os.nice(nice)
    limit_memory()
    sys.setrecursionlimit(max(sys.getrecursionlimit(), _DEEP))
    importlib.import_module("scenelang.web.warm")  # is there already where this process was forked
    with contextlib.suppress(EOFError, OSError):  # nobody asks any more
        while True:
            pipe.send(_answer(pipe.recv(), pipe))


def _answer(job: dict[str, Any], pipe: Connection) -> Answer | JobFailed:
    from scenelang.web.jobs import do

    reported = 0.0

    def tell(share: float) -> None:
        nonlocal reported
        if time.monotonic() - reported > _REPORT_S:
            reported = time.monotonic()
            pipe.send(float(share))

    try:
        return do(job, tell)
    except JobFailed as error:
        return error
    except MemoryError:
        return JobFailed(f"it needs more than {MOST_MEMORY >> 30} GB of memory")
    except Exception as error:
        traceback.print_exc()
        return JobFailed(f"internal error: {error!r}"[:500])


def limit_memory(most: int = MOST_MEMORY) -> None:
    """Have allocations fail rather than this process take all memory, where the system can."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))
