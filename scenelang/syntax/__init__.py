"""Text to syntax tree: `parse` reads a whole file, reports every mistake and always returns a tree."""

from scenelang.syntax.parser import parse as parse

__all__ = ["parse"]
