"""Work of a function: counted, as seconds hang on the machine and on what else it does."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).parents[1]
KILLED_S = 120
"""A process that takes longer is killed; none of those here needs a twentieth of it."""


def lines_run(function: Callable[[], object]) -> int:
    """Number of lines of Python that a call runs in this thread, loops counted each time round.

    The number is the same each time, but for what is only done at the first call: imports and caches. Work
    inside of C, as that of a regular expression, is not in it; `ends` is for that.
    """
    count = 0

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal count
        count += 1
        return trace

    before, collected = sys.gettrace(), gc.isenabled()
    gc.disable()  # others' callbacks and finalizers run in collections
    sys.settrace(trace)
    try:
        function()
    finally:
        sys.settrace(before)
        if collected:
            gc.enable()
    return count


def ends(code: str, **environment: str) -> str:
    """Run Python code in a process of its own; fail where it fails or has to be killed.

    Its inputs are so large that what is linear takes seconds and what is quadratic hours, so that it does not
    matter how fast the machine is.

    Returns:
        What it prints.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=ROOT,
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            timeout=KILLED_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise AssertionError(f"killed after {KILLED_S} s; it had said: {error.stdout!r}") from None
    assert done.returncode == 0, done.stderr
    return done.stdout
