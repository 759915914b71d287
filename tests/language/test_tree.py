"""What each statement and expression becomes, and where its span lies."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

from scenelang.language import tree as nodes
from scenelang.language.diagnostics import Span
from tests.language.reading import MALFORMED, SCENES, read, read_well


def expression(text: str) -> nodes.Expr:
    statement = read_well(f"let it = {text};").statements[0]
    assert isinstance(statement, nodes.Let)
    return statement.value


def test_numbers() -> None:
    for text, *meant in (
        ("1", 1, "", True),
        ("007", 7, "", True),
        (".5", 0.5, "", False),
        ("1.", 1, "", False),
        ("1e-3", 1e-3, "", False),
        ("2.5E+2", 250, "", False),
        ("30deg", 30, "deg", True),
        (".25turn", 0.25, "turn", False),
        ("1e3ms", 1000, "ms", False),
        ("2s", 2, "s", True),
    ):
        number = expression(text)
        assert isinstance(number, nodes.NumberLiteral)
        assert [number.value, number.unit, number.is_integer] == meant
        assert number.span.text == text


def test_colours() -> None:
    short, long = expression("#d3f"), expression("#DD33ff")
    assert isinstance(short, nodes.ColorLiteral)
    assert isinstance(long, nodes.ColorLiteral)
    assert short.rgb == long.rgb == (0xDD / 255, 0x33 / 255, 1.0)


def test_statements() -> None:
    text = """nsg 1; model "m"; canvas(2, 3); param k = 1 in 0..2; param j = 2; let a = 1;
    fn f(x, y = 2,) = x; fn g() = 1; module m() { } import "a.nsg" as lib;
    for (i in 0..3) { star; } if (a) { } else if (b) { } else { }
    group { } union { } smooth { } subtract { } intersect { } chain { star { } smooth lib.leaf(1) { } }
    mist; mist { hue(1turn); } material flat; material lib.red { }"""
    kinds = [type(statement).__name__ for statement in read_well(text).statements]
    assert kinds == (
        [
            "Version",
            "ModelStatement",
            "Call",
            "Param",
            "Param",
            "Let",
            "Fn",
            "Fn",
            "Module",
            "Import",
            "For",
            "If",
        ]
        + ["Node"] * 6
        + ["Call", "Call", "MaterialUse", "MaterialUse"]
    )


def test_calls() -> None:
    calls = [
        s for s in read_well("a; lib.b { } c(1); d(x = 1) { star; }").statements if isinstance(s, nodes.Call)
    ]
    assert [(c.name.text, c.args is not None, c.body is not None) for c in calls] == [
        ("a", False, False),
        ("lib.b", False, True),
        ("c", True, False),
        ("d", True, True),
    ]
    assert calls[3].args is not None
    assert calls[3].args[0].name is not None


def test_comments_and_empty_texts() -> None:
    tree = read_well("\ufeff// one\nstar; /* two\n * three */ star; /**/ //")
    assert len(tree.statements) == 2
    for text in ("", " ", "// nothing", "\n\n"):
        tree = read_well(text)
        assert (tree.statements, tree.span.start, tree.span.end) == ((), 0, len(text))


def check_spans(node: Any, within: Span) -> None:
    """Spans run forward and those of parts lie inside those of wholes."""
    if isinstance(node, Span):
        assert within.start <= node.start <= node.end <= within.end
    elif isinstance(node, tuple):
        for item in node:
            check_spans(item, within)
    elif is_dataclass(node):
        own = getattr(node, "span", within)
        check_spans(own, within)
        for field in fields(node):
            check_spans(getattr(node, field.name), own)


def test_spans_nest() -> None:
    for path in SCENES + MALFORMED:
        tree, found = read(path.read_text(encoding="utf-8"))
        check_spans(tree, tree.span)
        for text in [] if found else [statement.span.text for statement in tree.statements]:
            assert text[-1] in ";}"
            assert text[0].isalpha()
