"""Warnings of what lies outside the measured ranges: where they begin, and what they name."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.manifest import Manifest, load_manifest
from scenelang.compiler.passes import check_scene
from scenelang.drawing.metrics import psnr
from scenelang.drawing.render import draw_exact
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source

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


@pytest.mark.parametrize(
    ("inside", "outside", "words"),
    [
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
        (blend(DARK, "material flat { color([0.7, 0.7, 1]); }"), blend(DARK, "scale(0.9);"),
            "W0507 a `smooth` of colours 0.8 apart at a scale of 1: the product 0.8 is outside the measured"),
        (blend(DARK + "scale(0.6);", "scale(0.5);"), blend(DARK + "scale(0.6);", "scale(1.5, 0.8);"),
            "W0507 a `smooth` of colours 0.8 apart at a scale of 0.8: the product 0.64"),
        (f"subtract {{ {blend('', '')} pentagon {{ {DARK} }} }}", blend("", DARK), "W0507"),
        (f"star {{ {DARK} }} square {{ }}",
            f"smooth {{ union {{ star {{ {DARK} }} square {{ rotate(0.1rad); }} }} pentagon {{ }} }}",
            "W0507 a `smooth` of colours 0.8 apart"),
    ],
)  # fmt: skip
def test_on_both_sides_of_a_bound(inside: str, outside: str, words: str) -> None:
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
        "thickness": (0.12, 1), "width": (0, 1),
    },
    measured={},
)  # fmt: skip
FLAT, MIST = "scale(1, 0.19, 1);", "material volumetric;"


@pytest.mark.parametrize(
    ("inside", "outside", "words"),
    [
        ("twist(-2);", "twist(-2.1);", "W0509 a `twist` of -2.1 on `torus` is outside the measured range -2"),
        ("twist(2); scale(2);", "scale(1, 2, 1); twist(2); twist(0.1);", "W0509 a `twist` of 4.2"),
        ("displace(-0.1, 9);", "displace(-0.2, 9);", "W0510 a displacement of 0.2 of `torus` is outside"),
        ("displace(0.1, -9);", "displace(0.1, 10);", "W0510 a displacement of frequency 10 of `torus` is"),
        ("scale(1, 0.2, 1);", FLAT, "W0506 `torus`, 0.114 thick, is outside the measured range 0.12 to 1"),
        (f"{FLAT} {MIST}", f"{MIST} }} torus {{ {FLAT}", "W0506 `torus`, 0.114 thick,"),
        (f"}} subtract torus {{ {FLAT}", f"}} torus {{ {FLAT}", "W0506"),
        ("} smooth(k = 1) sphere {", "} smooth(k = 1.1) sphere {", "W0512 a `smooth` of width 1.1 is"),
        ("bend(1); scale(2);", "bend(1); scale(1, 1, 2.1);", "W0504 a scale of 2.1 of `torus`"),
    ],
)  # fmt: skip
def test_bounds_of_solids(inside: str, outside: str, words: str) -> None:
    assert warned(f"chain {{ torus {{ {inside} }} }}", SOLIDS) == []
    (found,) = warned(f"chain {{ torus {{ {outside} }} }}", SOLIDS)
    assert found.startswith(words)


@pytest.mark.parametrize(
    "text",
    [
        "for (i in 0..<150) { star { scale(0.05); translate(2 * rand(i) - 1, 2 * rand(i + 0.5) - 1); } }",
        "for (i in 0..20) { square { scale(1.5, 0.002); translate(0, i / 10 - 1); } }",
    ],
)
def test_crowds_and_hairlines_are_drawn_well_and_not_warned_of(text: str) -> None:
    """What the shipped model was measured to draw well; against the exact picture."""
    text = f"canvas(96, 96); background(#000); {text}"
    assert [*nsg.check_text(text)] == []
    scene = nsg.loads(text)
    picture, exact = (np.asarray(p, np.float64) for p in (nsg.render(nsg.compile(scene)), draw_exact(scene)))
    assert exact.std() > 0.05
    assert psnr(picture, exact) > 45


@pytest.mark.parametrize(("bend", "wild"), [(99, False), (-101, True), (1e20, True)])
def test_far_outside_nothing_may_be_right(bend: float, wild: bool) -> None:
    found = Diagnostics()
    scene, spans = Source(text=SourceFile("a.nsg", f"star {{ bend({bend}); }}")).scene(found)
    assert scene is not None
    check_scene(scene, spans, found, MANIFEST)
    assert [("nothing of the picture" in (d.help or "")) for d in found] == [wild]
