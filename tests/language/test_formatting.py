"""The canonical layout, of cases and of any text: tree and comments stay, twice changes nothing more."""

from __future__ import annotations

import dataclasses
import random
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scenelang.language.diagnostics import SourceFile, Span
from scenelang.language.formatting import Layout, format_range, format_text
from scenelang.language.lexer import Report, scan
from scenelang.language.reports import SceneError
from scenelang.language.tables import tables
from tests.language.reading import SCENES, read


def tree_of(text: str) -> object:
    """The tree of a text without mistakes, its spans left out."""
    tree, diagnostics = read(text)
    assert diagnostics == [], text
    return without_spans(tree)


def without_spans(value: Any) -> list[object]:
    """A tree as the list of its nodes from the root down, each with the number or names of what it holds.

    A list, because deep trees would take all of Python's frames to walk and to compare.
    """
    found: list[object] = []
    left = [value]
    while left:
        value = left.pop()
        if dataclasses.is_dataclass(value):
            fields = [(f.name, getattr(value, f.name)) for f in dataclasses.fields(value)]
            kept = [(name, held) for name, held in fields if not isinstance(held, Span)]
            found.append((type(value).__name__, *(name for name, _ in kept)))
            left += [held for _, held in reversed(kept)]
        elif isinstance(value, tuple):
            found.append(("tuple", len(value)))
            left += reversed(value)
        else:
            found.append(value)
    return found


def comments(text: str) -> list[str]:
    """All comments in order, read sign by sign, with the white space at the ends of their lines taken off."""
    found: list[str] = []
    at = 0
    while at < len(text):
        if text[at] == '"':
            at += 1
            while text[at] != '"':
                at += 2 if text[at] == "\\" else 1
            at += 1
        elif text.startswith(("//", "/*"), at):
            line = text[at + 1] == "/"
            end = text.find("\n" if line else "*/", at + 2)
            end = len(text) if end < 0 else end if line else end + 2
            found.append("\n".join(part.strip() for part in text[at:end].split("\n")))
            at = end
        else:
            at += 1
    return found


GOLDEN = re.findall(
    r"^//// (?!becomes)(.*)\n([\s\S]*?)^//// becomes\n([\s\S]*?)(?=^////|\Z)",
    Path(__file__).with_name("golden.nsgs").read_text("utf-8"),
    re.MULTILINE,
)


@pytest.mark.parametrize(("before", "after"), [pytest.param(*pair, id=name) for name, *pair in GOLDEN])
def test_golden(before: str, after: str) -> None:
    assert format_text(before) == after
    assert format_text(after) == after
    assert tree_of(after) == tree_of(before)


def test_every_rule_is_laid_out() -> None:
    names = {name for _, _, name in tables().rules if name and not name.startswith("bad_")}
    assert not [name for name in names if not callable(getattr(Layout, name, None))]


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_line_ends_and_byte_order_mark_stay(newline: str, mark: str) -> None:
    before = "square   {}// a\n\n\n/* b\n   c */\nstar{}"
    after = "square {}  // a\n\n/* b\n   c */\nstar {}\n"
    assert format_text(mark + before.replace("\n", newline)) == mark + after.replace("\n", newline)


def test_first_line_end_decides() -> None:
    assert format_text("a;\r\nb;\nc;\n") == "a;\r\nb;\r\nc;\r\n"
    assert format_text("a;\nb;\r\nc;\r\n") == "a;\nb;\nc;\n"


def test_last_line_ends() -> None:
    assert format_text("a;") == "a;\n"
    assert format_text("// a") == "// a\n"


def test_numbers_and_strings_stay_as_written() -> None:
    text = 'f(1.0, 1., .50, 1E+3, 0x, #FFF, #AbCdEf, "a\\tb  c", 007);\n'.replace("0x, ", "")
    assert format_text(text) == text


def test_white_space_of_all_kinds_is_white_space() -> None:
    assert format_text("a;\t\x0b\x0c\u00a0\u2003b;\r\rc;") == "a;\nb;\nc;\n"


def test_mistakes_are_told_in_the_text_as_given() -> None:
    with pytest.raises(SceneError) as caught:
        format_text("a;\r\nsquare {\r\n  scale(;\r\n}\r\n", name="some.nsg")
    spans = [d.span for d in caught.value.diagnostics]
    assert spans
    assert spans[0] is not None
    assert (spans[0].source.name, spans[0].locate()[0]) == ("some.nsg", (3, 8))


# ---------------------------------------------------------------- whatever is laid out

