"""What running costs, in evaluation steps of about a quarter of a microsecond: their limit is one of time.

Most of it is known when a block is prepared: a node of the tree is half a step, unless it is named here.
"""

from __future__ import annotations

from typing import Final

from scenelang.syntax import nodes

HALF_STEPS: Final[dict[type, int]] = {
    nodes.MaterialExpr: 12,
    nodes.MaterialUse: 16,
    nodes.For: 8,
    nodes.Node: 24,
    nodes.Combined: 16,
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
FUNCTIONS: Final = {"hsv": 20, "mix": 12, "clamp": 8, "smoothstep": 8}
"""Half steps of functions that take longer than most."""
ITEM_STEPS: Final = 4
"""An operator on one number of a vector."""
FUNCTION_ITEM_STEPS: Final = 5
"""A function of the language on one number of a vector."""
