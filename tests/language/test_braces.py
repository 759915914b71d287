"""Braces that do not match are found by the layout, on the line where the slip is."""

from __future__ import annotations

import re

import pytest

from tests.language.reading import mistakes, read

TIDY = """nsg 1;
group {
  square { scale(0.2); translate(1, 0); }
  circle {
    scale(2);
    material flat { color(#d33); }
  }
  for (i in 0..3) {
    if (i == 2) { dot(1); } else { square { scale(0.2); } }
    rotate(3deg);
  }
  rotate(30deg);
}
star { scale(2); }
"""


def places(pattern: str) -> list[int]:
    return [match.start() for match in re.finditer(pattern, TIDY)]


def only_mistake_is_near(text: str, at: int) -> None:
    assert read(TIDY)[1] == []
    found = mistakes(read(text)[1])
    assert len(found) == 1
    assert abs(found[0][0] - TIDY.count("\n", 0, at) - 1) <= 1


@pytest.mark.parametrize("at", places(r"[{}]"))
def test_deleted_brace(at: int) -> None:
    only_mistake_is_near(TIDY[:at] + TIDY[at + 1 :], at)


@pytest.mark.parametrize("brace", "{}")
@pytest.mark.parametrize("at", places(r"(?<=[\s;{}(),])(?=\S)"))
def test_inserted_brace(at: int, brace: str) -> None:
    only_mistake_is_near(f"{TIDY[:at]}{brace} {TIDY[at:]}", at)


def test_unindented_text_still_matches_up() -> None:
    text = "group {\nsquare {\nscale(2);\n}\nstar;\n"
    assert mistakes(read(text)[1]) == [(5, 6, "E0104")]
    assert mistakes(read(text + "}\n}\n")[1]) == [(7, 1, "E0105")]


def test_braces_that_match_are_taken_at_their_word() -> None:
    text = TIDY.replace("#d33); }\n  }", "#d33) }\n").replace("scale(2); }\n", "scale(2); }\n}\n")
    assert mistakes(read(text)[1]) == [(6, 32, "E0102")]


@pytest.mark.parametrize(
    "block",
    [
        "group {\n" + "star;\n" * 6 + "}\n",
        "group {\n" + "        star;\n" * 6 + "}\n",
        "  group {\n    star;\n    star;\n    star;\n    star;\n  }\n",
        "group { star;\n" + "  star;\n" * 6 + "} star;\n",
    ],
)
def test_odd_layout_is_no_mistake(block: str) -> None:
    assert read(TIDY + block)[1] == []
    assert mistakes(read("let a = 1 2;\n" + TIDY + block)[1]) == [(1, 11, "E0101")]
