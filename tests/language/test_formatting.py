"""The canonical layout, of cases and of any text: tree and comments stay, twice changes nothing more."""

from __future__ import annotations

import dataclasses
import random
import re
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scenelang.language.diagnostics import SourceFile, Span
from scenelang.language.formatting import FileLayout, format_range, format_text
from scenelang.language.lexer import Report, scan
from scenelang.language.reports import SceneError
from scenelang.language.tables import tables
from tests.language.reading import SCENES, read
from tests.language.shipped import EXAMPLES, PAGES, ROOT, formatted_page


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
    """All comments in order, with the white space at the ends of their lines taken off."""
    found = re.findall(r'"(?:\\.|[^"\\])*"|(//.*|/\*[\s\S]*?\*/)', text)
    return ["\n".join(part.strip() for part in comment.split("\n")) for comment in found if comment]


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
    unlaid = re.compile("(bad_.*|name_ref)?")
    names = {name for _, _, name in tables().rules if not unlaid.fullmatch(name)}
    assert not [name for name in names if not callable(getattr(FileLayout, name, None))]


def test_line_ends_and_byte_order_mark_stay() -> None:
    before = "square   {}// a\n\n\n/* b\n   c */\nstar{}"
    after = "square {}  // a\n\n/* b\n   c */\nstar {}\n"
    for newline, mark in product(("\n", "\r\n"), ("", "\ufeff")):
        assert format_text(mark + before.replace("\n", newline)) == mark + after.replace("\n", newline)
    assert format_text("a;\r\nb;\nc;\n") == "a;\r\nb;\r\nc;\r\n"
    assert format_text("a;\nb;\r\nc;\r\n") == "a;\nb;\nc;\n"
    assert format_text("a;") == "a;\n"
    assert format_text("// a") == "// a\n"


def test_numbers_and_strings_stay_and_white_space_of_all_kinds_goes() -> None:
    text = 'f(1.0, 1., .50, 1E+3, #FFF, #AbCdEf, "a\\tb  c", 007);\n'
    assert format_text(text) == text
    assert format_text("a;\t\x0b\x0c\u00a0\u2003b;\r\rc;") == "a;\nb;\nc;\n"


def test_mistakes_are_told_in_the_text_as_given() -> None:
    with pytest.raises(SceneError) as caught:
        format_text("a;\r\nsquare {\r\n  scale(;\r\n}\r\n", name="some.nsg")
    spans = [d.span for d in caught.value.diagnostics]
    assert spans
    assert spans[0] is not None
    assert (spans[0].source.name, spans[0].locate()[0]) == ("some.nsg", (3, 8))


# ---------------------------------------------------------------- whatever is laid out

MEND = "run python -m tests.language.shipped"
FILES = sorted([*EXAMPLES, *(ROOT / "tests/conformance").rglob("*.nsg"), *SCENES])
TEXTS = [path.read_text("utf-8") for path in FILES]
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


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_layout_of_the_author_does_not_matter(path: Path) -> None:
    """Without comments and blank lines, the same tokens come out the same, however they were laid out."""
    result = holds(path.read_text("utf-8"))
    assert max(map(len, re.sub(r"//.*", "", result).split("\n"))) <= 100
    assert result == path.read_text("utf-8") or "examples" not in path.parts, MEND
    words = words_of(result)
    generator = random.Random(path.name)
    first = holds(" ".join(words))
    for gaps in (["\n"], [" ", "\n", "\t", "  \n  "]):
        mutated = "".join(word + generator.choice(gaps) for word in words)
        assert holds(mutated) == first


@pytest.mark.parametrize("rate", [0.02, 0.1, 0.3, 0.9])
@pytest.mark.parametrize("seed", range(4))
def test_comments_anywhere(seed: int, rate: float) -> None:
    """Comments between any two tokens of real scenes."""
    generator = random.Random(f"{seed} {rate}")
    words = words_of(generator.choice([text for text in TEXTS if len(text) < 3000]))
    text = ""
    for word in words:
        gaps = generator.choices(COMMENTS, k=generator.choice((1, 1, 2)))
        text += word + " " + (" ".join(gaps) if generator.random() < rate else "")
    holds(text)


@settings(max_examples=60, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_refuses_exactly_what_the_parser_refuses(data: st.DataObject) -> None:
    """A text is formatted if and only if the parser finds no mistake; the mistakes told are the parser's."""
    words = words_of(data.draw(st.sampled_from([text for text in TEXTS if len(text) < 1500])))
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


def test_one_statement() -> None:
    for word, old, new in (
        ("let a", "let a=1;", "let a = 1;"),
        ("scale", "square   { scale( 2 ); }", "square { scale(2); }"),
        ("hue", "let m=material flat { hue( 0 ); } ;", "let m = material flat { hue(0); };"),
        ("else", "if(a){ b ; }\nelse{ c ; }", "if (a) { b; } else { c; }"),
        ("star", "star{}", "star {}"),
    ):
        at = RANGED.index(word)
        assert changed(RANGED, at, at) == changed(RANGED, at, at + 2) == RANGED.replace(old, new)
    done = changed(RANGED, 0, RANGED.index("scale"))
    old, new = "let a=1;   // one\nsquare   { scale( 2 ); }", "let a = 1;  // one\nsquare { scale(2); }"
    assert done == RANGED.replace(old, new)
    # A line that repeats is not lost.
    assert changed("a; b;\nb;\n", 0, 1) == "a; b;\nb;\n"
    assert changed("a  ; b;\nb;\n", 0, 4) == "a; b;\nb;\n"


def test_nothing_to_change() -> None:
    at = RANGED.index("// one") + 3
    assert format_range(RANGED, at, at + 2) == (at, at, "")
    neat = format_text(RANGED)
    assert format_range(neat, 0, len(neat))[2] == ""
    assert format_range("", 0, 0) == (0, 0, "")
    with pytest.raises(SceneError):
        format_range("a;\nb(;\n", 0, 1)


@pytest.mark.parametrize("seed", range(25))
def test_any_range_keeps_the_scene(seed: int) -> None:
    generator = random.Random(seed)
    words = words_of(generator.choice([text for text in TEXTS if len(text) < 2500]))
    text = "".join(word + generator.choice([" ", "\n", " // c\n", "  "]) for word in words)
    start, end = sorted((generator.randrange(len(text)), generator.randrange(len(text))))
    done = changed(text, start, end)
    assert tree_of(done) == tree_of(text)
    assert comments(done) == comments(text)
    assert format_text(done) == format_text(text)


# ---------------------------------------------------------------- what people copy


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_scenes_of_pages_are_formatted(path: Path) -> None:
    text = path.read_text("utf-8")
    assert formatted_page(text) == text, MEND


def test_a_page_is_changed_in_its_scenes_alone() -> None:
    page = "a  b\n\n```nsg W0401\nstar   {}\n```\n\n```sh\na  b\n```\n\n```nsg\nstar {{\n```\n"
    assert formatted_page(page) == page.replace("star   {}", "star {}")
