"""Warnings of what a model was measured with, held against the pictures that they are about."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.drawing.metrics import psnr
from scenelang.drawing.render import draw_exact

STAGE = (
    "camera(eye = k * [0, 1.5, 6]); light(position = k * [2.5, 4, 3], power = 28 * k * k); ground(y = -k); "
)
MODELS = {
    "bracket": """group {
      subtract {
        union { box { scale(1.2, 0.2, 0.8); } box { scale(0.2, 1, 0.8); translate(-0.6, 0.5, 0); } }
        cylinder { scale(0.2, 1, 0.2); translate(0.3, 0, 0); }
      }
      scale(k);
    }""",
    "mug": """group {
      subtract { cylinder { scale(0.9); } cylinder { scale(0.75, 0.9, 0.75); translate(0, 0.2, 0); } }
      torus { scale(0.5); rotate(90deg, axis = X); translate(0.8, 0, 0); }
      rotate(30deg, axis = X); scale(k);
    }""",
    "gear": """group {
      subtract {
        union {
          cylinder { scale(0.9, 0.3, 0.9); }
          for (i in 0..7) { box { scale(0.25); translate(0.75, 0, 0); rotate(45deg * i, axis = Y); } }
        }
        cylinder { scale(0.3, 1, 0.3); }
      }
      rotate(50deg, axis = X); scale(k);
    }""",
    "die": """group {
      subtract {
        intersect { box { scale(0.9); } sphere { scale(0.75); } }
        for (x in [-0.3, 0.3]) { sphere { scale(0.12); translate(x, 0.2, 0.5); } }
      }
      rotate(20deg, axis = Y); scale(k);
    }""",
    "ball": "subtract { sphere { scale(k); } box { scale(0.8 * k); translate(k / 2, k / 2, k / 2); } }",
    "castle": """group {
      box { scale(0.9, 0.5, 0.5); translate(0, -0.6, 0); }
      for (x in [-0.7, 0.7]) {
        cylinder { scale(0.25, 0.9, 0.25); translate(x, -0.3, 0.2); }
        cone { scale(0.35); translate(x, 0.5, 0.2); material diffuse { color(#b43); } }
      }
      scale(k);
    }""",
    "snowman": """smooth(k = 0.1 * k) {
      sphere { scale(0.6 * k); translate(0, -0.4 * k, 0); }
      sphere { scale(0.4 * k); translate(0, 0.4 * k, 0); }
    }""",
    "planets": """sphere { scale(0.8 * k); material diffuse { color(#36c); } }
    sphere { scale(0.2 * k); translate(1.2 * k, 0.2 * k, 0.3 * k); }""",
    "screw": "group { box { scale(0.4, 1.2, 0.4); twist(6); } cylinder { scale(0.7, 0.2, 0.7); } scale(k); }",
    "pebble": "sphere { displace(0.5, 6); scale(0.7 * k); }",
}
FLAT = "{0} {{ scale({1}, {2}, {1}); rotate({3}deg, axis = X); rotate(20deg, axis = Y); }}"


def at(k: float) -> list[str]:
    """The models with all their lengths multiplied."""
    return [f"param k = {k!r}; {STAGE}{model}" for model in MODELS.values()]


WARNED = [
    *(
        f"{s} {{ scale(1, 0.5, 0.4); {w}(80); scale(1.1); }}"
        for w in ("twist", "bend", "twirl")
        for s in ("box", "octahedron")
    ),
    *(f"{s} {{ displace(0.03, 300); }}" for s in ("sphere", "box", "torus")),
    *(FLAT.format(s, 0.8, 0.002, turn) for s in ("box", "cylinder") for turn in (25, 50)),
    *(
        FLAT.format(s, 0.8, y, turn)
        for s, y in (("sphere", 0.004), ("torus", 0.013), ("cone", 0.006))
        for turn in (25, 50)
    ),
]
QUIET = [
    *(text for k in (0.001, 0.02, 1, 5, 100, 2000) for text in at(k)),
    "smooth(k = 2) { sphere { translate(-0.8, 0, 0); } torus { translate(0.8, 0, 0); } }",
    "smooth { for (i in 0..12) { sphere { scale(0.2); translate(i / 6 - 1, 0.2 * sin(i * 1rad), 0); } } }",
    "star { scale(20); translate(-14, 0); material flat { color(#c33); } }",
    "square { twirl(30); scale(0.8); material flat { color(#c33); } }",
    "smooth { star { scale(5); material flat { color(#000); } } square { scale(4); translate(4, 0); } }",
]


def off(text: str) -> tuple[list[str], bool]:
    """Codes of warnings of ranges, and whether the network's picture is visibly not the exact one.

    That is under 40 dB, or more than one pixel in 500 by more than a tenth.
    """
    text = "canvas(96, 96); " + text
    codes = [d.code for d in nsg.check_text(text) if d.code.startswith("W05")]
    scene = nsg.loads(text)
    picture, exact = (np.asarray(p, np.float64) for p in (nsg.render(scene), draw_exact(scene)))
    return codes, psnr(picture, exact) < 40 or bool((abs(picture - exact).max(-1) > 0.1).mean() > 0.002)


@pytest.mark.slow
def test_nine_in_ten_warnings_stand_beside_a_picture_that_is_off() -> None:
    found = [(text, *off(text)) for text in WARNED]
    assert [text for text, codes, _ in found if not codes] == []
    fine = [text for text, _, wrong in found if not wrong]
    assert len(fine) <= len(WARNED) / 10, "\n".join(fine)


@pytest.mark.slow
def test_what_is_not_warned_of_is_right() -> None:
    found = [(text, *off(text)) for text in QUIET]
    assert [text for text, codes, _ in found if codes] == []
    wrong = [text for text, _, wrong in found if wrong]
    assert len(wrong) <= len(QUIET) / 10, "\n".join(wrong)


def test_a_warning_of_each_kind_stands_beside_a_picture_that_is_off() -> None:
    for text in (FLAT.format("cone", 0.8, 0.006, 50), "sphere { displace(0.03, 300); }"):
        codes, wrong = off(text)
        assert codes
        assert wrong, text
