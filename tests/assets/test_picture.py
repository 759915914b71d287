"""Materials of users: their colours come back, and damaged or hostile ones do not."""

from __future__ import annotations

import io
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from scenelang.assets.element import FORMS, Element
from scenelang.assets.picture import frame_of, painted, size_of, texels
from scenelang.assets.tensors import TensorError
from scenelang.assets.zoo import load_zoo, read_zoo, zoo_bytes
from scenelang.drawing.exact.outline import Picture, fit_picture
from tests.assets.scenes import changed
from tests.assets.shapes import element, noise, torus

BARK = noise(5, 7)


@pytest.mark.parametrize("shape", [(1, 1), (5, 7)])
def test_colours_come_back(shape: tuple[int, ...], tmp_path: Path) -> None:
    colours = np.random.default_rng(1).integers(0, 256, (*shape, 3), np.uint8)
    (tmp_path / "zoo.safetensors").write_bytes(zoo_bytes([painted("bark", colours)]))
    (found,) = load_zoo(tmp_path / "zoo.safetensors").elements
    np.testing.assert_array_equal(texels(found), colours.astype(np.float32) / 255)
    assert found.held == colours.size


def still(colours: np.ndarray) -> Element:
    """A picture as AV1."""
    return fit_picture(Picture(colours), "bark", max_error=0.05)[0]


def test_another_coding_is_not_tried() -> None:
    ramp = np.linspace(0, 255, 16 * 24 * 3).reshape(16, 24, 3).astype(np.uint8)
    made = [painted("bark", ramp), still(ramp)]
    assert [element.coding for element in made] == [*FORMS["picture"].codings]
    for one, other in zip(made, made[::-1], strict=True):
        assert abs(texels(one) * 255 - ramp).max() < 20
        assert read_zoo(zoo_bytes([one])).materials == {"bark": one}
        with pytest.raises(TensorError, match="`bark` is damaged"):
            texels(replace(one, coding=other.coding))


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


def other(**entry: Any) -> bytes:
    def change(header: dict[str, Any], _: object) -> None:
        header["materials"]["bark"] |= entry
        header |= {key: value for key, value in entry.items() if key in header}

    return changed(zoo_bytes([BARK]), change)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (other(height=6), "a picture of 7 x 5"),
        (other(height=2049), "sizes out of range"),
        (other(width=0), "sizes out of range"),
        (other(coding="exr"), "a coding that this version does not know"),
        (other(coding=["webp"]), "a coding that this version does not know"),
        (other(coding="av1"), "damaged"),
        (other(form="colours"), "missing or unknown fields"),
        (other(elements={"bark": {}}), "other elements than it holds"),
        (other(format=1), "not a file of elements"),
    ],
)
def test_damaged_entries(data: bytes, words: str) -> None:
    with pytest.raises(TensorError, match=words):
        read_zoo(data)


def test_a_material_is_not_listed_as_a_geometry() -> None:
    made = element(torus, "bark", levels=2)

    def swap(header: dict[str, Any], tensors: dict[str, Any]) -> None:
        header["elements"], header["materials"] = header["materials"], header["elements"]
        tensors["bark"], tensors["material.bark"] = tensors["material.bark"], tensors["bark"]

    with pytest.raises(TensorError, match="a material among its geometries"):
        read_zoo(changed(zoo_bytes([made, BARK]), swap))


def saved(kind: str, size: tuple[int, int], **options: Any) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", size).save(file, kind, **options)
    return file.getvalue()


STILL = still(np.random.default_rng(1).integers(0, 256, (5, 7, 3), np.uint8))


@pytest.mark.parametrize(
    ("coding", "data", "words"),
    [
        ("webp", BARK.data[:-30], "damaged"),
        ("webp", b"", "damaged"),
        ("webp", saved("WEBP", (8, 5)), "a picture of 8 x 5"),
        ("webp", saved("WEBP", (10000, 10000)), "damaged"),
        ("webp", saved("GIF", (7, 5)), "damaged"),
        (
            "webp",
            saved("WEBP", (7, 5), save_all=True, append_images=[Image.new("RGB", (7, 5), "red")]),
            "more than one frame",
        ),
        ("av1", STILL.data[:-9], "not a sequence header and a frame"),
        ("av1", b"", "not a sequence header and a frame"),
        ("av1", STILL.data * 2, "more than one frame"),
        ("av1", STILL.data[:3] + b"\0" + STILL.data[4:], "damaged"),
        ("av1", frame_of(saved("AVIF", (7, 5), subsampling="4:2:0")), "not a still picture"),
        ("av1", frame_of(saved("AVIF", (4096, 4096), subsampling="4:4:4")), "a picture of 4096 x 4096"),
    ],
)
def test_damaged_pictures(coding: str, data: bytes, words: str) -> None:
    with pytest.raises(TensorError, match=words):
        read_zoo(zoo_bytes([replace(BARK, coding=coding, data=data)]))


def test_the_frame_says_its_size_before_it_takes_memory() -> None:
    """A container of 7 by 5 texels with a frame of a thousand times as many never reaches the decoder."""
    large = frame_of(saved("AVIF", (300, 100), subsampling="4:4:4"))
    assert (size_of(large), size_of(STILL.data)) == ((100, 300), (5, 7))
    for at in range(min(len(STILL.data), 40)):  # whatever is changed, it is refused or as large as it says
        for bit in range(8):
            data = bytearray(STILL.data)
            data[at] ^= 1 << bit
            with suppress(TensorError):
                assert texels(replace(STILL, data=bytes(data))).shape == (5, 7, 3)
