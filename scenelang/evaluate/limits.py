"""How large a scene may be, and how long its evaluation may take."""

from __future__ import annotations

from typing import Final

MAX_OBJECTS: Final = 100_000
MAX_PARTS: Final = 1_000_000  # nodes, transforms and texture operations together; bounds memory
MAX_DEPTH: Final = 200  # calls within calls
MAX_NESTING: Final = 250  # tree levels; text never has as many, trees made by hand can
MAX_STEPS: Final = 10_000_000
MAX_BYTES: Final = 10_000_000
MAX_COMPARED: Final = 500_000  # letters of names, to suggest one


class Halt(Exception):
    """A limit was met and reported; the evaluation ends."""
