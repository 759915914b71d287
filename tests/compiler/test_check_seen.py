"""Warnings of pictures with nothing to see: where they begin, against pictures drawn exactly."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.drawing.render import draw_exact

CAMERA = "camera(eye = [0, 0, 6]); ground(none); background(#000); "
DARK = "background(#000); "


def seen(text: str) -> tuple[list[str], bool]:
    """Codes of the warnings, and whether the exact picture has one colour."""
    found = nsg.check_text(text)
    scene = nsg.loads(text).sized((48, 32))
    picture = np.asarray(draw_exact(scene))
    return [d.code for d in found], bool((picture == picture[0, 0]).all())


@pytest.mark.parametrize(
    ("text", "blank"),
    [
        ("square { scale(0.5); translate(1.34, 0); }", False),
        ("square { scale(0.5); translate(2.1, 0); }", True),
        ("square { scale(3); }", True),
        ("square { scale(2); } star { scale(0.2); material flat { color(#f00); } }", False),
        ("square { scale(2); material flat { color(#f00); } } star { scale(3); twirl(1); }", False),
        ("subtract { star { scale(0.5); } square { scale(1); } }", True),
        ("subtract { star { scale(0.5); } square { scale(0.4); } }", False),
        ("chain { star; subtract square { scale(2); } star { scale(0.3); } }", False),
        ("intersect { square { scale(0.5); } star { scale(0.3); translate(0.7, 0); } }", True),
        ("intersect { square { scale(0.5); } star { scale(0.3); translate(0.5, 0); } }", False),
        ("chain { square { scale(0.3); translate(1.8, 0); } smooth square { scale(0.3); } }", False),
        (CAMERA + "sphere { translate(0, 0, 8); }", True),
        (CAMERA + "sphere { translate(5, 0, 0); }", True),
        (CAMERA + "sphere { translate(2.4, 0, 0); }", False),
        (CAMERA + "subtract { sphere; sphere { scale(1.8); } }", True),
        ("camera(eye = [0, 0, 0.5], target = [0, 0, 0]); sphere { scale(3); material volumetric; }", None),
    ],
)  # fmt: skip
def test_what_is_warned_of_is_of_one_colour(text: str, blank: bool | None) -> None:
    codes, one = seen(text if text.startswith("camera") else f"canvas(48, 32); {DARK}{text}")
    if blank is None:
        assert codes == ["W0403"]
        return
    assert one == blank
    assert ("W0402" in codes) == blank


@pytest.mark.parametrize(
    "text",
    [
        "canvas(400, 300); square { scale(100); translate(200, 150); }",
        'import "std/shapes" as s; canvas(300, 200); s.disc(40) { translate(20, 180); }',
    ],
)
def test_the_help_for_pixels_leads_to_a_picture(text: str) -> None:
    """What the help says to put all into, done; the middle of the object is where pixels have it."""
    (only,) = nsg.check_text(text)
    assert only.code == "W0402"
    assert only.help is not None
    group = only.help.partition("put all objects into ")[2]
    at = text.index("square {") if "square {" in text else text.index("s.disc")
    mended = text[:at] + group.replace("…", text[at:])
    assert [*nsg.check_text(mended)] == []
    picture = np.asarray(draw_exact(nsg.loads("background(#000); " + mended)))[..., 0]
    rows, columns = np.nonzero(picture > 0.5)
    x, y = (200, 150) if "square {" in text else (20, 180)
    assert columns.max() + 1 == pytest.approx(x + (70.7 if x == 200 else 40), abs=1)
    assert picture.shape[0] - rows.mean() == pytest.approx(y if x == 200 else 170.5, abs=3)


def test_frames_with_nothing_in_sight_are_no_mistake() -> None:
    comes = "animate(seconds = 1, fps = 4); star { scale(0.3); translate(4 * u - 3, 0); }"
    far = "animate(seconds = 1, fps = 4); star { scale(30); translate(100 + 40 * u, 100); }"
    meets = "animate(seconds = 1, fps = 4); intersect { square; star { translate(3 - 3 * u, 0); } }"
    assert [*nsg.check_text(comes), *nsg.check_text(meets)] == []
    assert {d.code for d in nsg.check_text(far)} == {"W0402"}


def test_an_eye_in_a_thin_mist_is_no_mistake() -> None:
    text = "camera(eye = [0, 0, {}], target = [0, 0, -4]); ground(none); sphere {{ material volumetric; }}"
    assert [*nsg.check_text(text.format(0.5))] == []
    assert [d.code for d in nsg.check_text(text.format(0.1))] == ["W0403"]


def test_many_rows_are_looked_at_in_bounded_steps() -> None:
    """A union of thousands, cut by thousands: past a number of boxes nothing is said."""
    star = "star { scale(0.01); translate(3, 0); }"
    cuts = "subtract square { scale(0.01); translate(3 + i / 1000, 2); }"
    text = f"chain {{ for (i in 0..<400) {{ {star} }} for (i in 0..<400) {{ {cuts} }} }}"
    assert "W0402" not in {d.code for d in nsg.check_text(text)}
