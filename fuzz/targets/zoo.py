"""Any bytes as a file of elements, whose small ones are drawn."""

from __future__ import annotations

import math
import warnings
from contextlib import suppress
from functools import cache

from fuzz import tensors
from fuzz.target import Target, hold
from scenelang.assets.element import Part
from scenelang.assets.element_file import FontError, element_file_bytes, read_zoo
from scenelang.assets.tensors import TensorError
from scenelang.drawing.small import thumbnail
from tests.assets.shapes import ball, element, letters, noise, square, torus

SIDE_PX = 12
MOST_DRAWN = 30_000
"""Bytes of an element, unpacked, that is drawn."""


def check(data: bytes) -> None:
    """Read, write, read again, and draw small."""
    try:
        zoo = read_zoo(data)
    except TensorError as error:
        hold(len(str(error)) < 1000, "errors are short", str(error)[:300])
        return
    written = element_file_bytes(zoo.elements, zoo.groups, zoo.font)
    again = read_zoo(written)
    hold(
        element_file_bytes(again.elements, again.groups, again.font) == written, "elements to bytes and back"
    )
    hold(again.groups == zoo.groups, "groups stay")
    if zoo.font is not None:
        with suppress(FontError):
            hold(math.isfinite(zoo.font.line("A A")[1]), "a line has a width")
    for old, new in zip(zoo.elements, again.elements, strict=True):
        hold((old, old.about, old.digest) == (new, new.about, new.digest), "elements stay", old.name)
        hold(old.told(), "elements are told of")
        if old.held <= MOST_DRAWN and old.form != "colours":
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                picture = thumbnail(old, SIDE_PX)
            hold(picture.shape == (SIDE_PX, SIDE_PX, 3), "a picture of the size", picture.shape)
            hold(bool(((picture >= 0) & (picture <= 1)).all()), "pixels lie in [0, 1]")


@cache
def seeds() -> list[bytes]:
    """Elements of each form, a group of them, and the beginnings of a file."""
    solid, flat = element(torus, "ring", levels=2), element(square, "tile", levels=3, d=2)
    bark, hide = noise(5, 4, name="bark"), noise(3, 3, 3, name="hide")
    group = (Part("ring", (0.0, 0.5, 0.0), 0.5, material="hide"), Part("ring", (0.0, 0.0, 0.0), 0.5))
    whole = element_file_bytes([solid, flat, bark, hide], {"two": group})
    lettered = element_file_bytes([flat], {}, letters())
    one = element_file_bytes([element(ball, "ball", levels=2)])
    return [
        whole,
        lettered,
        one,
        element_file_bytes([flat]),
        element_file_bytes([bark]),
        b"",
        one[:-1],
        one[:8],
        b"\2" + bytes(7) + b"{}",
    ]


def dictionary() -> list[bytes]:
    """Words of the headers."""
    words = (
        "form pyramid picture colours coding webp av1 about elements materials groups dimension font columns"
    )
    return tensors.quoted(f"{words} cells U8 dtype data_offsets shape format")


TARGET = Target(
    name="zoo",
    summary="any bytes are a file of elements or a TensorError; elements and groups stay as they are through "
    "their file, and are drawn without a warning in numbers within [0, 1]",
    check=check,
    seeds=seeds,
    mutate=tensors.mutate,
    dictionary=dictionary,
    most_bytes=32_768,
)
