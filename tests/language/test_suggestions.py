"""What is said about unknown names, and what is passed over after a syntax mistake."""

from __future__ import annotations

import pytest

from scenelang.language import foreign
from scenelang.language.diagnostics import SourceFile, Span, apply_fixes, did_you_mean, ranked
from scenelang.language.values import FUNCTIONS
from scenelang.language.words import LANGUAGE, STAGE
from tests.language.cases import Outcome, run_text
from tests.language.reading import apply

SPAN = Span(SourceFile("x", "x"), 0, 1)


def mended(text: str, outcome: Outcome) -> str:
    """The text with the fix of its only diagnostic made."""
    fix = outcome.only().fix
    assert fix is not None
    return apply(text, fix)


MENDED = [
    ("square { translate(pi, 0); }", "square { translate(PI, 0); }"),
    ("if (True) { square {} }", "if (true) { square {} }"),
    ("background(None);", "background(none);"),
    ("background(null);", "background(none);"),
    ("square { material flat { color(Red); } }", "square { material flat { color(#f00); } }"),
    ("square { zoom(0.5); }", "square { scale(0.5); }"),
    ("square { material flat { colour(#d33); } }", "square { material flat { color(#d33); } }"),
    ("intersection { square {} star {} }", "intersect { square {} star {} }"),
    ("gruop { square {} }", "group { square {} }"),
    ("if (true) { square {} } esle { star {} }", "if (true) { square {} } else { star {} }"),
    (
        "if (true) { square {} } elif (true) { star {} }",
        "if (true) { square {} } else if (true) { star {} }",
    ),
    (
        "let far_off = 1; square { translate(faroff, 0); }",
        "let far_off = 1; square { translate(far_off, 0); }",
    ),
    ("square { translate(srqt(2), 0); }", "square { translate(sqrt(2), 0); }"),
    ("let sizes = 1; square { scale(size); }", "let sizes = 1; square { scale(sizes); }"),
    ("square { rotate(45); }", "square { rotate(45deg); }"),
    ("square { rotate(-45); }", "square { rotate(-45deg); }"),
    ("square { rotate(1.5); }", "square { rotate(1.5rad); }"),
    ("square { rotate((45)); }", "square { rotate((45deg)); }"),
    ("square { material flat { hue(0.1); } }", "square { material flat { hue(0.1turn); } }"),
    ("square { material flat { hue(200); } }", "square { material flat { hue(200deg); } }"),
    ("squar { scale(2); }", "square { scale(2); }"),
    ("square { rotat(45deg); }", "square { rotate(45deg); }"),
    ("let size = 1; square { scale(sise); }", "let size = 1; square { scale(size); }"),
    ("square { material falt; }", "square { material flat; }"),
    ("square { rotate(angel = 45deg); }", "square { rotate(angle = 45deg); }"),
    ("chain { smooth square {} star {} }", "chain { square {} star {} }"),
    ("let m = material flat; square { material m; }", "let m = material flat; square { m; }"),
]


def test_one_fix_mends() -> None:
    wrong = []
    for bad, good in MENDED:
        after = mended(bad, run_text(bad)).replace("  ", " ")
        if after != good or run_text(good).codes:
            wrong.append((bad, after))
    assert wrong == []
    assert run_text("let ab = 1; square { translate(ba, 0); }").only().fix is None


@pytest.mark.parametrize(
    ("text", "help"),
    [
        ("difference { square {} star {} }", "it is called `subtract` here"),
        ("square { translate(vec2(1, 2)); }", "write [x, y]"),
        (
            "legs(side, paint) { square { scale(side); } }",
            "to define it write module legs(side, paint) { … }",
        ),
        ("let a = 1; let e = 2; square { scale(nothing); }", None),
        ("square { scale(zz); }", None),
    ],
)
def test_help(text: str, help: str | None) -> None:
    assert run_text(text).only().help == help


def test_an_unknown_name_is_reported_once_with_its_other_places() -> None:
    found = run_text("square { scale(nope); translate(nope, 0); }\nstar { scale(nope); }").only()
    assert found.code == "E0201"
    assert [label.span.locate()[0] for label in found.labels] == [(1, 33), (2, 14)]


def test_ranking() -> None:
    assert [name for _, name in ranked("tranlsate", ["translate", "transpose"])] == ["translate"]
    assert ranked("Size", ["size", "sizes"])[0][1] == "size"
    assert ranked("scal", ["scale", "scan"])[0][0] == ranked("scal", ["scan"])[0][0] == 1
    assert did_you_mean("scal", ["scale", "scan"], SPAN) == ("did you mean `scale` or `scan`?", None)
    assert did_you_mean("x", ["y", "z"], SPAN) == (None, None)
    assert did_you_mean("foo", ["bar", "baz"], SPAN) == (None, None)


def test_words_of_other_languages_lead_to_words_of_this_one() -> None:
    ours = LANGUAGE | {
        "square",
        "sphere",
        "torus",
        "union",
        "smooth",
        "intersect",
        "subtract",
        "material",
        "else if",
        *STAGE,
    }
    assert set(foreign.WORDS.values()) <= ours
    assert not set(foreign.WORDS) & ours
    assert not set(foreign.FUNCTIONS) & set(FUNCTIONS)


@pytest.mark.parametrize(
    "text",
    [
        "let = 0.5;\nsquare { scale(size); }",  # the name is lost
        "let size 0.5 0.6;\nsquare { scale(size); }",
        "animate(seconds 2);\nsquare { scale(1 + u); }",
        'import "a.nsg" a;\na.dot(1);\nsquare { scale(a.size); }',
        "square {\n  scale(1, );\n  translate(0.1 0.2);\n}",
        "group {\n  square { scale(0.5);\n}\nrotate(10deg);\nstar { }",  # what stands where?
        "fn half(x) = x / ;\nlet a = half(1, 2);",
        "for (i 0..3) { square { translate(i, 0); } }",
        "module dot(at) { square { translate(at.x, at.y); } }\ndot(at = [1, 2);",
        "param k = ;\nsquare { scale(k); rotate(k); }",
    ],
)
def test_a_syntax_mistake_has_no_consequences(text: str) -> None:
    outcome = run_text(text)
    assert {code[:3] for code in outcome.codes} == {"E01"}
    assert outcome.scene is None


def test_mistakes_elsewhere_are_reported_beside_one_of_syntax() -> None:
    text = "let a = 1\nsquare { scale(nope); }\nstar { rotate(30); }\ntriangle { falt; }\n"
    assert sorted(run_text(text).codes) == ["E0102", "E0201", "E0204", "E0302"]


@pytest.mark.parametrize(
    "text",
    [
        "square { scale(2 ** nope); }",  # a sign
        "square { scale(0.5f); translate(nope, 0); }",  # a number
        "square { rotate(30 deg); translate(nope, 0); }",
        "const a = nope;\nsquare { scale(a); }",  # a word
        "if (true and nope) { square; }",
    ],
)
def test_what_a_fix_mends_for_sure_hides_nothing(text: str) -> None:
    """Both are reported at once, and the second is what is left when the first is mended."""
    first, second = sorted(run_text(text).diagnostics, key=lambda d: d.code)
    assert first.code.startswith("E01")
    assert second.code == "E0201"
    left = run_text(apply_fixes(text, [first])[0]).only()
    assert (left.code, left.message) == (second.code, second.message)
