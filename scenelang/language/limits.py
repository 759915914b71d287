"""Limits of a scene and of its evaluation, and costs in evaluation steps.

Most costs are known when a block is prepared: a node of the tree is half a step, unless it is named here.
"""

from __future__ import annotations

from typing import Final

from scenelang.language import tree

MAX_OBJECTS: Final = 100_000
MAX_PARTS: Final = 1_000_000  # nodes, transforms and texture operations together; bounds memory
MAX_DEPTH: Final = 200  # calls within calls
MAX_NESTING: Final = 250  # tree levels; text never has as many, trees made by hand can
MAX_STEPS: Final = 10_000_000
MAX_BYTES: Final = 10_000_000
MAX_COMPARED: Final = 500_000  # letters of names, to suggest one


class Halt(Exception):
    """A limit was met and reported; the evaluation ends."""


HALF_STEPS: Final[dict[type, int]] = {
    tree.MaterialExpr: 12,
    tree.MaterialUse: 16,
    tree.For: 8,
    tree.Node: 24,
    tree.Combined: 16,
}
"""Half steps of a node itself; 1 for other expressions, 0 for other statements."""
OBJECT: Final = 16
MOVE: Final = 28
"""A transform or operation whose arguments vary."""
MATRIX: Final = 60
SAME_MOVE: Final = 4
MODULE_CALL: Final = 32
MATERIAL_VALUE: Final = 8

CALL_STEPS: Final = 4
GENERAL_STEPS: Final = 5
"""An operation on anything but two numbers."""
FUNCTIONS: Final = {"hsv": 20, "mix": 12, "clamp": 8, "smoothstep": 8, "str": 12, "noise": 200}
"""Half steps of functions that take longer than most."""
ITEM_STEPS: Final = 4
"""An operator on one number of a vector."""
LETTERS_AS_ITEM: Final = 16
"""Letters of a string that count as one number of a vector."""
FUNCTION_ITEM_STEPS: Final = 5
"""A function of the language on one number of a vector."""
