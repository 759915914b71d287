"""Processes that compile and draw, beside the one that answers: warm, and ended where they hang.

Each is a plain ``python -m scenelang.play.worker`` that reads jobs from a pipe and ends when its pipe does,
so that none outlives this process. A head is a line of JSON; ``bytes`` of it says how much follows.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from collections.abc import Callable
from typing import Any, Final

from scenelang.records import Record

GRACE_S: Final = 0.5  # that a job has to stop by itself
PATIENCE_S: Final = 0.15  # before another process is started, where all that there are have something to do
_READY: Final = b'{"is": "ready"}\n'


class JobFailed(Exception):
    """A job came to nothing; the message says why."""


class Answer(Record):
    """What came of a job."""

    head: dict[str, Any]
    data: bytes


class Worker:
    """One process."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        self._answer: asyncio.Future[Answer] | None = None
        self._said: Callable[[float], None] | None = None
        self._reads = asyncio.create_task(self._read())

    @classmethod
    async def start(cls, nice: int) -> Worker:
        """A process that has imported what it needs."""
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "scenelang.play.worker", str(nice)),
            stdin=pipe,
            stdout=pipe,
            env=environment,
            start_new_session=True,  # Ctrl-C reaches this process alone, which ends the others
        )
        assert process.stdout is not None
        worker = cls.__new__(cls)
        try:
            if await process.stdout.readline() != _READY:
                raise JobFailed("a process to draw in does not start")
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
            raise
        worker.__init__(process)  # type: ignore[misc]
        return worker

    @property
    def is_alive(self) -> bool:
        return self._process.returncode is None and not self._reads.done()

    async def ask(self, job: dict[str, Any], said: Callable[[float], None] | None) -> Answer:
        """Do a job; raises `JobFailed`. Where this is cancelled the job goes on until `stop`."""
        self._answer, self._said = asyncio.get_running_loop().create_future(), said
        self._send(job)
        return await asyncio.shield(self._answer)

    async def stop(self) -> None:
        """End the job that runs, by ending the process if it does not end by itself."""
        self._said = None
        if self._answer is None or self._answer.done():
            return
        self._send({"do": "stop"})
        await asyncio.wait([self._answer], timeout=GRACE_S)
        if not self._answer.done():
            await self.kill()

    async def kill(self) -> None:
        """End the process, whatever it does."""
        with contextlib.suppress(ProcessLookupError):
            self._process.kill()
        await self._process.wait()
        self._reads.cancel()
        await asyncio.wait([self._reads])
        self._end("the process that drew has ended")

    def _send(self, job: dict[str, Any]) -> None:
        data = json.dumps(job).encode()
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.write(b"%d\n" % len(data) + data)

    async def _read(self) -> None:
        stream = self._process.stdout
        assert stream is not None
        try:
            while line := await stream.readline():
                head = json.loads(line)
                data = await stream.readexactly(head.pop("bytes", 0))
                if head["is"] == "progress":
                    if self._said is not None:
                        self._said(head["done"])
                elif self._answer is not None and not self._answer.done():
                    if head["is"] == "done":
                        self._answer.set_result(Answer(head, data))
                    else:
                        self._end(head["message"])
        except (OSError, ValueError, asyncio.IncompleteReadError):
            pass
        self._end("the process that drew has ended; perhaps the scene needs more memory than it may have")

    def _end(self, message: str) -> None:
        if self._answer is not None and not self._answer.done():
            self._answer.set_exception(JobFailed(message))
            self._answer.exception()  # nobody may be waiting any more


class Pool:
    """So many processes at most, the last one that was used first.

    Args:
        most: processes at the same time.
        warm: of them, started before there is something to do, and again where one was ended.
        nice: how much they stand back for others, as of ``nice``.
    """

    def __init__(self, most: int, warm: int, nice: int = 0) -> None:
        self._most, self._warm, self._nice = most, warm, nice
        self._idle: asyncio.LifoQueue[Worker | str] = asyncio.LifoQueue()
        self._all: set[Worker] = set()
        self._count = 0  # those that are being started are among them
        self._tasks: set[asyncio.Task[None]] = set()
        self._closed = False

    def start(self) -> None:
        """Start the warm ones, without waiting."""
        for _ in range(self._warm):
            self._grow()

    async def run(
        self, job: dict[str, Any], limit_s: float, said: Callable[[float], None] | None = None
    ) -> Answer:
        """Do a job in a process; where this is cancelled the process is stopped.

        Args:
            job: JSON data, as `scenelang.play.jobs` has them.
            limit_s: how long it may take, without the wait for a process.
            said: is told the share done.

        Raises:
            JobFailed: it failed, took too long, or its process ended.
        """
        worker = await self._take()
        try:
            async with asyncio.timeout(limit_s):
                answer = await worker.ask(job, said)
        except TimeoutError:
            self._later(self._settle(worker))
            raise JobFailed(f"it took more than {limit_s:g} seconds") from None
        except BaseException:
            self._later(self._settle(worker))
            raise
        self._give(worker)
        return answer

    async def close(self) -> None:
        """End all processes."""
        self._closed = True
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await asyncio.gather(*(worker.kill() for worker in list(self._all)))

    async def _take(self) -> Worker:
        while True:
            if self._idle.empty() and self._count < self._most:
                if self._count >= max(1, self._warm):
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(PATIENCE_S):
                            self._idle.put_nowait(await self._idle.get())
                if self._idle.empty() and self._count < self._most:
                    self._grow()
            worker = await self._idle.get()
            if isinstance(worker, str):
                raise JobFailed(worker)
            if worker.is_alive:
                return worker
            self._lose(worker)

    def _grow(self) -> None:
        self._count += 1
        self._later(self._add())

    async def _add(self) -> None:
        try:
            worker = await Worker.start(self._nice)
        except (JobFailed, OSError) as error:
            self._count -= 1
            self._idle.put_nowait(str(error))  # whoever waits is told
            return
        self._all.add(worker)
        self._idle.put_nowait(worker)

    async def _settle(self, worker: Worker) -> None:
        await worker.stop()
        self._give(worker)

    def _give(self, worker: Worker) -> None:
        if worker.is_alive:
            self._idle.put_nowait(worker)
        else:
            self._lose(worker)

    def _lose(self, worker: Worker) -> None:
        self._all.discard(worker)
        self._count -= 1
        if not self._closed and self._count < max(1, self._warm):
            self._grow()

    def _later(self, work: Any) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
