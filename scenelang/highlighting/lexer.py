"""The Pygments lexer: ``nsg`` in documentation, notebooks and on the command line (``pygmentize -l nsg``).

Registered under the entry point ``pygments.lexers``.
"""

from __future__ import annotations

import re
from typing import Any, ClassVar

from pygments.lexer import RegexLexer, bygroups, words
from pygments.token import (
    Comment,
    Error,
    Keyword,
    Name,
    Number,
    Operator,
    Punctuation,
    String,
    Whitespace,
)

from scenelang.highlighting import words as nsg

_RESERVED = "|".join((*nsg.DECLARING, *nsg.CONTROL, *nsg.NODES, *nsg.MATERIAL, *nsg.TRUTH))
_FREE = rf"(?!(?:{_RESERVED})\b){nsg.NAME}"


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
            (r"/\*[\s\S]*", Error),
            (rf"(fn)(\s+)({_FREE})", bygroups(Keyword.Declaration, Whitespace, Name.Function)),
            (rf"(module)(\s+)({_FREE})", bygroups(Keyword.Declaration, Whitespace, Name.Class)),
            (rf"(import)(\s+)({nsg.STRING})", bygroups(Keyword.Namespace, Whitespace, String.Double)),
            (words(nsg.DECLARING, r"\b", r"\b"), Keyword.Declaration),
            (words(nsg.CONTROL, r"\b", r"\b"), Keyword),
            (words(nsg.NODES, r"\b", r"\b"), Keyword.Reserved),
            (words(nsg.MATERIAL, r"\b", r"\b"), Keyword.Type),
            (words(nsg.TRUTH, r"\b", r"\b"), Keyword.Constant),
            (words(nsg.CONSTANTS, r"\b", r"\b"), Name.Constant),
            (words(nsg.ANIMATED, r"\b", r"\b(?!\s*[({])"), Name.Variable.Magic),
            (words((*nsg.SETTINGS, *nsg.TRANSFORMS, *nsg.TEXTURE), r"\b", r"\b(?=\s*\()"), Name.Builtin),
            (words(nsg.FUNCTIONS, r"\b", r"\b(?=\s*\()"), Name.Builtin.Pseudo),
            (rf"{nsg.NAME}(?=\s*\{{)", Name.Class),
            (rf"{nsg.NAME}(?=\s*\()", Name.Function),
            (nsg.NAME, Name),
            (nsg.NUMBER, Number),
            (nsg.COLOR, Number.Hex),
            (nsg.STRING, String.Double),
            (words(nsg.OPERATORS), Operator),
            (words(nsg.PUNCTUATION), Punctuation),
            (r"\.?[0-9][\w°]*|#\w*|\w+|\"[^\n\"]*", Error),
        ]
    }
