"""What every record says of where it was made."""

from __future__ import annotations

import platform
from typing import Any

import torch

from scenelang.training.loop import revision


def about() -> dict[str, Any]:
    """Revision, kind of machine, torch and its threads."""
    return {
        "revision": revision(),
        "machine": platform.machine(),
        "torch": torch.__version__.split("+")[0],
        "threads": torch.get_num_threads(),
    }
