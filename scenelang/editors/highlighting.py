"""Colours for scene text: a Pygments lexer, and the TextMate grammar that editors use.

The lexer is registered under the entry point ``pygments.lexers``. ``python -m lab docs words`` writes the
grammar to `grammar/scenelang.tmLanguage.json`. Where a language server runs, its semantic tokens say more:
the meaning of a name is beyond regular expressions.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from typing import Any, ClassVar, Final

from pygments import token
from pygments.lexer import RegexLexer, bygroups, words
from pygments.token import Comment, Keyword, Name, Number, String, Whitespace

from scenelang.language import words as nsg
from scenelang.language.tables import tables

_NAME, _STRING = tables().patterns["NAME"], tables().patterns["STRING"]
OPERATORS = [text for text in tables().literals if not text[0].isalpha() and text not in "()[]{},;"]
WORDS = (
    (nsg.DECLARING, "", Keyword.Declaration, "keyword.declaration"),
    (nsg.CONTROL, "", Keyword, "keyword.control"),
    (nsg.NODES, "", Keyword.Reserved, "storage.type.node"),
    (nsg.MATERIAL, "", Keyword.Type, "storage.type.material"),
    (nsg.TRUTH, "", Keyword.Constant, "constant.language.boolean"),
    (nsg.CONSTANTS, "", Name.Constant, "constant.language"),
    (nsg.ANIMATED, r"(?!\s*[({])", Name.Variable.Magic, "variable.language"),
    (nsg.SETTINGS, r"(?=\s*\()", Name.Builtin, "support.function.setting"),
    (nsg.TRANSFORMS | nsg.OPERATIONS, r"(?=\s*\()", Name.Builtin, "support.function.transform"),
    (nsg.FUNCTIONS, r"(?=\s*\()", Name.Builtin.Pseudo, "support.function"),
)
"""Words, a pattern of the text after them, and their kinds for Pygments and for TextMate."""
_FREE = rf"(?!(?:{'|'.join(nsg.KEYWORDS)})\b){_NAME}"


class NsgLexer(RegexLexer):  # type: ignore[misc]  # Pygments has no types
    """Scenes of the scenelang language."""

    name = "scenelang"
    aliases: ClassVar[list[str]] = ["nsg", "scenelang"]
    filenames: ClassVar[list[str]] = ["*.nsg"]
    mimetypes: ClassVar[list[str]] = ["text/x-nsg"]
    version_added = ""
    flags = re.MULTILINE

    tokens: ClassVar[dict[str, list[Any]]] = {
        "root": [
            (r"[\s\ufeff]+", Whitespace),
            (r"//[^\n]*", Comment.Single),
            (r"/\*[\s\S]*?\*/", Comment.Multiline),
            (r"/\*[\s\S]*", token.Error),
            (rf"(fn)(\s+)({_FREE})", bygroups(Keyword.Declaration, Whitespace, Name.Function)),
            (rf"(module)(\s+)({_FREE})", bygroups(Keyword.Declaration, Whitespace, Name.Class)),
            (rf"(import)(\s+)({_STRING})", bygroups(Keyword.Namespace, Whitespace, String.Double)),
            *((words(texts, r"\b", rf"\b{after}"), kind) for texts, after, kind, _ in WORDS),
            (rf"{_NAME}(?=\s*\{{)", Name.Class),
            (rf"{_NAME}(?=\s*\()", Name.Function),
            (_NAME, Name),
            (tables().patterns["NUMBER"], Number),
            (tables().patterns["COLOR"], Number.Hex),
            (_STRING, String.Double),
            (words(OPERATORS), token.Operator),
            (r"[()\[\]{},;]", token.Punctuation),
            (r"\.?[0-9][\w°]*|#\w*|\w+|\"[^\n\"]*", token.Error),
        ]
    }


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
    return {"match": rf"\b({word})\s+({_NAME})", "captures": captures}


def _between(begin: str, end: str, scope: str, **more: Any) -> dict[str, Any]:
    return {"begin": begin, "end": end, "name": f"{scope}.nsg", **more}


def _mark(kind: str) -> dict[str, Any]:
    return {"0": {"name": f"punctuation.definition.{kind}.nsg"}}


_UNITS: Final = _any(nsg.UNITS)
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
        {"match": rf"{_NAME}(?=\s*\{{)", "name": "entity.name.type.nsg"},
        {"match": rf"{_NAME}(?=\s*\()", "name": "entity.name.function.call.nsg"},
        {"match": rf"{_NAME}(?=\s*=(?!=))", "name": "variable.parameter.nsg"},
        {"match": _NAME, "name": "variable.other.nsg"},
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
        {"match": _any(sorted(OPERATORS, key=len, reverse=True)), "name": "keyword.operator.nsg"},
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
