"""Text to syntax tree: `parse` reads a whole file, reports the mistakes and always returns a tree."""

from scenelang.syntax.parser import parse as parse

__all__ = ["parse"]