ROOT = Path(__file__).parents[2]
FILES = sorted([*(ROOT / "examples").rglob("*.nsg"), *(ROOT / "tests/conformance").rglob("*.nsg"), *SCENES])
TEXTS = {str(path.relative_to(ROOT)): path.read_text("utf-8") for path in FILES}
COMMENTS = [
    "// a\n",
    "\n// own\n",
    "/* b */",
    "\n/* c */\n",
    "/* d */\n",
    "\n /* e */ ",
    "\n\n",
    "/* m\n   n */",
    "\n\n\n  // x\n\n",
    "\t/* tab\n\t\tq */\t",
    "/**/",
    "// trailing \t \n",
]


def holds(text: str) -> str:
    """What must hold for any text without mistakes; returns the formatted text."""
    result = format_text(text)
    assert tree_of(result) == tree_of(text)
    assert comments(result) == comments(text)
    assert format_text(result) == result
    assert not re.search(r"[ \t]$", result, re.MULTILINE) or "/*" in text
    assert "\n\n\n" not in result or "/*" in text
    assert result == "" or (result.endswith("\n") and not result.endswith("\n\n"))
    return result


def words_of(text: str) -> list[str]:
    source = SourceFile("", text)
    tokens = scan(source, Report(source))
    return [text[start:end] for start, end in zip(tokens.starts[:-1], tokens.ends[:-1], strict=True)]


@pytest.mark.parametrize("name", TEXTS)
def test_files(name: str) -> None:
    result = holds(TEXTS[name])
    assert max(map(len, re.sub(r"//.*", "", result).split("\n"))) <= 100


@pytest.mark.parametrize("name", TEXTS)
def test_layout_of_the_author_does_not_matter(name: str) -> None:
    """Without comments and blank lines, the same tokens come out the same, however they were laid out."""
    words = words_of(TEXTS[name])
    generator = random.Random(name)
    first = holds(" ".join(words))
    for gaps in ([" "], ["\n"], [" ", "\n", "\t", "  \n  "]):
        mutated = "".join(word + generator.choice(gaps) for word in words)
        assert holds(mutated) == first


@pytest.mark.parametrize("rate", [0.02, 0.1, 0.3, 0.9])
@pytest.mark.parametrize("seed", range(6))
def test_comments_anywhere(seed: int, rate: float) -> None:
    """Comments between any two tokens of real scenes."""
    generator = random.Random(f"{seed} {rate}")
    words = words_of(generator.choice([text for text in TEXTS.values() if len(text) < 3000]))
    text = ""
    for word in words:
        gaps = generator.choices(COMMENTS, k=generator.choice((1, 1, 2)))
        text += word + " " + (" ".join(gaps) if generator.random() < rate else "")
    holds(text)


@settings(max_examples=60, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_refuses_exactly_what_the_parser_refuses(data: st.DataObject) -> None:
    """A text is formatted if and only if the parser finds no mistake; the mistakes told are the parser's."""
    words = words_of(data.draw(st.sampled_from([text for text in TEXTS.values() if len(text) < 1500])))
    odd = ['"\\q"', '"\\n"', "1e999", "9" * 400, "(1).x(2)", "a.b(1)", "]", "let", "@", "1.5e3deg", "0.1"]
    for _ in range(data.draw(st.integers(0, 3))):
        at = data.draw(st.integers(0, len(words) - 1))
        words[at] = data.draw(st.sampled_from([*odd, *tables().literals]))
    text = " ".join(words)
    mistakes = read(text, "<text>")[1]
    if not mistakes:
        holds(text)
        return
    if all(d.severity == "warning" for d in mistakes):  # stray semicolons, which go
        holds(format_text(text))
        return
    with pytest.raises(SceneError) as caught:
        format_text(text)
    assert list(caught.value.diagnostics) == mistakes


def test_deep_nesting_is_no_trouble() -> None:
    depth = 190
    holds("let a = " + "(" * depth + "1" + ")" * depth + ";")
    holds("group { " * depth + "}" * depth)
    holds("let a = " + "[" * depth + "]" * depth + ";")
    holds("let a = " + "f(x, " * depth + "1" + ")" * depth + ";")
    holds("if (a) {} else " * depth + "{}")
    holds("let a = " + " + ".join(["a"] * depth) + ";")
    holds("let a = " + " ^ ".join(["a"] * depth) + ";")
    holds("let a = " + "c ? b : " * depth + "a;")


# ---------------------------------------------------------------- ranges

RANGED = """let a=1;   // one
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
    at = RANGED.index(word)
    assert changed(RANGED, at, at) == changed(RANGED, at, at + 2) == RANGED.replace(old, new)


def test_nothing_to_change() -> None:
    at = RANGED.index("// one") + 3
    assert format_range(RANGED, at, at + 2) == (at, at, "")
    neat = format_text(RANGED)
    assert format_range(neat, 0, len(neat))[2] == ""
    assert format_range("", 0, 0) == (0, 0, "")


def test_several_statements_with_what_stands_between() -> None:
    done = changed(RANGED, 0, RANGED.index("scale"))
    assert done == RANGED.replace(
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
