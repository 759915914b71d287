"""Pictures as textures: what is read of each kind of file, and the smallest form that is near enough."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from PIL import ExifTags, Image, ImageCms

from scenelang.assets.picture import texels
from scenelang.drawing.exact.mesh import FitError
from scenelang.drawing.exact.outline import NEAR_COLOUR, Picture, fit_picture, read_picture

RAMP = np.linspace(20, 235, 12 * 8 * 3).reshape(12, 8, 3).astype(np.uint8)


def file(image: Image.Image, kind: str = "PNG", **options: Any) -> bytes:
    out = io.BytesIO()
    image.save(out, kind, **options)
    return out.getvalue()


def turned(orientation: int) -> bytes:
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    return file(Image.fromarray(RAMP), exif=exif)


def clear() -> Image.Image:
    """The ramp, opaque on the left and clear on the right."""
    image = Image.fromarray(RAMP).convert("RGBA")
    image.paste((0, 0, 0, 0), (4, 0, 8, 12))
    return image


OVER = np.where(np.arange(8)[:, None] < 4, RAMP, 255)
GREY = np.linspace(0, 65535, 96).astype(np.uint16).reshape(12, 8)


def test_what_is_read() -> None:
    for data, expected, said in (
        (file(Image.fromarray(RAMP)), RAMP, ()),
        (turned(6), np.rot90(RAMP, -1), ("turned as its EXIF says",)),
        (turned(3), RAMP[::-1, ::-1], ("turned as its EXIF says",)),
        (file(clear()), OVER, ("laid over white",)),
        (file(Image.fromarray(RAMP).convert("RGBA")), RAMP, ()),
        (file(Image.fromarray(GREY)), np.rint(GREY / 257)[..., None].repeat(3, 2), ("16 bits made 8",)),
        (file(Image.fromarray(RAMP[..., 0])), RAMP[..., :1].repeat(3, 2), ()),
        (file(Image.fromarray(RAMP).quantize(256)), RAMP, ()),
        (file(clear().quantize(97)), OVER, ("laid over white",)),
        (file(Image.new("1", (3, 2), 1)), np.full((2, 3, 3), 255), ()),
    ):
        found = read_picture(data)
        assert found.notes[1:] == said
        assert found.colours.dtype == np.uint8
        np.testing.assert_allclose(
            found.colours, expected, atol=12 if "P" in Image.open(io.BytesIO(data)).mode else 0
        )


def test_colours_of_ink_are_light() -> None:
    """Cyan ink is no red; the file is read as other programs do."""
    found = read_picture(file(Image.new("CMYK", (16, 16), (255, 0, 0, 0)), "JPEG", quality=100)).colours
    assert found[8, 8, 0] < 30
    assert found[8, 8, 1:].min() > 150


def test_colour_profiles() -> None:
    """sRGB's own changes nothing, one with red and blue exchanged exchanges them; damage is said."""
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    assert read_picture(file(Image.fromarray(RAMP), icc_profile=srgb)).notes == ("8 × 12 pixels",)
    other = srgb.replace("sRGB".encode("utf-16-be"), "xRGB".encode("utf-16-be"))
    other = other.replace(b"rXYZ", b"?XYZ").replace(b"bXYZ", b"rXYZ").replace(b"?XYZ", b"bXYZ")
    found = read_picture(file(clear(), icc_profile=other))
    assert found.notes[1].startswith("from the colour profile `xRGB")
    assert found.notes[2:] == ("laid over white",)
    assert abs(found.colours.astype(int) - OVER[..., ::-1]).max() <= 3
    damaged = read_picture(file(Image.fromarray(RAMP), icc_profile=srgb[:200]))
    assert damaged.notes[1:] == ("its colour profile cannot be read: taken as sRGB",)
    np.testing.assert_array_equal(damaged.colours, RAMP)


def test_larger_pictures_are_made_smaller() -> None:
    wide = Image.linear_gradient("L").resize((1000, 300))
    found = read_picture(file(wide), side=100)
    assert found.colours.shape == (30, 100, 3)
    assert found.notes == ("1000 × 300 pixels", "made 100 × 30")
    true = np.asarray(wide, float).reshape(30, 10, 100, 10).mean((1, 3))
    assert abs(found.colours[2:-2, 2:-2, 0] - true[2:-2, 2:-2]).max() < 3


def test_what_is_not_read() -> None:
    for data, words in (
        (b"", "neither a PNG nor a JPEG"),
        (b"no picture", "neither a PNG nor a JPEG"),
        (file(Image.fromarray(RAMP))[:-40], "damaged or not a picture"),
        (file(Image.fromarray(RAMP), "GIF"), "neither a PNG nor a JPEG"),
        (file(Image.new("1", (9000, 9000))), "more than 50,000,000 pixels"),
        (file(Image.new("1", (20000, 20000))), "damaged or not a picture: Image size"),
    ):
        with pytest.raises(FitError, match=words):
            read_picture(data)


def photo() -> np.ndarray:
    """Smooth, with noise, as photographs are."""
    y, x = np.mgrid[:64, :64] / 64
    waves = np.stack([np.sin(6 * x + 3 * y), np.cos(5 * y), np.sin(9 * x * y)], -1)
    return np.rint(128 + 80 * waves + np.random.default_rng(1).normal(0, 6, waves.shape)).astype(np.uint8)


def flag() -> np.ndarray:
    return np.kron(np.random.default_rng(2).integers(0, 2, (8, 8, 3)) * 255, np.ones((8, 8, 1))).astype(
        np.uint8
    )


def test_the_smallest_that_is_near_enough() -> None:
    for colours, coding in ((photo(), "av1"), (flag(), "webp")):
        element, tried = fit_picture(Picture(colours), "a")
        off = np.sqrt(((texels(element) * 255.0 - colours) ** 2).mean()) / 255
        assert element.coding == coding
        assert element.about["error"] == pytest.approx(off, abs=1e-6)
        assert off <= NEAR_COLOUR
        enough = [coded.bytes for coded in tried if coded.error <= NEAR_COLOUR]
        assert len(element.data) == min(enough)
        assert element.about["steps"] == len(tried)


def test_a_smaller_error_takes_more_bytes_and_none_is_exact() -> None:
    picture = Picture(photo())
    found = [fit_picture(picture, "a", max_error=error)[0] for error in (0.1, 0.02, 0.005, 1e-6)]
    assert [len(e.data) for e in found] == sorted(len(e.data) for e in found)
    np.testing.assert_array_equal(np.rint(texels(found[-1]) * 255), picture.colours)


def test_steps_give_the_same_bytes_as_the_budget_that_took_them() -> None:
    picture = Picture(photo())
    for given in ({"budget_s": 0.0}, {"steps": 3}):
        element, tried = fit_picture(picture, "a", **given)
        assert element.about["ended"] == "steps"
        again, _ = fit_picture(picture, "a", steps=len(tried))
        assert again == element
