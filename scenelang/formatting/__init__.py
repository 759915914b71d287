"""Scene text in one canonical layout: same tokens, same comments, the line breaks of nobody's taste."""

from scenelang.formatting.format import format_range as format_range
from scenelang.formatting.format import format_text as format_text

__all__ = ["format_range", "format_text"]
