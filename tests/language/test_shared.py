"""One mistake that shows in many places is one report with the others as labels; several stay several."""

from __future__ import annotations

import pytest

from tests.language.cases import run_text

SPREAD = {
    "surplus": ("fn f(a) = 2 * a;\nsquare { scale(f(1, 2)); rotate(1deg * f(1, 3)); }", "E0308", 2, 2),
    "missing": ("module m(a, b) { square { scale(a * b); } }\nm(1);\nm(2);\nm(3);", "E0308", 2, 3),
    "named": ("fn f(a) = 2 * a;\nsquare { scale(f(a = 1, z = 2), f(a = 1, z = 3)); }", "E0206", 2, 2),
    "some fit": ("fn f(a) = a;\nlet x = f(1);\nsquare { scale(f(x, 2), f(x, 3)); }", "E0308", 3, 2),
    "geometry": ("fn square(i) = i;\nsquare;\nsquare { scale(2); }", "E0213", 2, 2),
    "misplaced": ("square { star; star; }", "E0330", 1, 1),
    "chain": ("chain { subtract square; intersect star; }", "E0335", 1, 0),
}


@pytest.mark.parametrize("case", SPREAD, ids=str)
def test_one_mistake_in_many_places_is_one_report(case: str) -> None:
    text, code, line, labels = SPREAD[case]
    (found,) = run_text(text).diagnostics
    assert found.code == code
    assert found.span is not None
    assert found.span.locate()[0][0] == line
    assert len(found.labels) >= labels


@pytest.mark.parametrize(
    "text",
    [
        "fn f(a) = a;\nfn g(a) = a;\nsquare { scale(f(1, 2), g(1, 2)); }",
        "fn f(a) = a;\nlet x = f(1);\nsquare { scale(f(x, 2), f(z = 1)); }",
        "fn f(a) = a + b;\nfn g(a) = a;\nsquare { scale(f(1), g(1, 2)); }",
        "fn f(a, b) = a * b;\nsquare { scale(f(1), f(1, 2, 3)); }",
        "let a = [1, 2, 3];\nlet b = [1, 2, 3];\nsquare { scale(1, 1 + a); scale(1, 1 + b); }",
        "let v = [1, 2];\nsquare { scale(v[2], v[3]); }",
        "square { scale(sin(1, 2), cos(1, 2)); }",
        "square { star; }\nsquare { star; }",
    ],
)
def test_independent_mistakes_are_told_apart(text: str) -> None:
    assert len(run_text(text).diagnostics) == 2


def test_ten_mistakes_are_ten_reports() -> None:
    text = "".join(f"fn f{i}(a) = a;\nsquare {{ scale(f{i}(1, 2)); }}\n" for i in range(10))
    assert len(run_text(text).diagnostics) == 10
