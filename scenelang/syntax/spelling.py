"""Words that were meant for others: keywords with a slip, and those of other languages."""

from __future__ import annotations

from functools import lru_cache

from scenelang.diagnostics.suggest import ranked
from scenelang.syntax.tables import tables

_OPERATORS = {"and": "&&", "or": "||", "not": "!", "mod": "%"}

FOREIGN_HEADS = {
    "function": "fn",
    "func": "fn",
    "fun": "fn",
    "def": "fn",
    "define": "fn",
    "var": "let",
    "const": "let",
    "float": "let",
    "int": "let",
    "bool": "let",
    "vec2": "let",
    "vec3": "let",
    "uniform": "param",
    "include": "import",
    "use": "import",
    "require": "import",
    "foreach": "for",
    "macro": "module",
    "class": "module",
}
"""Words that begin statements in other languages, and the keyword that begins them here."""


@lru_cache(maxsize=256)
def keywords_near(text: str) -> tuple[str, ...]:
    """Keywords that a word may have been meant for, nearest first."""
    words = [word for word in tables().literals if word.isalpha()]
    return tuple(word for _, word in ranked(text, words, max(1, len(text) // 3)))


def word_for(text: str) -> str | None:
    """The operator that other languages write as this word."""
    return _OPERATORS.get(text)
