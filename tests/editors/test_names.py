"""Meanings of names, held against the evaluator; the context of a cursor; offsets, positions and edits."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsprotocol import types

import scenelang as nsg
from scenelang.editors.context import cursor_at
from scenelang.editors.workspace import Encoding, Lines, Workspace, difference
from scenelang.language import expressions, tree
from scenelang.language.builder import Site
from scenelang.language.definitions import Names
from scenelang.language.diagnostics import Diagnostics, SourceFile, Span
from scenelang.language.evaluation import Source
from scenelang.language.lexer import Report, Tokens, scan
from scenelang.language.parser import parse
from scenelang.language.session import Binding

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.nsg"))
SHADOWS = """
let a = 1;
fn f(b, c = b * a) = b + c + a + g(b);
fn g(a) = a;
module m(a, at = [a, a]) {
  let b = a;
  for (i in 0..<b) { let a = i; square { scale(a + b); translate(at); } }
  square { scale(a); let a = 2; rotate(a * 1deg); }
}
if (a == 1) { let a = 5; m(a); } else { m(a, at = [a, f(a)]); }
for (a in [a, a + 1]) { m(a); }
"""


def tokens_of(text: str) -> Tokens:
    source = SourceFile("a.nsg", text.replace("|", ""))
    return scan(source, Report(source))


def test_names_mean_what_they_mean_to_the_evaluator(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every variable that the evaluator resolves in a file is resolved to the same place."""
    resolved: list[tuple[Span, Span]] = []
    original = expressions.value_of

    def watched(name: tree.Name, binding: Binding, place: Site) -> object:
        if binding.span is not None and "." not in name.text:
            resolved.append((name.span, binding.span))
        return original(name, binding, place)

    monkeypatch.setattr(expressions, "value_of", watched)
    for text in (SHADOWS, *(path.read_text("utf-8") for path in EXAMPLES if path.stat().st_size < 1600)):
        file = parse(SourceFile("main.nsg", text), Diagnostics())
        resolved.clear()
        Source(tree=file, root=EXAMPLES[0].parent).scene(Diagnostics())
        names = Names(file)
        assert resolved or text is not SHADOWS
        for name, place in resolved:
            if name.source is file.span.source:
                use = names.at(name.start)
                assert use is not None, name
                assert use.symbol is not None, name
                assert use.symbol.span == place, name


PIECES = [
    *"{}()[];,\"'#x",
    "/*",
    "*/",
    "//",
    "\n",
    "let a = 3;",
    "star { }",
    "else { }",
    "30 deg",
    "in",
    "color: red;",
]


@given(st.lists(st.tuples(st.integers(0, 4000), st.integers(0, 30), st.sampled_from(PIECES)), max_size=4))
@settings(max_examples=8, deadline=None)
def test_a_text_that_is_typed_reads_as_if_it_were_new(edits: list[tuple[int, int, str]]) -> None:
    """Statements that are kept are as they would be read, with all places, mistakes and names."""
    row = "module m{0}(a = {0}) {{ star {{ rotate(a * 1deg); }} }} // note\nm{0}();\nlet b{0} = [{0}, X];\n"
    document = Workspace().put("untitled:a", "".join(map(row.format, range(50))), 1)
    assert not document.syntax
    for at, count, piece in edits:
        end = at if count > 15 else at + count
        change = types.TextDocumentContentChangePartial(document.lines.range(at, end), piece)
        document.change(change)
        diagnostics = Diagnostics()
        file = parse(document.source, diagnostics)
        assert document.syntax == tuple(diagnostics)
        assert document.names_at(at).top.names.keys() == Names(file).top.names.keys()
        seen, known = document.names_at(at).visible(at), Names(file).visible(at)
        assert [(s.name, s.span) for s in seen] == [(s.name, s.span) for s in known]
        assert document.file == file


