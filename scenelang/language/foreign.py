"""Words of languages nearby - OpenSCAD, POV-Ray, GLSL, JavaScript, Python - and what is written here.

`foreign.txt` has them: ``[a table]``, and rows of words, a colon and what each of them means.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final


def _read() -> dict[str, dict[str, str]]:
    tables: dict[str, dict[str, str]] = {}
    table: dict[str, str] = {}
    for line in Path(__file__).with_suffix(".txt").read_text("utf-8").splitlines():
        words, colon, meaning = line.partition(": ")
        if line.startswith("["):
            table = tables[line.strip("[]")] = {}
        elif colon and not line.startswith("#"):
            table |= dict.fromkeys(words.split(), meaning)
    return tables


_TABLES: Final = _read()
FUNCTIONS: Final = _TABLES["functions"]
MATERIALS: Final = _TABLES["materials"]
VALUES: Final = _TABLES["values"]
NAMES: Final = _TABLES["names"]
COLOURS: Final = _TABLES["colours"]
WORDS: Final = _TABLES["words"]
STATEMENTS: Final = _TABLES["statements"]
SHAPES: Final = _TABLES["shapes"]
OPERATORS: Final = _TABLES["operators"]
HEADS: Final = _TABLES["heads"]
SIGNS: Final = _TABLES["signs"]
UNIT_NAMES: Final = _TABLES["units"]
ARGUMENTS: Final = {
    name.removeprefix("arguments of "): table
    for name, table in _TABLES.items()
    if name.startswith("arguments of ")
}
LIBRARIES: Final = ("Math", "math", "np", "numpy")
"""Prefixes of the names of functions and constants."""
LOOKS: Final = ("color", "colour", "fill", "stroke", "material", "c")
"""Arguments that elsewhere give an object its colour."""
