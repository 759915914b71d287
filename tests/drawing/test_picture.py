"""Proofs of pictures: no pixel breaks its bound, whoever drew it, and bounds are near what they bound."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS
from lab.sets.scenes import sets_of
from scenelang.assets.zoo import zoo_bytes
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing import proof as errors
from scenelang.drawing import proof as picture
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import PROVED
from scenelang.drawing.proof import Stream
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


@pytest.mark.parametrize("name", [*SETS, "blobs", "trees"])
def test_no_pixel_breaks_its_proof(name: str) -> None:
    """Scenes of every set and random trees, over backgrounds and none, drawn and redrawn."""
    shares = []
    made = {"blobs": blob_scene, "trees": random_scene}.get(name)
    sets = sets_of(load_manifest("shapes2d"))
    for index, seed in enumerate((7, 19, 24, 36) if made else range(3)):  # the boolean rule refuses others
        scene = made(seed) if made else sets[name](RNG([7, seed]))
        look: dict[str, Any] = {"background": [(0.9, 0.1, 0.4), None][index % 2], "canvas": (77, 59)}
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
    """A pixel that is wrong is told, by as much as it is wrong; other models' pictures are proved as well."""
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
    small = scene.model_copy(update={"model": "shapes2d-w8"})
    assert nsg.prove(small)[1].share > 0.9


def test_bands_meet(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = random_scene(24)
    image, proof = nsg.prove(scene, redraw=True)
    monkeypatch.setattr(picture, "BAND", 1)
    again, banded = nsg.prove(scene, redraw=True)
    np.testing.assert_array_equal(banded.bound, proof.bound)
    np.testing.assert_array_equal(again, image)


def test_fewer_pixels_are_asked_at_a_time_where_more_objects_reach_them() -> None:
    scene = nsg.loads("canvas(64, 32); square { scale(9); } square { scale(0.5); translate(-1.5, 0.5); }")
    graphs: dict[str, Any] = {}
    nsg.compile(scene, after=graphs.__setitem__)
    stream = Stream(graphs["lower"], graphs["flatten"], load_manifest("shapes2d"), {})
    assert stream.crowd(scene.canvas) == pytest.approx(1 + 1 / 8)


FAR = "".join(
    f"square {{ scale(0.04); translate({x}, {y}); }}\n"
    for x, y in RNG(0).uniform(-0.9, 0.9, (30, 2)).round(3).tolist()
)
EXTREME = "star { scale(1e-7); translate(1e7, 0); rotate(1e-9turn); translate(-1e7, 0); scale(4e6); }"


@pytest.mark.parametrize(
    ("text", "least"),
    [
        (f"canvas(64, 64);\nsmooth {{ {FAR} }}", 0.9),  # blends far and near
        (f"canvas(64, 64);\n{EXTREME}", 0.0),
        ("canvas(64, 64); background(none);\nchain { star { scale(0.9); } smooth(1.2) square { } }", 0.97),
        ("canvas(64, 64);\ngroup { }", 1.0),
    ],
)
def test_other_scenes(text: str, least: float) -> None:
    scene = nsg.loads(text)
    image, proof = nsg.prove(scene)
    assert broken(scene, image, proof) == 0
    assert proof.share >= least


def test_textures_are_proved() -> None:
    scene = nsg.loads(
        "canvas(80, 60);\nstar { scale(0.7); material bricks { hue(0.2turn); } }\nsquare { scale(0.2); }"
    )
    image, proof = nsg.prove(scene)
    assert broken(scene, image, proof) == 0
    assert proof.share > 0.97


def test_nothing_is_said_of_an_element(tmp_path: Path) -> None:
    """Pixels beyond the disc that it fills are proved, and those in it stay as they were drawn."""
    (tmp_path / "zoo.safetensors").write_bytes(zoo_bytes([element(square, "tile", d=2)]))
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


def test_what_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = nsg.loads("star { }")
    for text, why in (("sphere { }", "solids"), ('model "shapes2d-reading"; square { }', "learned where")):
        with pytest.raises(RenderError, match=why):
            nsg.prove(nsg.loads(text))
    with pytest.raises(RenderError, match="a picture of"):
        nsg.prove(scene, nsg.render(scene, size=(9, 9)))
    with pytest.raises(ValueError, match="unknown output"):
        nsg.render_outputs(scene, ["proof"])
    load = errors.load_errors
    monkeypatch.setattr(picture, "load_errors", lambda: load("shapes2d-w16"))
    with pytest.raises(RenderError, match="no proof"):
        nsg.prove(scene)
