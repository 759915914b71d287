"""Whatever a program and its layout: tree and comments stay, and formatting twice changes nothing more."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scenelang.language.diagnostics import SourceFile
from scenelang.language.formatting import format_text
from scenelang.language.lexer import Report, scan
from scenelang.language.reports import SceneError
from scenelang.language.tables import tables
from tests.language.reading import SCENES, read
from tests.language.sameness import comments, tree_of

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
