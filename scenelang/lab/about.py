"""What every record says of where it was made, and how measurements say how far they are."""

from __future__ import annotations

import platform
from collections.abc import Callable
from typing import Any

import torch

from scenelang.training.loop import revision

Report = Callable[[str, int, int], None]
"""Called with what is measured, how much of it is done, and all."""


def silent(what: str, done: int, count: int) -> None:
    """A report that says nothing."""


def about() -> dict[str, Any]:
    """Revision, kind of machine, torch and its threads."""
    return {
        "revision": revision(),
        "machine": platform.machine(),
        "torch": torch.__version__.split("+")[0],
        "threads": torch.get_num_threads(),
    }
