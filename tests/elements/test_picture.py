"""Materials of users: their colours come back, and damaged or hostile ones do not."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from safetensors.numpy import load, save

from scenelang.elements.element import FORMS, Element
from scenelang.elements.picture import painted, texels
from scenelang.elements.zoo import load_zoo, read_zoo, zoo_bytes
from scenelang.tensors import TensorError
from tests.elements.shapes import element, noise, torus

BARK = noise(5, 7)


@pytest.mark.parametrize("shape", [(1, 1), (5, 7)])
def test_colours_come_back(shape: tuple[int, ...], tmp_path: Path) -> None:
    colours = np.random.default_rng(1).integers(0, 256, (*shape, 3), np.uint8)
    (tmp_path / "zoo.safetensors").write_bytes(zoo_bytes([painted("bark", colours)]))
    (found,) = load_zoo(tmp_path / "zoo.safetensors").elements
    np.testing.assert_array_equal(texels(found), colours.astype(np.float32) / 255)
    assert found.held == colours.size


@pytest.mark.parametrize("coding", FORMS["picture"].codings)
def test_each_coding_of_pictures(coding: str) -> None:
    ramp = np.linspace(0, 255, 16 * 24 * 3).reshape(16, 24, 3).astype(np.uint8)
    file = io.BytesIO()
    Image.fromarray(ramp).save(file, coding.upper(), quality=95)
    made = Element("ramp", "picture", (16, 24), coding, file.getvalue())
    assert read_zoo(zoo_bytes([made])).materials == {"ramp": made}
    assert abs(texels(made) * 255 - ramp).max() < 8
    for other in {*FORMS["picture"].codings} - {coding}:  # no other opener is tried
        with pytest.raises(TensorError, match="`ramp` is damaged"):
            texels(replace(made, coding=other))


def test_a_geometry_and_a_material_share_a_name() -> None:
    made = [element(torus, "cow", levels=2), noise(3, 3, name="cow"), noise(2, 2, 2, name="hide")]
    zoo = read_zoo(zoo_bytes(made))
    assert (list(zoo.geometries), list(zoo.materials)) == (["cow"], ["cow", "hide"])
    assert {e.digest for e in zoo.elements} == {e.digest for e in made}
    assert [e.kind for e in zoo.elements] == ["element of space", "texture", "colouring of space"]
    assert zoo_bytes(zoo.elements) == zoo_bytes(made[::-1])


def test_the_digest_is_that_of_the_colours() -> None:
    assert replace(BARK, name="other", about={}).digest == BARK.digest
    assert len({BARK.digest, noise(5, 7, seed=1).digest, replace(BARK, sizes=(7, 5)).digest}) == 3


def changed(**entry: Any) -> bytes:
    data = zoo_bytes([BARK])
    header = json.loads(
        json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])["__metadata__"]["scenelang"]
    )
    header["materials"]["bark"] |= entry
    header |= {key: value for key, value in entry.items() if key in header}
    return save(load(data), metadata={"scenelang": json.dumps(header)})


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (changed(height=6), "a picture of 7 x 5"),
        (changed(height=2049), "sizes out of range"),
        (changed(width=0), "sizes out of range"),
        (changed(coding="exr"), "a coding that this version does not know"),
        (changed(coding=["png"]), "a coding that this version does not know"),
        (changed(coding="jpeg"), "damaged"),
        (changed(form="colours"), "missing or unknown fields"),
        (changed(elements={"bark": {}}), "other elements than it holds"),
        (changed(format=1), "not a file of elements"),
    ],
)
def test_damaged_entries(data: bytes, words: str) -> None:
    with pytest.raises(TensorError, match=words):
        read_zoo(data)


def test_a_material_is_not_listed_as_a_geometry() -> None:
    made = element(torus, "bark", levels=2)
    data = zoo_bytes([made, BARK])
    header = json.loads(
        json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])["__metadata__"]["scenelang"]
    )
    header["elements"], header["materials"] = header["materials"], header["elements"]
    tensors = load(data)
    tensors["bark"], tensors["material.bark"] = tensors["material.bark"], tensors["bark"]
    with pytest.raises(TensorError, match="a material among its geometries"):
        read_zoo(save(tensors, metadata={"scenelang": json.dumps(header)}))


def saved(kind: str, size: tuple[int, int], **options: Any) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", size).save(file, kind, **options)
    return file.getvalue()


@pytest.mark.parametrize(
    ("coding", "data", "words"),
    [
        ("png", BARK.data[:-30], "damaged"),
        ("png", b"", "damaged"),
        ("png", saved("PNG", (8, 5)), "a picture of 8 x 5"),
        ("png", saved("PNG", (10000, 10000)), "damaged"),
        ("png", saved("GIF", (7, 5)), "damaged"),
        ("jpeg", saved("JPEG", (7, 5), progressive=True), "several scans"),
        (
            "webp",
            saved("WEBP", (7, 5), save_all=True, append_images=[Image.new("RGB", (7, 5), "red")]),
            "several scans",
        ),
    ],
)
def test_damaged_pictures(coding: str, data: bytes, words: str) -> None:
    with pytest.raises(TensorError, match=words):
        read_zoo(zoo_bytes([replace(BARK, coding=coding, data=data)]))
