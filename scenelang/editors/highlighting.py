"""Colours for scene text: a Pygments lexer, registered under the entry point ``pygments.lexers``."""

from __future__ import annotations

import re
from typing import Any, ClassVar

from pygments import token
from pygments.lexer import RegexLexer, bygroups, words
from pygments.token import Comment, Keyword, Name, Number, String, Whitespace

from scenelang.language import words as nsg
from scenelang.language.tables import tables

NAME, _STRING = tables().patterns["NAME"], tables().patterns["STRING"]
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
_FREE = rf"(?!(?:{'|'.join(nsg.KEYWORDS)})\b){NAME}"


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
            (rf"{NAME}(?=\s*\{{)", Name.Class),
            (rf"{NAME}(?=\s*\()", Name.Function),
            (NAME, Name),
            (tables().patterns["NUMBER"], Number),
            (tables().patterns["COLOR"], Number.Hex),
            (_STRING, String.Double),
            (words(OPERATORS), token.Operator),
            (r"[()\[\]{},;]", token.Punctuation),
            (r"\.?[0-9][\w°]*|#\w*|\w+|\"[^\n\"]*", token.Error),
        ]
    }
