"""Formatting a range changes the statements that it touches and nothing else."""

from __future__ import annotations

import random

import pytest

from scenelang.language.formatting import format_range, format_text
from scenelang.language.reports import SceneError
from tests.language.sameness import comments, tree_of
from tests.language.test_properties import TEXTS, words_of

TEXT = """let a=1;   // one
square   { scale( 2 ); }
let m=material flat { hue( 0 ); } ;
if(a){ b ; }
else{ c ; }   star{}
"""


def changed(text: str, start: int, end: int) -> str:
    low, high, new = format_range(text, start, end)
    return text[:low] + new + text[high:]


@pytest.mark.parametrize(
    ("word", "old", "new"),
    [
        ("let a", "let a=1;", "let a = 1;"),
        ("scale", "square   { scale( 2 ); }", "square { scale(2); }"),
        ("hue", "let m=material flat { hue( 0 ); } ;", "let m = material flat { hue(0); };"),
        ("else", "if(a){ b ; }\nelse{ c ; }", "if (a) { b; } else { c; }"),
        ("star", "star{}", "star {}"),
    ],
)
def test_one_statement(word: str, old: str, new: str) -> None:
    at = TEXT.index(word)
    assert changed(TEXT, at, at) == changed(TEXT, at, at + 2) == TEXT.replace(old, new)


def test_nothing_to_change() -> None:
    at = TEXT.index("// one") + 3
    assert format_range(TEXT, at, at + 2) == (at, at, "")
    neat = format_text(TEXT)
    assert format_range(neat, 0, len(neat))[2] == ""
    assert format_range("", 0, 0) == (0, 0, "")


def test_several_statements_with_what_stands_between() -> None:
    done = changed(TEXT, 0, TEXT.index("scale"))
    assert done == TEXT.replace(
        "let a=1;   // one\nsquare   { scale( 2 ); }", "let a = 1;  // one\nsquare { scale(2); }"
    )


def test_mistakes_anywhere_are_told() -> None:
    with pytest.raises(SceneError):
        format_range("a;\nb(;\n", 0, 1)


def test_a_line_that_repeats_is_not_lost() -> None:
    assert changed("a; b;\nb;\n", 0, 1) == "a; b;\nb;\n"
    assert changed("a  ; b;\nb;\n", 0, 4) == "a; b;\nb;\n"


@pytest.mark.parametrize("seed", range(40))
def test_any_range_keeps_the_scene(seed: int) -> None:
    generator = random.Random(seed)
    words = words_of(generator.choice([text for text in TEXTS.values() if len(text) < 2500]))
    text = "".join(word + generator.choice([" ", "\n", " // c\n", "  "]) for word in words)
    start, end = sorted((generator.randrange(len(text)), generator.randrange(len(text))))
    done = changed(text, start, end)
    assert tree_of(done) == tree_of(text)
    assert comments(done) == comments(text)
    assert format_text(done) == format_text(text)
