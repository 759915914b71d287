"""How a picture may be drawn, why it cannot be, and how the C library gives memory back."""

from __future__ import annotations

import os
import sys
from typing import Literal

Backend = Literal["neural", "reference"]
Still = Literal["neural", "exact", "reference"]
"""Backends that draw a single picture."""
Device = Literal["auto", "cpu", "cuda"]
Samples = Literal["adaptive", "four", "quick", "one", "draft"]
"""Of a pixel, as `scenelang.backend.render.render` says."""


class RenderError(Exception):
    """Nothing can be drawn: no such device, no fitting weights, or a Program where a Scene is needed."""


KEEP_BYTES = 256 << 20
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h


def keep_memory() -> bool:
    """Have glibc reuse blocks up to `KEEP_BYTES` instead of giving each back to the kernel.

    Otherwise every operation on a large array pays a page fault for every 4 KB of its result. False where
    the C library is another or did not take it.
    """
    import ctypes

    try:
        if not sys.platform.startswith("linux") or not (os.confstr("CS_GNU_LIBC_VERSION") or ""):
            return False
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, ValueError):
        return False  # musl has neither the name nor the function
    return all(mallopt(option, KEEP_BYTES) == 1 for option in (_M_MMAP_THRESHOLD, _M_TRIM_THRESHOLD))


THREAD_PIXELS = 1 << 17
"""Pixels of a picture for each thread that draws it: with fewer, threads wait for each other longer than they
save (`python -m lab bench floor --threads 2`)."""


def threads_for(canvas: tuple[int, int]) -> int:
    """Threads that a picture is drawn by unless a caller says how many."""
    return max(1, min(usable_cores(), canvas[0] * canvas[1] // THREAD_PIXELS))


def usable_cores() -> int:
    """Cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
