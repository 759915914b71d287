"""The Pygments lexer reads the tokens that the language's own lexer reads, and classes them rightly."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from pygments.lexers import get_lexer_by_name, get_lexer_for_filename
from pygments.token import Comment, Error, Keyword, Name, Number, Operator, Punctuation, String, Whitespace

from scenelang.editors.highlighting import NsgLexer
from scenelang.language.diagnostics import SourceFile
from scenelang.language.lexer import Report, scan
from scenelang.language.tables import tables
from tests.language.reading import SCENES

ROOT = Path(__file__).parents[2]
FILES = sorted([*(ROOT / "examples").rglob("*.nsg"), *(ROOT / "tests/conformance").rglob("*.nsg"), *SCENES])
CLASSES = {"NAME": Name, "NUMBER": Number, "STRING": String, "COLOR": Number.Hex}


def same_tokens(text: str) -> None:
    source = SourceFile("", text)
    tokens = scan(source, Report(source))
    read = list(NsgLexer().get_tokens_unprocessed(text))
    assert "".join(value for _, _, value in read) == text
    assert not [value for _, kind, value in read if kind in Error]
    seen = [found for found in read if found[1] not in Whitespace and found[1] not in Comment]
    starts, ends, kinds = tokens.starts[:-1], tokens.ends[:-1], tokens.kinds[:-1]
    assert [(start, value) for start, _, value in seen] == [
        (s, text[s:e]) for s, e in zip(starts, ends, strict=True)
    ]
    for (_, kind, value), number in zip(seen, kinds, strict=True):
        terminal = tables().kinds[number]
        if terminal in CLASSES:
            assert kind in CLASSES[terminal], (value, kind)
        elif terminal[0].isalpha():
            assert kind in Keyword, (value, kind)
        else:
            assert kind in Operator or kind in Punctuation, (value, kind)


def test_tokens_of_files() -> None:
    for path in FILES:
        same_tokens(path.read_text("utf-8"))


ODD = [
    *("0..3", "0..<4", "1.", ".5", "1.x", "5deg..6deg", "1e-3", "a.b"),
    *("lib.name(", "#d33..", "material", "t", "u {"),
]


@settings(max_examples=100)
@given(
    st.lists(st.sampled_from([*tables().literals, *ODD, "// c\n", "/* m\n */", '"s\\""', "\n"]), max_size=30)
)
def test_tokens_of_any_words(parts: list[str]) -> None:
    same_tokens(" ".join(parts))


def test_classes_that_readers_see() -> None:
    text = "fn f(x) = sin(x); module m() { square { scale(1); material flat; } } let a = t; f(1);"
    classes = {value: kind for _, kind, value in NsgLexer().get_tokens_unprocessed(text)}
    assert classes["f"] in Name.Function
    assert classes["m"] in Name.Class
    assert classes["square"] in Name.Class
    assert classes["sin"] in Name.Builtin
    assert classes["scale"] in Name.Builtin
    assert classes["t"] in Name.Variable
    assert classes["a"] is Name


def test_what_is_no_token_is_an_error() -> None:
    for text in ("@", "30degrees", "#ggg", '"open', "/* open", "é"):
        read = list(NsgLexer().get_tokens_unprocessed(text))
        assert "".join(value for _, _, value in read) == text
        assert any(kind in Error for _, kind, _ in read), text


def test_pygments_finds_it() -> None:
    assert isinstance(get_lexer_by_name("nsg"), NsgLexer)
    assert isinstance(get_lexer_for_filename("flower.nsg"), NsgLexer)
