"""The words and terminals of the language, as highlighters group them; imports nothing.

A test holds them to the grammar, to the names that the evaluator knows and to what shipped models offer.
"""

from __future__ import annotations

from typing import Final

DECLARING: Final = ("nsg", "model", "param", "let", "fn", "module", "import", "as")
CONTROL: Final = ("for", "in", "step", "if", "else")
NODES: Final = ("group", "chain", "union", "smooth", "subtract", "intersect")
MATERIAL: Final = ("material",)
TRUTH: Final = ("true", "false")
"""With the four above: all keywords of the grammar."""

CONSTANTS: Final = ("PI", "TAU", "X", "Y", "Z", "none")
ANIMATED: Final = ("t", "u", "frame", "frames")
SETTINGS: Final = ("canvas", "background", "animate")
TRANSFORMS: Final = (
    "translate",
    "rotate",
    "scale",
    "shear",
    "matrix",
    "twirl",
    "bend",
    "twist",
    "displace",
)
TEXTURE: Final = ("flip", "color", "grayscale", "hue")
FUNCTIONS: Final = (
    *("sin", "cos", "tan", "asin", "acos", "atan2", "abs", "min", "max", "clamp", "floor", "ceil", "round"),
    *("sqrt", "exp", "log", "mix", "smoothstep", "len", "rand", "rgb", "hsv"),
)

NAME: Final = r"[A-Za-z_][A-Za-z0-9_]*(?!\w)"
NUMBER: Final = (
    r"(?:[0-9]+(?:\.(?!\.)[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?(?:deg|rad|turn|ms|s)?(?![\w°]|\.[0-9])"
)
STRING: Final = '"(?:[^"\\\\\n]|\\\\[^\n])*"'
COLOR: Final = r"#(?:[0-9a-fA-F]{6}|[0-9a-fA-F]{3})(?!\w)"
OPERATORS: Final = (
    *("..<", "..", "||", "&&", "==", "!=", "<=", ">="),
    *("<", ">", "+", "-", "*", "/", "%", "!", "^", "?", ":", "=", "."),
)
PUNCTUATION: Final = ("(", ")", "[", "]", "{", "}", ",", ";")
