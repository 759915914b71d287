"""The TextMate grammar that editors use: ``python -m lab docs words`` writes it.

Where a language server runs, its semantic tokens say more: the meaning of a name is beyond regular
expressions.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from typing import Any, Final

from scenelang.editors.highlighting import NAME, OPERATORS, WORDS
from scenelang.language import words
from scenelang.language.tables import tables


def textmate() -> dict[str, Any]:
    """The grammar as data."""
    return {
        "name": "scenelang",
        "scopeName": "source.nsg",
        "fileTypes": ["nsg"],
        "patterns": [{"include": f"#{name}"} for name in _REPOSITORY],
        "repository": {name: {"patterns": patterns} for name, patterns in _REPOSITORY.items()},
    }


def _any(texts: Iterable[str]) -> str:
    return "|".join(re.escape(text) for text in texts)


def _named(word: str, scope: str) -> dict[str, Any]:
    """A keyword and the name after it."""
    captures = {"1": {"name": f"keyword.declaration.{word}.nsg"}, "2": {"name": f"{scope}.nsg"}}
    return {"match": rf"\b({word})\s+({NAME})", "captures": captures}


def _between(begin: str, end: str, scope: str, **more: Any) -> dict[str, Any]:
    return {"begin": begin, "end": end, "name": f"{scope}.nsg", **more}


def _mark(kind: str) -> dict[str, Any]:
    return {"0": {"name": f"punctuation.definition.{kind}.nsg"}}


_UNITS: Final = _any(words.UNITS)
_REPOSITORY: Final[dict[str, list[dict[str, Any]]]] = {
    "comments": [
        _between("//", "$", "comment.line.double-slash", beginCaptures=_mark("comment")),
        _between(r"/\*", r"\*/", "comment.block", captures=_mark("comment")),
    ],
    "strings": [
        _between(
            *('"', '"|(?=$)', "string.quoted.double"),
            beginCaptures=_mark("string.begin"),
            endCaptures=_mark("string.end"),
            patterns=[
                {"match": r"\\[\"\\nt]", "name": "constant.character.escape.nsg"},
                {"match": r"\\.", "name": "invalid.illegal.escape.nsg"},
            ],
        )
    ],
    "declarations": [
        _named("fn", "entity.name.function"),
        _named("module", "entity.name.type.module"),
        _named("let", "variable.other.constant"),
        _named("param", "variable.parameter"),
    ],
    "keywords": [
        {"match": rf"\b(?:{_any(texts)})\b{after}", "name": f"{scope}.nsg"}
        for texts, after, _, scope in WORDS
    ],
    "names": [
        {"match": rf"{NAME}(?=\s*\{{)", "name": "entity.name.type.nsg"},
        {"match": rf"{NAME}(?=\s*\()", "name": "entity.name.function.call.nsg"},
        {"match": rf"{NAME}(?=\s*=(?!=))", "name": "variable.parameter.nsg"},
        {"match": NAME, "name": "variable.other.nsg"},
    ],
    "numbers": [
        {
            "match": tables().patterns["NUMBER"].replace(f"(?:{_UNITS})", f"({_UNITS})"),
            "name": "constant.numeric.nsg",
            "captures": {"1": {"name": "keyword.other.unit.nsg"}},
        },
        {"match": tables().patterns["COLOR"], "name": "constant.other.color.rgb-value.hex.nsg"},
    ],
    "signs": [
        {
            "match": _any(sorted(OPERATORS, key=len, reverse=True)),
            "name": "keyword.operator.nsg",
        },
        {"match": r"[{}]", "name": "punctuation.section.block.nsg"},
        {"match": r"[()]", "name": "punctuation.section.parens.nsg"},
        {"match": r"[\[\]]", "name": "punctuation.section.brackets.nsg"},
        {"match": ",", "name": "punctuation.separator.comma.nsg"},
        {"match": ";", "name": "punctuation.terminator.statement.nsg"},
    ],
}


def encode() -> str:
    """The text of the file."""
    return json.dumps(textmate(), indent=2, ensure_ascii=False) + "\n"
