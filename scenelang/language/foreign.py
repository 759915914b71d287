"""Words of languages nearby - OpenSCAD, POV-Ray, GLSL, JavaScript, Python - and what is written here.

`foreign.txt` has them: ``[a table]``, and rows of words, a colon and what each of them means.
"""

from __future__ import annotations

from typing import Final

from scenelang.language.tables import sections


def _table(body: str) -> dict[str, str]:
    """Meanings by words, of a section's lines."""
    lines = [line.partition(": ") for line in body.splitlines() if not line.startswith("#")]
    return {word: meaning for words, colon, meaning in lines if colon for word in words.split()}


_TABLES: Final = {title: _table(body) for title, body in sections("foreign").items()}
FUNCTIONS: Final = _TABLES["functions"]
MATERIALS: Final = _TABLES["materials"]
VALUES: Final = _TABLES["values"]
NAMES: Final = _TABLES["names"]
COLOURS: Final = _TABLES["colours"]
WORDS: Final = _TABLES["words"]
STATEMENTS: Final = _TABLES["statements"]
SHAPES: Final = _TABLES["shapes"]
SOLIDS: Final = _TABLES["solids"]
OPERATORS: Final = _TABLES["operators"]
HEADS: Final = _TABLES["heads"]
SIGNS: Final = _TABLES["signs"]
UNIT_NAMES: Final = _TABLES["units"]
_OF: Final = "arguments of "
ARGUMENTS: Final = {name.removeprefix(_OF): own for name, own in _TABLES.items() if name.startswith(_OF)}
LIBRARIES: Final = ("Math", "math", "np", "numpy")
"""Prefixes of the names of functions and constants."""
LOOKS: Final = ("color", "colour", "fill", "stroke", "material", "c")
"""Arguments that elsewhere give an object its colour."""
