"""The library that ships: files that every scene may import, by names such as ``std/shapes``.

Such a name means a file of this package wherever it is written. A user's own file of that name is
``./std/shapes``; one with a suffix, ``std/shapes.nsg``, is always the user's.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import SourceFile, Span

SHAPES: Final = "std/shapes"
MESHES: Final = "std/meshes"
_FOLDER: Final = Path(__file__).resolve().parents[1] / "std"
_RESERVED: Final = re.compile(r"std/[A-Za-z0-9_]+")


_SUFFIXES: Final = (".nsg", ".safetensors")
_FILES: Final = {f"std/{path.stem}": path for path in _FOLDER.iterdir() if path.suffix in _SUFFIXES}


def is_reserved(text: str) -> bool:
    """Whether an import's path is the library's to give, a file of it or not."""
    return _RESERVED.fullmatch(text) is not None


def names() -> list[str]:
    """What there is to import."""
    return sorted(_FILES)


def find(text: str) -> Path | None:
    """The file that a name of the library means; None where it means none."""
    return _FILES.get(text)


def owns(path: Path) -> bool:
    """Whether a resolved path is a file of the library."""
    return path.parent == _FOLDER


def called(name: str) -> str:
    """What a file of the library is called in diagnostics and Programs, wherever it is installed."""
    return f"<{name}>"


def holds(source: SourceFile) -> bool:
    """Whether a text is a file of the library."""
    return source.name.startswith("<std/")


def meant(text: str, span: Span) -> tuple[str | None, Fix | None]:
    """Help and fix for the path of a file that is not there, if the library's was meant."""
    name = text.removeprefix("./").removesuffix(".nsg").removesuffix(".safetensors")
    if name not in names():
        return None, None
    return f"the library that ships is `{name}`", Fix(f"write `{name}`", (Edit(span, f'"{name}"'),))
