"""The viewer's JavaScript as one text.

The files of ``web/`` are ES modules for the sake of editors and tests. A page gets them one after the other
in one scope, without their imports and exports, so names at their top level differ across all of them.
"""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files
from typing import Final

MODULES: Final = (
    *("store", "gl", "grids", "groups", "ways", "plane"),
    *("values", "functions", "maps", "looks", "chain", "graph", "stage"),
    *("eye", "expressions", "evaluate"),
    *("elements", "balls", "solid"),
    *("camera", "pace", "surface", "viewer", "dom", "steer", "controls", "page"),
)
"""Of ``web/``; each stands behind what it imports."""

_IMPORT: Final = re.compile(r'^import \{[^}]*\} from "[^"]*";\n', re.MULTILINE)
_EXPORT: Final = re.compile(r"^export (?=(?:async )?(?:function|class|const)\b)", re.MULTILINE)


@cache
def script() -> str:
    """All of it, to stand in a function or a module."""
    return "\n".join(_EXPORT.sub("", _IMPORT.sub("", web(f"{name}.js"))) for name in MODULES)


def web(name: str) -> str:
    """The text of a file of ``web/``."""
    return files("scenelang.viewer").joinpath("web", name).read_text("utf-8")
