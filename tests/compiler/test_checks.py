"""Warnings: outside the measured ranges, pictures with nothing to see, later frames of animations."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import check_compiles, check_frames
from scenelang.compiler.manifest import Manifest, load_manifest
from scenelang.compiler.passes import check_scene
from scenelang.drawing.metrics import psnr
from scenelang.drawing.render import draw_exact
from scenelang.language import evaluation as evaluate
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, Source

MANIFEST = dataclasses.replace(
    load_manifest("shapes2d"),
    trained={
        "objects": (1, 3), "smooth": (0, 1), "twirl": (-1, 2), "bend": (-1, 1), "scale": (0.1, 1.5),
        "thin": (1, 5), "blend": (0, 0.5),
    },
    measured={"stability": {"thin": "9: 12.3 dB"}},
)  # fmt: skip
DARK = "material flat { color([0.5, 0.2, 1]); } "


def warned(text: str, manifest: Manifest = MANIFEST) -> list[str]:
    found = Diagnostics()
    scene, spans = Source(text=SourceFile("a.nsg", text)).scene(found)
    assert scene is not None
    check_scene(scene, spans, found, manifest)
    assert all(d.span is not None for d in found), [*found]
    return [f"{d.code} {d.message}" for d in found]


def stars(count: int) -> str:
    return " ".join(f"star {{ rotate({i}rad); }}" for i in range(count))


def blend(first: str, second: str) -> str:
    return f"smooth {{ star {{ {first} }} square {{ {second} }} }}"


def test_on_both_sides_of_a_bound() -> None:
    for inside, outside, words in (
        ("star { twirl(2); }", "star { twirl(2.01); }",
            "W0502 a `twirl` of 2.01 on `star` is outside the measured range -1 to 2 of model `shapes2d`"),
        ("star { twirl(-1); }", "star { twirl(-1.1); }", "W0502 a `twirl` of -1.1 on `star`"),
        ("star { scale(0.5); twirl(2); }", "star { scale(0.5); twirl(4.1); }", "W0502 a `twirl` of 2.05"),
        ("star { bend(-1); }", "star { bend(-1.1); }", "W0503 a `bend` of 1.1"),
        ("star { scale(0.1); }", "star { scale(0.2, 0.09); }", "W0504 a scale of 0.09 of `star`"),
        ("star { scale(1.5); }", "star { scale(1.6, 1); }", "W0504 a scale of 1.6 of `star`"),
        ("star { scale(1, 0.2); }", "star { scale(1, 0.19); }", "W0506 `star`, 5.26 times as long as wide,"),
        (stars(3), stars(4), "W0501 4 objects are outside the measured range 1 to 3"),
        (blend(DARK, DARK), "smooth { star { } square { } pentagon { } }", "W0505 2 smooth unions are"),
    ):  # fmt: skip
        assert warned(inside) == []
        (found,) = warned(outside)
        assert found.startswith(words)


def test_the_furthest_out_is_named_and_the_others_are_counted() -> None:
    text = "star { twirl(3); } square { twirl(9); } pentagon { twirl(-4); }"
    assert warned(text)[0].startswith("W0502 a `twirl` of 9 on `square`")
    assert warned(text)[0].endswith("of model `shapes2d`, as 2 more are")
    assert warned(text.partition("pentagon")[0])[0].endswith("of model `shapes2d`, as 1 more is")


def test_help_says_what_was_measured() -> None:
    found = Diagnostics()
    check_scene(nsg.loads("star { scale(1, 0.1); twirl(3); }"), None, found, MANIFEST)
    assert {d.code: d.help for d in found} == {
        "W0506": "measured there: 9: 12.3 dB",
        "W0502": "the picture may be less exact than the model's figures",
    }


def test_what_a_model_does_not_state_is_not_looked_at() -> None:
    bare = dataclasses.replace(MANIFEST, trained={})
    assert warned(f"smooth {{ star {{ twirl(99); }} square {{ {DARK} scale(90, 1); }} }}", bare) == []


SOLIDS = dataclasses.replace(
    load_manifest("solids3d"),
    trained={
        "twist": (-2, 2), "bend": (-1, 1), "displace": (0, 0.1), "frequency": (0, 9), "scale": (0.1, 2),
        "thickness": (0.12, 1), "wall": (0.1, 1), "view": (0.1, 600), "view cut": (0.25, 600),
    },
    measured={},
)  # fmt: skip
FLAT, MIST = "scale(1, 0.19, 1);", "material volumetric;"


def test_bounds_of_solids() -> None:
    for inside, outside, words in (
        ("twist(-2);", "twist(-2.1);", "W0509 a `twist` of -2.1 on `torus` is outside the measured range -2"),
        ("twist(2); scale(2);", "scale(1, 2, 1); twist(2); twist(0.1);", "W0509 a `twist` of 4.2"),
        ("displace(-0.1, 9);", "displace(-0.2, 9);", "W0510 a displacement of 0.2 of `torus` is outside"),
        ("displace(0.1, -9);", "displace(0.1, 10);", "W0510 a displacement of frequency 10 of `torus` is"),
        ("scale(1, 0.2, 1);", FLAT, "W0506 `torus`, 0.114 thick, is outside the measured range 0.12 to 1"),
        (f"{FLAT} {MIST}", f"{MIST} }} torus {{ {FLAT}", "W0506 `torus`, 0.114 thick,"),
        (f"}} subtract torus {{ {FLAT}", f"}} torus {{ {FLAT}", "W0506"),
        ("scale(1); } box { scale(1, 0.1, 1);", "} cylinder { shell(0.09);", "W0506 `cylinder`, 0.09 thick"),
        ("shell(0.1);", "shell(0.09);", "W0506 `torus`, 0.09 thick"),
        ("bend(1); scale(2);", "bend(1); scale(1, 1, 2.1);", "W0504 a scale of 2.1 of `torus`"),
    ):  # fmt: skip
        assert warned(f"chain {{ torus {{ {inside} }} }}", SOLIDS) == []
        (found,) = warned(f"chain {{ torus {{ {outside} }} }}", SOLIDS)
        assert found.startswith(words)


def test_views_of_any_size_are_drawn_and_not_warned_of() -> None:
    for v in (1e-4, 1.0, 1e4):
        view = f"camera([0, 0, {v}], target = [0, 0, 0], fov = 90deg);"
        hole = f"sphere {{ scale({0.2 * v}); translate({0.2 * v}, 0, 0); }}"
        assert [*nsg.check_text(f"{view} subtract {{ sphere {{ scale({0.3 * v}); }} {hole} }}")] == []


def test_crowds_and_hairlines_are_drawn_well_and_not_warned_of() -> None:
    """The shipped model was measured to draw them well; against the exact picture."""
    for text in (
        "for (i in 0..<150) { star { scale(0.05); translate(2 * rand(i) - 1, 2 * rand(i + 0.5) - 1); } }",
        "for (i in 0..20) { square { scale(1.5, 0.002); translate(0, i / 10 - 1); } }",
    ):
        text = f"canvas(96, 96); background(#000); {text}"
        assert [*nsg.check_text(text)] == []
        scene = nsg.loads(text)
        exact = np.asarray(draw_exact(scene), np.float64)
        assert exact.std() > 0.05
        assert psnr(np.asarray(nsg.render(scene), np.float64), exact) > 45


def test_far_outside_nothing_may_be_right() -> None:
    for bend, wild in ((99, False), (-101, True), (1e20, True)):
        found = Diagnostics()
        check_scene(nsg.loads(f"star {{ bend({bend}); }}"), None, found, MANIFEST)
        assert [("nothing of the picture" in (d.help or "")) for d in found] == [wild]


CAMERA = "camera(eye = [0, 0, 6]); ground(none); background(#000); "


def seen(text: str) -> tuple[list[str], bool]:
    """Codes of the warnings, and whether the exact picture has one colour."""
    found = nsg.check_text(text)
    scene = nsg.loads(text).sized((48, 32))
    picture = np.asarray(draw_exact(scene))
    return [d.code for d in found], bool((picture == picture[0, 0]).all())


BLANK = {
    "square { scale(0.5); translate(1.34, 0); }": False,
    "square { scale(0.5); translate(2.1, 0); }": True,
    "square { scale(3); }": True,
    "square { scale(2); } star { scale(0.2); material flat { color(#f00); } }": False,
    "square { scale(2); material flat { color(#f00); } } star { scale(3); twirl(1); }": False,
    "subtract { star { scale(0.5); } square { scale(1); } }": True,
    "subtract { star { scale(0.5); } square { scale(0.4); } }": False,
    "chain { star; subtract square { scale(2); } star { scale(0.3); } }": False,
    "intersect { square { scale(0.5); } star { scale(0.3); translate(0.7, 0); } }": True,
    "intersect { square { scale(0.5); } star { scale(0.3); translate(0.5, 0); } }": False,
    "chain { square { scale(0.3); translate(1.8, 0); } smooth square { scale(0.3); } }": False,
    CAMERA + "sphere { translate(0, 0, 8); }": True,
    CAMERA + "sphere { translate(5, 0, 0); }": True,
    CAMERA + "sphere { translate(2.4, 0, 0); }": False,
    CAMERA + "subtract { sphere; sphere { scale(1.8); } }": True,
}


def test_what_is_warned_of_is_of_one_colour() -> None:
    for text, blank in BLANK.items():
        codes, one = seen(text if text.startswith("camera") else f"canvas(48, 32); background(#000); {text}")
        assert one == ("W0402" in codes) == blank, text
    codes, _ = seen(
        "camera(eye = [0, 0, 0.5], target = [0, 0, 0]); sphere { scale(3); material volumetric; }"
    )
    assert codes == ["W0403"]


def test_the_help_for_pixels_leads_to_a_picture() -> None:
    """The group that the help says to put all into; the middle of the object is where pixels have it."""
    for before, shape, x, y, half in (
        ("canvas(400, 300); ", "square { scale(100); translate(200, 150); }", 200, 150, 70.7),
        ('import "std/shapes" as s; canvas(300, 200); ', "s.disc(40) { translate(20, 180); }", 20, 170.5, 40),
    ):
        (only,) = nsg.check_text(before + shape)
        assert only.code == "W0402"
        assert only.help is not None
        mended = before + only.help.partition("put all objects into ")[2].replace("…", shape)
        assert [*nsg.check_text(mended)] == []
        picture = np.asarray(draw_exact(nsg.loads("background(#000); " + mended)))[..., 0]
        rows, columns = np.nonzero(picture > 0.5)
        assert columns.max() + 1 == pytest.approx(x + half, abs=1)
        assert picture.shape[0] - rows.mean() == pytest.approx(y, abs=3)


def test_all_that_nobody_sees_is_shown() -> None:
    """Only the first of two objects was."""
    for before, both in ("", ["star", "square"]), (CAMERA, ["torus", "box"]):
        text = before + "".join(f"{shape} {{ translate(9, 9); }}" for shape in both)
        (only,) = nsg.check_text(text)
        shown = [only.span.text if only.span else "", *(label.span.text for label in only.labels)]
        assert only.code == "W0402"
        assert [part.split()[0] for part in shown] == both


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


SECOND = "animate(seconds = 1, fps = 40, loop = false);\n"


def look(text: str, every: bool = False) -> tuple[list[str], tuple[int, int]]:
    """The codes and frames of what is found, and how many frames were looked at."""
    found = Diagnostics()
    evaluation = Source(text=SourceFile("a.nsg", text)).evaluation(found, replays=True)
    scene, spans = evaluation.run(0)
    if scene is not None:
        check_compiles(scene, spans, found)
    seen = check_frames(evaluation, found, first=scene, every=every)
    return [f"{d.code}{d.message.partition('(frame')[2].rstrip(')')}" for d in found], seen


LATER = [
    ("square { rotate(TAU * u); }", ["E0302 1"], ["E0302 1"]),
    ("star { translate(sin(2 * PI * t), 0); }", ["E0302 1"], ["E0302 1"]),
    ("star { rotate(45deg + 10 * t); }", ["E0302 1"], ["E0302 1"]),
    ("star { scale([1, 2, 3][floor(frame / 10)]); }", ["E0307 39"], ["E0307 30"]),
    ("if (frame == 20) { star { scale(1 / 0); } }", ["E0304 20"], ["E0304 20"]),
    ("if (frame == 33) { star { scale(1 / 0); } }", [], ["E0304 33"]),
    ("star { material flat { color([1, 1, 2 * u]); } }", ["W0301 20"], ["W0301 20"]),
    ("for (i in 0..frames - 1 - frame) { star; }", [], []),
    ("star { translate(1 / (frame - 50), sin(TAU * u * 1rad)); }", [], []),
    ("star { scale(1 / 0); } square { rotate(t); }", ["E0304", "E0302 1"], ["E0304", "E0302 1"]),
    # An angle that is 0 in the frames that were looked at.
    ("star { rotate(floor(u / 2)); }", ["W0303"], ["W0303"]),
    ("star { rotate(angle = frame == 33 ? 1 : 0); }", ["W0303"], ["E0302 33"]),
    (
        "let a = 0 * t; star { translate(cos(a), 0); material flat { hue(a); } }",
        ["W0303"] * 2,
        ["W0303"] * 2,
    ),
    ("star { rotate(0); } square { rotate(0 * 1); }", [], []),
    ("star { rotate(floor(u / 2) * 1deg); }", [], []),
    # What the compiler refuses: booleans that nest too deeply in the middle.
    (
        "module m(n) { if (n > 0) { subtract { square { scale(n / 20); } m(n - 1); } }\n"
        "else { subtract { star { scale(0.3); } square { scale(0.1); } } } }\n"
        "m(18 - floor(18 * abs(u - 0.5)));",
        ["E0409 20"],
        ["E0409 14"],
    ),
    ("box { scale(0.3); twirl(416.6 * u); }", ["W0502 20"], ["W0502 16"]),
]


def test_what_later_frames_have() -> None:
    for statement, some, every in LATER:
        assert look(SECOND + statement) == (some, (4, 4)), statement
        assert look(SECOND + statement, every=True) == (every, (40, 40)), statement


def test_each_frame_is_looked_at_once() -> None:
    for fps, frames in ((0.1, 1), (1, 1), (2, 2), (3, 3), (4, 4), (9, 4)):
        assert look(f"animate(1, {fps}); star {{ scale(0.5); rotate(1turn * u); }}") == ([], (frames, frames))


def test_scenes_without_animation_are_run_once(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = []
    run = Evaluation.run
    monkeypatch.setattr(Evaluation, "run", lambda self, frame: runs.append(frame) or run(self, frame))
    assert look("star;") == ([], (1, 1))
    assert runs == [0]


def test_frames_share_the_limits_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "animate(1, 40); for (i in 0..<10) { star { scale(0.5); rotate(1turn * u * i); } }"
    monkeypatch.setattr(evaluate, "MAX_OBJECTS", 45)
    assert look(text, every=True) == ([], (5, 40))
    monkeypatch.undo()
    monkeypatch.setattr(evaluate, "MAX_STEPS", 1)
    assert look(text, every=True) == ([], (1, 40))


IN_MIST = "sky(); light([0, %g, 0], radius = %g); %s { material volumetric; }"
MEASURED = {
    IN_MIST % (0, 0, "sphere"): "the lamp at [0, 0, 0] is in the mist of this `sphere`, and its radius of 0",
    IN_MIST % (0, 0.03, "sphere"): None,
    IN_MIST % (1.01, 0, "sphere"): None,
    IN_MIST % (0, 0, "torus"): None,  # the lamp is in its hole
    IN_MIST.replace("sky();", "") % (0, 0, "sphere"): None,
    "sky(); subtract { sphere { material volumetric; } sphere { scale(0.3); } } light([0, 0, 0]);": None,
    "sky(); for (i in 1..101) { sphere { scale(0.1); translate(i / 9, 0, 0); } }": None,
}


def test_light_that_may_be_wrong() -> None:
    for text, words in MEASURED.items():
        found = [d.message for d in nsg.check_text(text) if d.code == "W0514"]
        assert [words is not None and words in message for message in found] == [True] * bool(words), text


def test_light_that_may_be_wrong_is_told_once_for_an_animation() -> None:
    text = "animate(1, 4); sky(); light([0, 0, 0]);\nsphere { scale(1 + u); material volumetric; }"
    (found,) = (d for d in nsg.check_text(text) if d.code == "W0514")
    assert found.span is not None
    assert found.span.locate()[0][0] == 2


def test_a_lamp_within_an_opaque_object() -> None:
    """It lights nothing: the picture is that without it."""
    lamp, camera = "light(position = [0, 0, 0], power = 30);", "camera(eye = [0, 0, 4]); light(none);"
    balls = {
        "sphere;": True,
        "sphere { shell(0.05); }": False,
        f"sphere {{ {MIST} }}": False,
        "sphere { translate(0, 2, 0); }": False,
    }
    for ball, dark in balls.items():
        found = [d.code for d in nsg.check_text(camera.replace("light(none);", lamp) + ball)]
        assert ("W0407" in found) == dark, ball
    lit, unlit = (
        np.asarray(draw_exact(nsg.loads(head + "sphere;").sized((8, 8))))
        for head in (camera.replace("light(none);", lamp), camera)
    )
    np.testing.assert_allclose(lit, unlit, atol=1e-6)


MIST = "material volumetric { density(0.001); }"
BALLS = "sphere { scale(0.6); translate(-0.7, 0, 0); } sphere { scale(0.6); translate(0.7, 0, 0); }"
PAIR = "union { box { scale(0.7); } cone { scale(0.5); translate(1, 0, 0); } }"
IN_MEDIA = [  # what is drawn, and the code
    ("sphere;", f"sphere; box {{ scale(4); {MIST} }}", "W0405"),
    ("sphere;", f"box {{ scale(4); {MIST} }} sphere;", "W0406"),
    (BALLS, f"{BALLS} sphere {{ scale(2); {MIST} }}", "W0405"),
    (PAIR, f"sphere {{ scale(3); {MIST} }} {PAIR}", "W0406"),
    ("sphere;", f"sphere; subtract {{ box {{ scale(4); {MIST} }} sphere; }}", ""),
    ("sphere;", f"subtract {{ box {{ scale(4); {MIST} }} sphere; }} sphere;", ""),
    (BALLS, f"{BALLS} torus {{ scale(4); {MIST} }}", ""),
    (BALLS, f"intersect {{ union {{ {BALLS} }} box {{ scale(4); {MIST} }} }}", ""),
]


def test_solids_that_a_medium_takes_away_or_gives_its_normals() -> None:
    """A medium of hardly any density is not seen: what it changes in a picture is not its own."""
    pictures = {}
    for solids, text, code in IN_MEDIA:
        found = [d.code for d in nsg.check_text(CAMERA + text)]
        assert found == [code] * bool(code), text
        for shown in (solids, text):
            if shown not in pictures:
                pictures[shown] = np.asarray(draw_exact(nsg.loads(CAMERA + shown).sized((8, 8))))
        off = np.abs(pictures[text] - pictures[solids])[..., :3].max()
        assert (off > 0.1) == bool(code), (text, off)
    glows = f"box {{ scale(4); {MIST} }} sphere {{ material diffuse {{ color(#000); glow(#fff); }} }}"
    dense = glows.replace("0.001", "90").replace("glow(#fff);", "")  # nothing of the solid is seen
    half = f"sphere {{ translate(0, 0.2, 0); }} box {{ scale(2); translate(0, -1.2, 0); {MIST} }}"
    for text in (glows, dense, half):
        assert [*nsg.check_text(CAMERA + text)] == [], text


def test_many_solids_in_a_medium_are_looked_at_in_bounded_steps() -> None:
    moves = "scale(0.01); translate(0.05 * (i % 20), 0.05 * floor(i / 20), 0);"
    balls = f"for (i in 0..<400) {{ sphere {{ {moves} }} }}"
    start = time.process_time()
    (one,) = [d for d in nsg.check_text(f"sky(); box {{ scale(4); {MIST} }} {balls}") if d.code == "W0406"]
    assert "as 3 solids more" in one.message
    assert time.process_time() - start < 2


def test_the_help_for_a_dense_texture_leads_to_a_scene() -> None:
    thin = "box {{ scale(1, 0.02, 1); material wood {{ {} }} }}"
    (only,) = nsg.check_text(thin.format(""))
    assert only.code == "W0511"
    assert "`scale` in the material's block" in (only.help or "")
    assert [*nsg.check_text(thin.format("scale(1, 50);"))] == []
