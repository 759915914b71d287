"""The Pygments lexer: ``nsg`` in documentation, notebooks and on the command line (``pygmentize -l nsg``).

Registered under the entry point ``pygments.lexers``.
"""

from __future__ import annotations

import re
from typing import Any, ClassVar

from pygments import token
from pygments.lexer import RegexLexer, bygroups, words
from pygments.token import Comment, Keyword, Name, Number, String, Whitespace

from scenelang import words as nsg
from scenelang.syntax.tables import tables

_NAME, _STRING = tables().patterns["NAME"], tables().patterns["STRING"]
OPERATORS = [text for text in tables().literals if not text[0].isalpha() and text not in "()[]{},;"]
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
            (words(nsg.DECLARING, r"\b", r"\b"), Keyword.Declaration),
            (words(nsg.CONTROL, r"\b", r"\b"), Keyword),
            (words(nsg.NODES, r"\b", r"\b"), Keyword.Reserved),
            (words(nsg.MATERIAL, r"\b", r"\b"), Keyword.Type),
            (words(nsg.TRUTH, r"\b", r"\b"), Keyword.Constant),
            (words(nsg.CONSTANTS, r"\b", r"\b"), Name.Constant),
            (words(nsg.ANIMATED, r"\b", r"\b(?!\s*[({])"), Name.Variable.Magic),
            (words((*nsg.LANGUAGE, *nsg.STAGE), r"\b", r"\b(?=\s*\()"), Name.Builtin),
            (words(nsg.FUNCTIONS, r"\b", r"\b(?=\s*\()"), Name.Builtin.Pseudo),
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
