"""Writes what is made from the words of the language: ``python -m lab docs words``; a test compares.

- `grammar/scenelang.tmLanguage.json`, the grammar for VS Code and others;
- the words of `editors/vim/syntax/nsg.vim`;
- `scenelang/web/editor/words.js`, for the editor of `scenelang play`;
- the tables of `docs/language.md` between comments that name them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from lab import ROOT
from lab.docs import textmate
from scenelang.editors import highlighting
from scenelang.language import words
from scenelang.language.tables import tables

_OR = r"\|"
TABLES = {
    "Functions": words.FUNCTIONS,
    "Definitions": {word: words.DECLARING[word] for word in ("let", "param", "fn", "module", "import")},
    "Settings": {**{word: words.DECLARING[word] for word in ("nsg", "model")}, **words.SETTINGS},
    "Transforms": words.TRANSFORMS,
    "Geometries": {name: words.Word(name, name, text) for name, text in words.GEOMETRIES.items()}
    | words.OUTLINES,
    "Texture": {name: word for name, word in words.OPERATIONS.items() if name not in words.TRANSFORMS},
}
KEYWORDS = {
    "Declare": words.DECLARING,
    "Control": words.CONTROL,
    "Node": words.NODES,
    "Material": words.MATERIAL,
    "Truth": words.TRUTH,
    "Constant": words.CONSTANTS,
    "Animated": words.ANIMATED,
}
CALLS = {
    "Setting": words.SETTINGS,
    "Transform": words.TRANSFORMS | words.OPERATIONS,
    "Function": words.FUNCTIONS,
}


def table(title: str) -> str:
    """A table of words as Markdown."""
    rows = [(f"`{'`, `'.join(word.head.split(' or '))}`", word.text) for word in TABLES[title].values()]
    lines = [
        "| word | meaning |",
        "|---|---|",
        *(f"| {head} | {text.replace('|', _OR)} |" for head, text in rows),
    ]
    return "\n".join(lines) + "\n"


def vim() -> str:
    """The lines of Vim's syntax that list words."""
    exponent, end = r"\%([eE][-+]\?\d\+\)\?", rf"\%({_OR.join(words.UNITS)}\)\?\w\@!"
    return "".join(
        [
            *(f"syntax keyword nsg{group} {' '.join(known)}\n" for group, known in KEYWORDS.items()),
            *(f"syntax match nsg{group} {_called(known)}\n" for group, known in CALLS.items()),
            rf"syntax match nsgNumber /\<\d\+\%(\.\.\@!\d*\)\?{exponent}{end}/" + "\n",
            rf"syntax match nsgNumber /\w\@<!\.\d\+{exponent}{end}/" + "\n",
        ]
    )


def _called(known: Iterable[str]) -> str:
    return rf"/\<\%({_OR.join(known)}\)\>\ze\s*(/"


def script() -> str:
    """The words and terminals as a module of JavaScript."""
    known = [
        {"scope": scope, "words": [*texts], "after": after} for texts, after, _, scope in highlighting.WORDS
    ]
    terminals = {name: tables().patterns[name] for name in ("NAME", "NUMBER", "COLOR", "STRING")}
    signs = sorted(highlighting.OPERATORS, key=len, reverse=True)
    lines = "".join(f"  {json.dumps(entry)},\n" for entry in known)
    return (
        "// The words and terminals of the language, written by lab/docs/make_words.py.\n"
        f"export const WORDS = [\n{lines}];\n"
        f"export const TERMINALS = {json.dumps(terminals, indent=2, ensure_ascii=False)};\n"
        f"export const SIGNS = {json.dumps(signs)};\n"
    )


def _between(text: str, start: str, end: str, new: str) -> str:
    """A text with what stands between two lines replaced."""
    head, result, rest = text.partition(f"{start}\n")
    assert result, start
    return head + result + new + rest[rest.index(end) :]


def made() -> dict[Path, str]:
    """The text of each file."""
    grammar = ROOT / "grammar/scenelang.tmLanguage.json"
    syntax, page = ROOT / "editors/vim/syntax/nsg.vim", ROOT / "docs/language.md"
    text = page.read_text("utf-8")
    for title in TABLES:
        text = _between(text, f"<!-- words: {title} -->", "<!-- end -->", f"\n{table(title)}\n")
    coloured = _between(
        syntax.read_text("utf-8"), '" Words, written by lab/docs/make_words.py.', '" End of words', vim()
    )
    web = ROOT / "scenelang/web/editor/words.js"
    return {grammar: textmate.encode(), syntax: coloured, web: script(), page: text}


def main() -> None:
    for path, text in made().items():
        path.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
