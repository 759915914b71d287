"""No fix changes what was meant: where a text can have been meant in several ways, none is offered."""

from __future__ import annotations

import pytest

from tests.diagnostics.test_every_fix import check

AMBIGUOUS = {
    "E0302": [
        "let k = 45; square { rotate(k); }",
        "for (i in [1]) { square { rotate(360 * i / 5); } }",
        "fn f(x) = 2 * x; square { rotate(f(1)); }",
        "square { rotate(90 * abs(PI)); }",
        "square { rotate(0.5 * 180 / PI); }",
        "let PI = 3; square { rotate(PI); }",
        "module m(TAU) { square { rotate(TAU / 2); } } m(90);",
        "square { rotate(PI / (2)); }",
        "let v = [PI, 1]; square { rotate(v[0]); }",
    ],
}


@pytest.mark.parametrize(
    ("code", "text"),
    [(code, text) for code, texts in AMBIGUOUS.items() for text in texts],
)
def test_no_fix_where_several_things_can_be_meant(code: str, text: str) -> None:
    found = check(text)
    assert code in [d.code for d in found]
    assert [d.fix for d in found] == [None] * len(found)