def test_inside_a_module_named_like_a_leaf_the_bare_name_is_the_leaf() -> None:
    text = "module star(k) { star { scale(k); } if (k > 1) { star(1); } } star(2); star { }"
    scene = nsg.loads(
        "module star(k = 2) { star { scale(k); } if (k > 1) { star(1); } } star(3) { } star { }"
    )
    assert [[child.transforms[0].x for child in node.children] for node in scene.nodes] == [[3, 1], [2, 1]]
    names = Names(parse(SourceFile("", text), Diagnostics()))
    stars = [use for use in names.uses if use.text == "star"]
    assert [use.role if use.symbol is None else "module" for use in stars] == [
        "module",
        "geometry",
        *["module"] * 3,
    ]


BLOCKS = [
    ("|", "file", ""),
    ("group { | }", "group", "group"),
    ("group { for (i in 0..3) { | } }", "group", "group"),
    ("chain { smooth star { | } }", "object", "star"),
    ("chain { square; | }", "chain", "chain"),
    ("subtract { | }", "group", "subtract"),
    ("module m(a) { if (a) { } else { | } }", "group", "module"),
    ("square { material flat { | } }", "material", "material"),
    ("let m = material flat { | };", "material", "let"),
    ("let m = 1; square { m { | } }", "material", "m"),
    ("m(1) { | }", "object", "m"),
    ("square { group { a } | ", "object", "square"),
]
CALLS: list[tuple[str, str, int, str | None, set[str]]] = [
    ("f(|", "f", 0, None, set()),
    ("f(1, g(2, 3), |", "f", 2, None, set()),
    ("f(1, g(2, |", "g", 1, None, set()),
    ("f(a = 1, b = |", "f", 1, "b", {"a"}),
    ("f([1, 2, |], 3", "f", 0, None, set()),
    ("lib.f(1, |", "lib.f", 1, None, set()),
    ("square { scale(0.5, | ); }", "scale", 1, None, set()),
]


def test_blocks_and_calls_are_read_off_tokens() -> None:
    for text, kind, head in BLOCKS:
        values = frozenset({"m"}) if "let m" in text else frozenset()
        block = cursor_at(tokens_of(text), text.index("|"), values).block
        assert (block.kind, block.head) == (kind, head), text
    for text, *expected in CALLS:
        call = cursor_at(tokens_of(text), text.index("|")).call
        assert call is not None, text
        assert [call.name, call.index, call.named, call.given] == expected, text
    for text in ("if (|", "let a = (1 + |", "fn f(|", "for (i in |"):
        assert cursor_at(tokens_of(text), text.index("|")).call is None, text


TEXTS = st.text(st.sampled_from("ab\té𝄞\n\r\u2028\x0b"), max_size=30)
SIZES: dict[Encoding, int] = {"utf-8": 1, "utf-16": 2, "utf-32": 4}


def slow_position(text: str, offset: int, encoding: Encoding) -> tuple[int, int]:
    """Line and column by splitting what is before."""
    before = re.split(r"\r\n|\n|\r", text[:offset])
    name = encoding if encoding == "utf-8" else f"{encoding}-le"
    return len(before) - 1, len(before[-1].encode(name)) // SIZES[encoding]


@given(TEXTS, st.integers(0, 30), st.sampled_from(list(SIZES)))
def test_positions_are_those_of_the_protocol(text: str, offset: int, encoding: Encoding) -> None:
    offset = min(offset, len(text))
    if text[offset - 1 : offset + 1] == "\r\n":
        return  # between the two characters of a newline
    lines = Lines(text, encoding)
    place = lines.position(offset)
    assert (place.line, place.character) == slow_position(text, offset, encoding)
    assert lines.offset(place) == offset


@given(TEXTS, st.integers(0, 40), st.integers(0, 40), st.sampled_from(list(SIZES)))
def test_every_position_means_an_offset(text: str, line: int, character: int, encoding: Encoding) -> None:
    offset = Lines(text, encoding).offset(types.Position(line, character))
    assert 0 <= offset <= len(text)


@given(TEXTS, TEXTS)
def test_the_difference_makes_one_text_of_the_other(old: str, new: str) -> None:
    edit = difference(old, new)
    assert old[: edit.start] + new[edit.start : edit.new_end] + old[edit.old_end :] == new
    assert edit.start == edit.old_end == edit.new_end or old != new
