"""What a pass changed, as a unified diff of the dumps before and after it."""

from __future__ import annotations

import difflib
from typing import Final

_MOST_LINES: Final = 3000


def changes(before: str, after: str, old: str, new: str) -> str:
    """The diff of two dumps; empty where nothing changed.

    Comparing line by line takes quadratic time, so of very large changes only the size is told.

    Args:
        before: the dump of the stage ``old``.
        after: the dump of the stage ``new``.
        old: name of a stage.
        new: name of a stage.
    """
    if before == after:
        return ""
    a, b = before.splitlines(), after.splitlines()
    head = 0
    while head < min(len(a), len(b)) and a[head] == b[head]:
        head += 1
    tail = 0
    while tail < min(len(a), len(b)) - head and a[-1 - tail] == b[-1 - tail]:
        tail += 1
    if max(len(a), len(b)) - head - tail > _MOST_LINES:
        counts = f"{len(a) - head - tail:,} lines became {len(b) - head - tail:,}"
        return f"--- {old}\n+++ {new}\n@@ from line {head + 1:,}: {counts} @@\n"
    lines = difflib.unified_diff(a, b, old, new, lineterm="")
    return "\n".join(lines) + "\n"
