"""Every fix mends: where a text has one mistake, applying its fix leaves none and brings no other."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile, apply_fixes, settle
from scenelang.language.evaluation import Source
from scenelang.language.lexer import Tokens
from scenelang.language.pages import CODES, read_page
from scenelang.language.parser import parse
from scenelang.language.resolve import find_unused

TESTS = Path(__file__).parents[1]
SINGLE = [
    *(
        (f"page of {code}", example.text)
        for code in CODES
        for example in read_page(code).examples
        if (example.kind, example.language) == ("bad", "nsg") and not example.options and not example.limits
    ),
    *(
        case.partition("\n")[::2]
        for case in (TESTS / "language/errors.nsgs").read_text("utf-8").split("=== ")[1:]
        if len(re.findall(r"//!.*", case)) == 1
    ),
]
SINGLE += [
    ("a keyword twice", "let let a = 1; square { scale(a); }"),
    ("a comma twice", "square { scale(0.5,, 0.5); }"),
    ("a word twice with a comment between", "for (i in /* to */ in 0..3) { square {} }"),
    ("an invisible space", "square { sc\u200bale(0.5); }"),
    ("a control character", "square { scale(0.5); }\x07"),
]
MANY = sorted(
    path for name in ("malformed", "mistaken") for path in (TESTS / "language" / name).glob("*.nsg")
)

EXAMPLES = sorted((TESTS.parent / "examples").glob("*.nsg"))


def check(text: str) -> list[Diagnostic]:
    found = Diagnostics()
    source = SourceFile("a.nsg", text)
    Source(text=source, root=TESTS.parent / "examples").scene(found)
    if not found.errors:
        find_unused(parse(source, Diagnostics()), found)
    return list(found)


# Their one mistake hides others on purpose.
HIDING = {"reported once in a loop", "poison is silent"}
FIXABLE = [
    (title, text)
    for title, text in SINGLE
    if title not in HIDING and sum(d.fix is not None for d in check(text)) == 1
]


@pytest.mark.parametrize(("title", "text"), FIXABLE, ids=[title for title, _ in FIXABLE])
def test_a_fix_mends(title: str, text: str) -> None:
    before = check(text)
    after, applied = apply_fixes(text, before)
    assert len(applied) == 1
    left = [d.code for d in check(after) if d.code != "W0201"]
    others = [d.code for d in before if d is not applied[0]]
    assert left == others, after


def test_most_kinds_of_mistakes_that_can_be_mended_are() -> None:
    """A list to keep in step: codes whose page has an example that is mended by itself."""
    mended = {title.removeprefix("page of ") for title, _ in FIXABLE if title.startswith("page of ")}
    assert mended == {
        *("E0102", "E0107", "E0111", "E0114", "E0116", "E0117", "E0119"),
        *("E0123", "E0126", "E0127", "E0130", "E0132", "E0133", "W0101"),
        *("E0201", "E0204", "E0206", "E0208", "W0201"),
        *("E0302", "E0334", "E0335"),
    }


@pytest.mark.parametrize("path", MANY, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_fixes_of_many_mistakes_come_to_rest(path: Path) -> None:
    text = path.read_text("utf-8")
    before = check(text)
    done = settle({"one": text}, lambda texts: [("one", d) for d in check(texts["one"])])
    assert done.stable
    assert not any(d.fix for _, d in done.left)
    assert len(done.left) <= len(before)


def place(tokens: Tokens, index: int) -> tuple[int, int]:
    return tokens.starts[index], tokens.ends[index]
