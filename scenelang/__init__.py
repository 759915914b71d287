"""A language for scene graphs and a compiler from it to neural render calls.

The pipeline, in order: ``language`` reads text and evaluates it to a Scene, ``compiler`` lowers that to a
graph, rewrites it and lifts it to the vectors and tokens of a Program, ``drawing`` draws.

Importing this package imports nothing else; each public name, a line of `__init__.pyi`, is fetched when it is
first used.
"""

from __future__ import annotations

import importlib
import os
from typing import Any, Final

with open(os.path.splitext(__file__)[0] + ".pyi", encoding="utf-8") as _names:
    _MODULE: Final = {words[-1]: words[1] for words in map(str.split, _names) if words[:1] == ["from"]}

__all__ = sorted(_MODULE)


def __getattr__(name: str) -> Any:
    if name not in _MODULE:
        raise AttributeError(f"module 'scenelang' has no attribute {name!r}")
    from scenelang.assets import notebook

    notebook.show = _show
    value = globals()[name] = getattr(importlib.import_module(_MODULE[name]), name)
    return value


def _show(value: Any, canvas: tuple[int, int], said: str) -> dict[str, Any]:
    """Show a Scene or Program in a notebook."""
    from scenelang.web.notebook import bundle

    return bundle(value, canvas, said)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
