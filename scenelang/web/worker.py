"""A process of `scenelang.web.pool`: it does one job after the other."""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
import sys
import threading
import time
import traceback
from multiprocessing.connection import Connection
from typing import Any, Final

from scenelang.web.folder import Answer, JobFailed

MOST_MEMORY: Final = 4 << 30
"""Bytes of addresses that a process may have, where the system counts them."""
_REPORT_S: Final = 0.1  # between two reports of the share done
_DEEP: Final = 10_000


def serve(pipe: Connection, nice: int) -> None:
    """Take jobs from a pipe, and of each send shares done (floats), then an `Answer` or `JobFailed`."""
    threading.Thread(target=_end_with_server, daemon=True).start()
    with contextlib.suppress(AttributeError, OSError):
        os.nice(nice)
    limit_memory()
    sys.setrecursionlimit(max(sys.getrecursionlimit(), _DEEP))
    importlib.import_module("scenelang.web.warm")  # is there already where this process was forked
    with contextlib.suppress(EOFError, OSError):  # nobody asks any more
        while True:
            pipe.send(_answer(pipe.recv(), pipe))


def _end_with_server() -> None:
    server = multiprocessing.parent_process()
    assert server is not None
    server.join()
    os._exit(0)


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
