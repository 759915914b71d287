"""Blocks of ``nsg`` in the documentation's pages and the pictures behind them."""

from __future__ import annotations

import re

_SCENE = re.compile(
    r"^```nsg(?: title=[^\n]*)?\n((?:(?!```)[^\n]*\n)*)```\n\n"
    r"!\[[^\]]*\]\(pictures/([\w/-]+\.(?:png|webp))\)",
    re.MULTILINE,
)


def pictured(page: str) -> list[tuple[str, str]]:
    """Texts of the scenes of a page that have a picture, and its file below ``pictures/``."""
    return _SCENE.findall(page)
