"""What torch is asked to do while a frame is under way.

On torch's device `meta` tensors have no numbers, so that whoever waits for one of them fails.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

from torch.utils._python_dispatch import TorchDispatchMode


class Asked(TorchDispatchMode):
    """Counts operations by name, and copies from the host to another device as ``upload``."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: Counter[str] = Counter()

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        found = func(*args, **kwargs or {})
        name = func.overloadpacket.__name__
        up = name == "_to_copy" and args[0].device.type == "cpu" and found.device.type != "cpu"
        self.seen["upload" if up else name] += 1
        return found
