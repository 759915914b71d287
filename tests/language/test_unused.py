"""Unused names: what is one, what is none, and what the fix does."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile, apply_fixes
from scenelang.language.parser import parse
from scenelang.language.resolve import find_unused
from tests.language.cases import run_text

ROOT = Path(__file__).parents[2]


def unused(text: str) -> list[Diagnostic]:
    found = Diagnostics()
    find_unused(parse(SourceFile("a.nsg", text), found), found)
    return list(found)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("let a = 1; square {}", ["a"]),
        ("let a = 1; let b = a; square {}", ["b"]),
        ("param a = 1; square {}", ["a"]),
        ("fn f(x) = x; square {}", ["f"]),
        ("fn f(x) = x < 1 ? 0 : f(x - 1); square {}", ["f"]),
        ("fn f(x) = g(x); fn g(x) = x; square { scale(f(1)); }", []),
        ("module m(x) { square {} } star {}", ["m"]),
        ("module m(x) { square {} } m(1);", []),
        ("module m() { let a = 1; square {} } m();", ["a"]),
        ("group { let a = 1; square {} }", ["a"]),
        ("let a = 1; group { let a = 2; square { scale(a); } }", ["a"]),
        ("let a = 1; group { square { scale(a); } let a = 2; star { scale(a); } }", []),
        ("for (i in 0..3) { square {} }", []),
        ("for (i in 0..3) { let a = i; square {} }", ["a"]),
        (
            "if (true) { let a = 1; } else if (false) { let b = 1; } else { let c = 1; } square {}",
            ["a", "b", "c"],
        ),
        ("let a = 2; canvas(a, a); square {}", []),
        ("let m = material flat; square { m; }", []),
        ("let m = material flat { hue(1deg); }; square { m { hue(2deg); } }", []),
        ("let c = #d33; let m = material flat { color(c); }; square { m; }", []),
        ("let v = [1, 2]; square { scale(v.x); translate(v[0], v.y); }", []),
        ("let n = 2; for (i in 0..n step n) { square {} }", []),
        ("let a = true; let b = 1; let d = 2; square { scale(a ? -b : 3 * d); }", []),
        ("param k = 1; fn f(a = k) = a; square { scale(f()); }", []),
        ("let _a = 1; square {}", []),
        ("let a = 1; fn f(x) = x; module m() { square {} }", []),
        ("module m() { let a = 1; square {} }", ["a"]),
        ('import "lib.nsg" as lib; square {}', ["lib"]),
        ('import "lib.nsg" as lib; let a = 1;', ["lib"]),
        ('import "lib.nsg" as lib; lib.ball(1);', []),
        ('import "lib.nsg" as lib; square { scale(lib.a.x + lib.f(1)); }', []),
        ("chain { square {} let a = 2; subtract star { scale(a); } }", []),
    ],
)
def test_what_is_unused(text: str, names: list[str]) -> None:
    found = unused(text)
    assert sorted(d.span.text for d in found if d.span) == names
    assert {d.code for d in found} <= {"W0201"}


@pytest.mark.parametrize(
    ("text", "after"),
    [
        ("let a = 1; square {}\n", "let _a = 1; square {}\n"),
        ("let a = 1; let _a = 2; square { scale(_a); }", None),
        ("param a = 1; square {}", None),
        ('import "lib.nsg" as lib;\nsquare {}\n', "square {}\n"),
        ('import "lib.nsg" as lib; square {}\n', "square {}\n"),
        ('nsg 1; import "lib.nsg" as lib; // parts\nsquare {}\n', "nsg 1; // parts\nsquare {}\n"),
    ],
)
def test_fixes(text: str, after: str | None) -> None:
    now, applied = apply_fixes(text, unused(text))
    assert now == (text if after is None else after)
    assert bool(applied) == (after is not None)
    if after is not None:
        assert unused(now) == []
        run_text(now).good()


@pytest.mark.parametrize("path", sorted((ROOT / "examples").rglob("*.nsg")), ids=lambda path: path.name)
def test_examples_use_what_they_define(path: Path) -> None:
    assert unused(path.read_text("utf-8")) == []
