"""Proofs of pictures: no pixel breaks its own, whatever the numbers."""

from __future__ import annotations

import random
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS
from lab.sets.scenes import sets_of
from scenelang.assets.element_file import element_file_bytes
from scenelang.compiler.graph import Look
from scenelang.compiler.lifting import inverse_frame
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.spaces import PLANE
from scenelang.compiler.steps import IDENTITY, Affine, compose
from scenelang.drawing import proof as proofs
from scenelang.drawing.exact.field import carry_back
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import PROVED
from scenelang.drawing.proof import TAME, WrittenObject
from scenelang.language.scene import Scene
from tests.assets.scenes import IMPORT, good
from tests.assets.shapes import element, square
from tests.compiler.random_scenes import blob_scene, random_scene
from tests.pictures import premultiplied

RNG = np.random.default_rng


def broken(scene: Scene, image: nsg.Image, proof: nsg.Proof) -> int:
    """Pixels that are farther from the exact picture than they are proved to be."""
    exact = premultiplied(nsg.render(scene, backend="reference"))
    return int((abs(premultiplied(image) - exact).max(-1) > proof.bound).sum())


# of letters, which are elements, `--redraw` leaves pixels that are not proved
@pytest.mark.parametrize("name", [*(name for name in SETS if not SETS[name].words), "blobs", "trees"])
def test_no_pixel_breaks_its_proof(name: str) -> None:
    """Scenes of every set and random trees, over backgrounds and none, drawn and redrawn."""
    shares = []
    made = {"blobs": blob_scene, "trees": random_scene}.get(name)
    sets = sets_of(load_manifest("shapes2d"))
    for index, seed in enumerate(
        (7, 19, 24, 36) if made else range(1 if name == "crowd" else 2)
    ):  # the boolean rule refuses others
        scene = made(seed) if made else sets[name](RNG([7, seed]))
        look: dict[str, Any] = {"background": [(0.9, 0.1, 0.4), None][index % 2], "canvas": (53, 41)}
        scene = scene.model_copy(update=look)
        image, proof = nsg.prove(scene)
        assert broken(scene, image, proof) == 0
        shares.append(proof.share)
        again, whole = nsg.prove(scene, image, redraw=True)
        assert broken(scene, again, whole) == 0
        assert (whole.share, whole.worst <= PROVED) == (1.0, True)
        assert whole.redrawn == (proof.bound > PROVED).sum()
    assert np.mean(shares) > 0.9  # where objects are large, blends are off


def test_any_picture_is_judged() -> None:
    """A pixel that is wrong is told, by as much as it is wrong;"""
    scene = blob_scene(15)
    image, proof = nsg.prove(scene)
    off = RNG(0).uniform(0, 1, image.shape).astype(np.float32) * (
        RNG(1).uniform(0, 1, (*image.shape[:2], 1)) < 0.1
    )
    wrong = np.clip(image + off, 0, 1).view(nsg.Image)
    _, told = nsg.prove(scene, wrong)
    assert broken(scene, wrong, told) == 0
    assert (told.bound - abs(wrong - image).max(-1) >= -proof.bound - 1e-6).all()
    assert (told.bound - abs(wrong - image).max(-1) <= proof.bound + 1e-6).all()
    mended, whole = nsg.prove(scene, wrong, redraw=True)
    assert (broken(scene, mended, whole), whole.share) == (0, 1.0)


