"""Why something cannot be drawn."""

from __future__ import annotations


class RenderError(Exception):
    """Nothing can be drawn: no such device, no fitting weights, or a Program where a Scene is needed."""
