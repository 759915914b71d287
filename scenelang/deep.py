"""Working on deep and large trees: one switch for the interpreter's limits, for everyone who needs it."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_STACK_FRAMES: Final = 200_000  # calls x nesting x frames per level, with room
_lock = threading.Lock()
_users = 0
_before = (0, False)  # the interpreter's recursion limit, and whether it collected cycles


@contextmanager
def deep_stack() -> Iterator[None]:
    """Allow deep recursion of Python code, and pause the collector of reference cycles meanwhile.

    Recursion of Python code costs no C stack from Python 3.11 on. Evaluation, passes and layouts make many
    lasting objects and no cycles: looking for some takes as long as the work itself, or several times that.
    Both switches are the interpreter's, one for all threads: the last user puts them back.
    """
    global _users, _before
    with _lock:
        if _users == 0:
            _before = (sys.getrecursionlimit(), gc.isenabled())
            sys.setrecursionlimit(max(_before[0], _STACK_FRAMES))
            gc.disable()
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if _users == 0:
                sys.setrecursionlimit(_before[0])
                if _before[1]:
                    gc.enable()