def test_bands_meet(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = random_scene(24)
    image, proof = nsg.prove(scene, redraw=True)
    monkeypatch.setattr(proofs, "BAND", 1)
    again, banded = nsg.prove(scene, redraw=True)
    np.testing.assert_array_equal(banded.bound, proof.bound)
    np.testing.assert_array_equal(again, image)


FAR = "".join(
    f"square {{ scale(0.04); translate({x}, {y}); }}\n"
    for x, y in RNG(0).uniform(-0.9, 0.9, (30, 2)).round(3).tolist()
)
TEXTURED = "canvas(80, 60);\nstar { scale(0.7); material bricks { hue(0.2turn); } }\nsquare { scale(0.2); }"
EXTREME = "star { scale(1e-7); translate(1e7, 0); rotate(1e-9turn); translate(-1e7, 0); scale(4e6); }"


@pytest.mark.parametrize(
    ("text", "least"),
    [
        (f"canvas(64, 64);\nsmooth {{ {FAR} }}", 0.9),  # blends far and near
        (f"canvas(64, 64);\n{EXTREME}", 0.0),
        ("canvas(64, 64); background(none);\nchain { star { scale(0.9); } smooth(1.2) square { } }", 0.97),
        ("canvas(64, 64);\ngroup { }", 1.0),
        (TEXTURED, 0.97),
    ],
)
def test_other_scenes(text: str, least: float) -> None:
    scene = nsg.loads(text)
    image, proof = nsg.prove(scene)
    assert broken(scene, image, proof) == 0
    assert proof.share >= least


def test_nothing_is_said_of_an_element(tmp_path: Path) -> None:
    """Pixels beyond the disc that it fills are proved, and those in it stay as they were drawn."""
    (tmp_path / "zoo.safetensors").write_bytes(element_file_bytes([element(square, "tile", d=2)]))
    tile = "zoo.tile { scale(0.4); translate(-0.4, 0); }"
    scene = good(
        tmp_path,
        f"{IMPORT}canvas(80, 60); background(#000);\n{tile} star {{ scale(0.3); translate(0.7, 0); }}",
    )
    image, proof = nsg.prove(scene, redraw=True)
    y, x = np.mgrid[:60, :80]
    length = np.hypot((x - 39.5) / 30 + 0.4, (y - 29.5) / 30)
    disc = length < 0.4
    assert (proof.bound <= PROVED)[length > 0.42].all()
    assert (proof.bound > 0.2)[disc].all()
    np.testing.assert_array_equal(image[disc], nsg.render(scene)[disc])
    assert proof.facts()["unknown"] == ["zoo.tile"]
    assert proof.told().endswith("nothing is proved of the shape of `zoo.tile`")


def test_a_sample_on_an_outline_stays_open() -> None:
    """Beside one to the last digits the exact picture hangs on how it is computed."""
    scene = nsg.loads("canvas(32, 32); background(#000);\nsquare { scale(sqrt(0.5)); translate(1 / 64, 0); }")
    image, proof = nsg.prove(scene, redraw=True)
    assert broken(scene, image, proof) == 0
    assert proof.left == 2 * 16  # those along two of its sides


def test_what_is_refused() -> None:
    scene = nsg.loads("star { }")
    for text, why in (("sphere { }", "solids"), ('model "shapes2d-reading"; square { }', "learned where")):
        with pytest.raises(RenderError, match=why):
            nsg.prove(nsg.loads(text))
    with pytest.raises(RenderError, match="a picture of"):
        nsg.prove(scene, nsg.render(scene, size=(9, 9)))
    with pytest.raises(ValueError, match="unknown output"):
        nsg.render_outputs(scene, ["proof"])


LEAVES = ("square", "triangle", "star", "pentagon")
TEXTURES = ("bricks", "checker", "dots", "waves")
# steps with a huge number n, a huge size s, and usual numbers a, b, d and sizes t, u
WILD = (
    "translate({n}, {a}); translate(-({n}), {b});",
    "translate({n}, {n}); rotate({b}deg); translate(-({n}), -({n}));",
    "translate({n}, {b});",
    "scale({s}); scale({t} / {s});",
    "scale({s}, {t}); scale({u} / {s});",
    "scale({s}); rotate({a}turn); translate({n}, {b}); scale({t} / {s});",
    "scale(1 / {s}); translate({n}, 0); translate(-({n}), {b}); scale({s});",
    "shear(xy = {n}); shear(xy = -({n}));",
    "shear(xy = {n}); rotate({b}deg); shear(yx = {a}); scale({t} / {s});",
    "rotate({n}deg);",
    "bend({n});",
    "twirl({n});",
    "bend({n}); bend(-({n}));",
    "twirl({n}); twirl(-({n}) + {b});",
    "scale({s}); bend({b} / {s}); scale({t} / {s});",
    "scale({s}); bend({b}); scale({t} / {s});",
    "scale({s}, {t});",
    "scale({t}, {s}); rotate({b}turn);",
    "matrix([[{n}, {s}, 0, {a}], [{a}, {b}, 0, {b}], [0, 0, 1, 0], [0, 0, 0, 1]]);",
)
MILD = (
    "translate({a}, {b});",
    "rotate({d}deg);",
    "scale({t});",
    "scale({t}, {u});",
    "twirl({a});",
    "bend({b});",
)


def wild_scene(seed: int, low: float, high: float) -> str:
    """A scene of a few objects whose transforms now and then have numbers of 10^low to 10^high."""
    rng = random.Random(seed)

    def step(steps: tuple[str, ...]) -> str:
        a, b, d = (round(rng.uniform(-most, most), rng.choice([1, 2, 6])) or 0.3 for most in (2, 2, 360))
        s = round(rng.uniform(1, 10), rng.choice([0, 1, 9])) * 10 ** rng.uniform(low, high)
        t, u = (rng.choice([rng.uniform(0.2, 1.2), 0.5, 1.0]) for _ in range(2))
        return rng.choice(steps).format(n=rng.choice([-s, s]), s=s, a=a, b=b, d=d, t=t, u=u)

    def moves(most: int, chance: float) -> str:
        return " ".join(step(WILD if rng.random() < chance else MILD) for _ in range(rng.randrange(most + 1)))

    def leaf() -> str:
        color = f"color(#{rng.randrange(1 << 24):06x});"
        own = step(WILD) if rng.random() < 0.3 else ""
        own = "" if "bend" in own or "twirl" in own else own  # textures are not deformed
        hue = rng.choice(["", "hue({b}turn);", "hue({n}turn); hue({a}turn);"])
        texture = f"material {rng.choice(TEXTURES)} {{ {own} {step((hue,))} {color} }}"
        material = rng.choices(["", f"material flat {{ {color} }}", texture], (0.2, 0.65, 0.15))[0]
        return f"{rng.choice(LEAVES)} {{ {moves(3, 0.4)} {material} }}"

    def node(depth: int) -> str:
        if depth == 0 or rng.random() < 0.4:
            return leaf()
        inner = " ".join(node(depth - 1) for _ in range(rng.randrange(1, 4)))
        kinds = (
            "group",
            "union",
            "smooth",
            "subtract",
            "intersect",
            step(("smooth({s})", "smooth(1 / {s})", "smooth({t})")),
        )
        return f"{rng.choice(kinds)} {{ {inner} {moves(2, 0.2)} }}"

    stage = rng.choice(["", "background(none);", "background(#48c);"])
    size = rng.choice(["24, 24", "24, 24", "40, 12", "64, 1"])
    return f"canvas({size}); {stage} {' '.join(node(2) for _ in range(rng.randrange(1, 4)))}"


HUGE = {
    "a bend": """intersect { triangle { rotate(-357deg);
        matrix([[0.39, 0.08, 0, -0.47], [0.4, 0.74, 0, -0.11], [0, 0, 1, 0], [0, 0, 0, 1]]);
        bend(1e20); } square { twirl(-0.03); } }""",
    "another": "background(none); square { scale(0.25, 1.02); bend(1e15); rotate(-169.4deg); }",
    "a way": """smooth { star { translate(0.29, 1e20); rotate(1e20deg); }
        square { material flat { color(#9b187c); } } pentagon { bend(-1.34); } scale(1e6, 0.67); }""",
    "there and back": "star { translate(1e14, 0); rotate(20deg); rotate(-20deg); translate(-1e14, 0.2); }",
    "turns": "square { twirl(1e9); twirl(-1e9); rotate(30deg); scale(0.7); }",
    "textures": """square { material checker { translate(1e13, 0); translate(-1e13, 0.3); scale(0.2); } }
        star { scale(0.3); material dots { hue(1e13turn); hue(0.1turn); } }""",
}


def test_nothing_wrong_is_proved() -> None:
    for name, text in HUGE.items():
        scene = nsg.loads(f"canvas(24, 24);\n{text}")
        for redraw in (False, True):
            assert broken(scene, *nsg.prove(scene, redraw=redraw)) == 0, name


@pytest.mark.parametrize(("low", "high", "least"), [(0, 6, 0.75), (6, 12, 0.5), (12, 20, 0.35)])
def test_wild_scenes(low: float, high: float, least: float) -> None:
    shares = []
    for seed in range(20):
        try:
            scene = nsg.loads(wild_scene(seed, low, high))
            image, proof = nsg.prove(scene)
        except (nsg.SceneError, nsg.RenderError):
            continue
        assert broken(scene, image, proof) == 0, seed
        assert broken(scene, *nsg.prove(scene, image, redraw=True)) == 0, seed
        shares.append(proof.share)
    assert len(shares) > 4
    assert np.mean(shares) > least


def test_misplaced_bounds_what_is_lost() -> None:
    """Exact arithmetic tells how far chains of maps, applied one by one or composed, are off in float64."""
    rng, tight = random.Random(5), []
    for _ in range(300):
        steps, rows = [], IDENTITY
        for _ in range(rng.randrange(1, 6)):
            size = 10 ** rng.uniform(-4, 4)
            own = [rng.uniform(-1, 1) * rng.choice([1, size]) for _ in range(6)]
            fitted = (*own[:2], 0.0, own[2], *own[3:5], 0.0, own[5], 0.0, 0.0, 1.0, 0.0)
            if PLANE.usable(fitted) and PLANE.usable(compose(fitted, rows)):
                steps.append(Affine(fitted))
                rows = compose(fitted, rows)
        p = [rng.uniform(-1, 1), rng.uniform(-1, 1)]
        exact: Any = [Fraction(c) for c in p]
        for step in reversed(steps):
            a, b, _, x, c, d, _, y = map(Fraction, step.rows[:8])
            u, v = exact[0] - x, exact[1] - y
            exact = [(d * u - b * v) / (a * d - b * c), (a * v - c * u) / (a * d - b * c)]
        frame = np.reshape(inverse_frame(rows, 2), (2, 3))
        found = [carry_back(steps, p), frame[:, :2] @ p + frame[:, 2]]
        off = max(
            abs(float(Fraction(float(c)) - true)) for q in found for c, true in zip(q, exact, strict=True)
        )
        reach = float(np.hypot(*map(float, exact)))
        bound = WrittenObject(Look("flat"), tuple(steps)).misplaced(reach, 2**0.5) - TAME
        assert off <= bound
        tight.append(bound / (off + 1e-16 * reach))
    assert np.median(tight) < 1e5
