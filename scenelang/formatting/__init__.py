"""Scene text in one canonical layout: same tokens, same comments, the line breaks of nobody's taste."""

from scenelang.formatting.format import format_text as format_text
from scenelang.formatting.ranges import format_range as format_range

__all__ = ["format_range", "format_text"]
