"""Random texts never crash the parser; one slip in a sound file is reported once, near where it is."""

from __future__ import annotations

import random
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenelang.language.diagnostics import SourceFile
from scenelang.language.lexer import Report, scan
from scenelang.language.tables import tables
from tests.language.reading import SCENES, read
from tests.language.test_tree import check_spans

OTHERS = ["star", "scale", "1", "0.5", "30deg", "1.2.3", '"s"', '"s', "'q'", "#d33", "#d", "/*", "*/", "//"]
WORDS = [*tables().literals, *OTHERS, "@", "é", "\\", "&", "**", "\n"]
INSERTED = ["{", "}", "(", ")", "]", ";", ",", "=", "+", "..", "x", "let", "if", "3", "#d33"]
TEXTS = [path.read_text(encoding="utf-8") for path in SCENES]


def sound(text: str) -> None:
    """A tree comes back, its spans are in order, and every diagnostic has a place in the text."""
    tree, diagnostics = read(text)
    assert tree.span.end == len(text)
    check_spans(tree, tree.span)
    for diagnostic in diagnostics:
        assert diagnostic.span is not None
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)


@settings(max_examples=150)
@given(st.text(max_size=200))
def test_any_text(text: str) -> None:
    sound(text)


@settings(max_examples=300)
@given(st.lists(st.sampled_from(WORDS), max_size=60))
def test_any_words(words: list[str]) -> None:
    sound(" ".join(words))


@settings(max_examples=150)
@given(st.sampled_from(TEXTS), st.data())
def test_any_few_changes(text: str, data: st.DataObject) -> None:
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(text)))
        end = data.draw(st.integers(at, min(at + 20, len(text))))
        text = text[:at] + data.draw(st.sampled_from([*WORDS, ""])) + text[end:]
    sound(text)


def slips(text: str, generator: random.Random) -> tuple[str, str, int]:
    """A text with one token deleted, inserted or exchanged with the next; what was done and on which line."""
    source = SourceFile("sound.nsg", text)
    tokens = scan(source, Report(source))
    index = generator.randrange(len(tokens.kinds) - 2)
    start, end = tokens.starts[index], tokens.ends[index]
    line = source.position(start)[0]
    kind = generator.choice(("deletion", "insertion", "exchange"))
    if kind == "deletion":
        return text[:start] + text[end:], kind, line
    if kind == "insertion":
        word = generator.choice(INSERTED)
        return f"{text[:start]}{word} {text[start:]}", kind, line
    after, stop = tokens.starts[index + 1], tokens.ends[index + 1]
    return (
        f"{text[:start]} {text[after:stop]} {text[end:after]} {text[start:end]} {text[stop:]}",
        kind,
        line,
    )


@pytest.mark.parametrize("seed", range(4))
def test_one_slip_is_one_diagnostic(seed: int) -> None:
    generator = random.Random(seed)
    outcomes: Counter[str] = Counter()
    for _ in range(150):
        text, kind, line = slips(generator.choice(TEXTS), generator)
        sound(text)
        _, diagnostics = read(text)
        if not diagnostics:
            continue  # still a sentence of the language
        assert len(diagnostics) <= 3, text
        first = diagnostics[0].span
        assert first is not None
        near = abs(first.locate()[0][0] - line) <= 1
        outcomes["one" if len(diagnostics) == 1 and near else kind] += 1
    assert outcomes["one"] >= 0.95 * outcomes.total(), outcomes


def test_several_slips_are_as_many_diagnostics() -> None:
    """Five slips in a file of 40 lines, each of which is one diagnostic by itself, are five together."""
    text = "\n".join(scene.replace("nsg 1;", "", 1) for scene in TEXTS)
    source = SourceFile("sound.nsg", text)
    tokens = scan(source, Report(source))
    generator = random.Random(5)
    right = 0
    for _ in range(40):
        chosen: dict[int, tuple[int, int, str]] = {}
        while len(chosen) < 5:
            index = generator.randrange(len(tokens.kinds) - 2)
            start, end = tokens.starts[index], tokens.ends[index]
            line = source.position(start)[0]
            new = generator.choice(["", f"{generator.choice(INSERTED)} {text[start:end]}"])
            alone = read(text[:start] + new + text[end:])[1]
            if len(alone) == 1 and all(abs(line - other) > 3 for other in chosen):
                chosen[line] = start, end, new
        changed = text
        for start, end, new in sorted(chosen.values(), reverse=True):
            changed = changed[:start] + new + changed[end:]
        right += len(read(changed)[1]) == 5
    assert right >= 38
