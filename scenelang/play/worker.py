"""A process that does one job after the other: ``python -m scenelang.play.worker NICE``, for `pool`.

A thread reads; a job that is to stop is interrupted as Ctrl-C would. Where the pipe ends so does the process,
at once.
"""

from __future__ import annotations

import _thread
import contextlib
import gc
import json
import os
import signal
import sys
import threading
import time
import traceback
from queue import SimpleQueue
from types import FrameType
from typing import Any, BinaryIO, Final

MOST_MEMORY: Final = 4 << 30
"""Bytes of addresses that a process may have, where the system counts them."""
_TOLD_S: Final = 0.1  # between two tellings of how far a job is
_DEEP: Final = 10_000


class Stopped(BaseException):
    """Nobody wants the job any more."""


class Desk:
    """Where jobs come in and answers go out."""

    def __init__(self, source: BinaryIO, answers: BinaryIO) -> None:
        self._source, self._answers = source, answers
        self.jobs: SimpleQueue[dict[str, Any]] = SimpleQueue()
        self._works = False  # from taking a job to before its answer: when it may be interrupted
        self._missed = False  # it was interrupted when it may not be
        self._told = 0.0
        self._lock = threading.Lock()

    def read(self) -> None:
        """Take in jobs until the pipe ends."""
        while line := self._source.readline():
            data = self._source.read(int(line))
            if len(data) < int(line):
                break
            job = json.loads(data)
            if job["do"] == "stop":
                _thread.interrupt_main()
            else:
                self.jobs.put(job)
        os._exit(0)

    def stop(self, number: int, frame: FrameType | None) -> None:
        """What an interruption does."""
        self._missed = not self._works
        if self._works:
            self._works = False
            raise Stopped

    def work(self, job: dict[str, Any]) -> None:
        """Do a job and answer."""
        from scenelang.play.jobs import Trouble, do

        head: dict[str, Any]
        data = b""
        gc.enable()  # a job that was interrupted may have left it off
        try:
            self._missed, self._works = False, True
            try:
                head, data = do(job, self.tell)
            finally:
                self._works = False
        except Stopped:
            head = {"is": "failed", "message": "it was stopped"}
        except Trouble as error:
            head = {"is": "failed", "message": str(error)}
        except MemoryError:
            head = {"is": "failed", "message": f"it needs more than {MOST_MEMORY >> 30} GB of memory"}
        except Exception as error:
            traceback.print_exc()
            head = {"is": "failed", "message": f"internal error: {error!r}"[:500]}
        self._write(head, data)

    def tell(self, done: float) -> None:
        """Say how far a job is, not too often."""
        now = time.monotonic()
        if now - self._told > _TOLD_S:
            self._told, self._works = now, False
            self._write({"is": "progress", "done": done}, b"")
            self._works = True
            if self._missed:
                raise Stopped

    def _write(self, head: dict[str, Any], data: bytes) -> None:
        with self._lock:
            self._answers.write(json.dumps({**head, "bytes": len(data)}).encode() + b"\n" + data)
            self._answers.flush()


def limit_memory(most: int = MOST_MEMORY) -> None:
    """Have allocations fail rather than this process take all memory, where the system can."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))


def main() -> None:
    """Read jobs until there are no more."""
    # Answers go where standard output went; whatever prints goes to standard error.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    with contextlib.suppress(AttributeError, OSError, IndexError):
        os.nice(int(sys.argv[1]))
    limit_memory()
    desk = Desk(sys.stdin.buffer, answers)
    signal.signal(signal.SIGINT, desk.stop)
    sys.setrecursionlimit(max(sys.getrecursionlimit(), _DEEP))
    from scenelang.play import jobs

    jobs.warm()
    answers.write(b'{"is": "ready"}\n')
    answers.flush()
    threading.Thread(target=desk.read, daemon=True).start()
    try:
        while True:
            desk.work(desk.jobs.get())
    except BrokenPipeError:  # whoever asked is gone
        os._exit(0)


if __name__ == "__main__":
    main()
