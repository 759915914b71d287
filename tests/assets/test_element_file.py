"""Files of elements, materials and groups: what comes back, and what is refused."""

from __future__ import annotations

import io
import json
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from unicodedata import normalize

import numpy as np
import pytest
from PIL import Image
from safetensors.numpy import save

import scenelang as nsg
from scenelang.assets import element as elements
from scenelang.assets.element import FORMS, Element, Part
from scenelang.assets.element_file import FontError, element_file_bytes, entry_of, load_element_file, read_zoo
from scenelang.assets.picture import frame_of, painted, size_of, texels
from scenelang.assets.tensors import TensorError
from scenelang.drawing.exact.outline import Picture, fit_picture
from scenelang.language import library
from tests.assets.scenes import IMPORT, changed, good, retyped
from tests.assets.shapes import ball, element, letters, noise, torus


def test_elements_come_back(tmp_path: Path) -> None:
    made = [element(torus, "ring"), element(ball, "ball", cells=6, levels=3)]
    (tmp_path / "zoo.safetensors").write_bytes(element_file_bytes(made))
    zoo = load_element_file(tmp_path / "zoo.safetensors")
    assert list(zoo.elements) == sorted(made, key=lambda e: e.name)
    assert zoo.geometries["ring"].about == {"license": "none needed"}
    assert element_file_bytes(made[::-1]) == element_file_bytes(made)


def test_the_digest_is_that_of_the_shape() -> None:
    one = element(torus)
    assert replace(one, name="other", about={}).digest == one.digest
    assert element(ball).digest != one.digest


def written(entry: dict[str, Any] | None = None, name: str = "ring", **header: Any) -> bytes:
    made = element(torus, "ring", levels=2)
    listed = {name: entry_of(made) | (entry or {})}
    said = {"format": 1, "elements": listed} | header
    text = json.dumps({key: value for key, value in said.items() if value is not None})
    return save({"ring": np.frombuffer(made.data, np.uint8)}, metadata={"scenelang": text})


def refused(cases: list[tuple[bytes, str]]) -> None:
    for data, words in cases:
        with pytest.raises(TensorError, match=words):
            read_zoo(data)


def test_damaged_files() -> None:
    refused(
        [
            (b"", "header"),
            (written(elements=None), "its header has missing"),
            (written(elements=[]), "`elements` of its header is not an object"),
            (written(extra=1), "its header has missing or unknown fields"),
            (written(name="other"), "other elements than it holds"),
            (written({"form": "octree"}), "form that this version does not know"),
            (written({"dimension": 4}), "`dimension` of element `ring` is not a whole number from 2 to 3"),
            (written({"levels": True}), "`levels` of element `ring` is not a whole number from 1 to 9"),
            (written({"cells": 2.5}), "`cells` of element `ring` is not a whole number from 2 to 8"),
            (written({"cells": 8, "levels": 6}), "sizes out of range"),
            (written({"levels": 3}), "does not hold"),
            (written({"levels": 1}), "does not hold"),
            (written({"about": {"license": "x" * 3000}}), "says of itself"),
            (written({"about": {"license": "\x1b[2J"}}), "says of itself"),
            (written({"about": {"x": [1]}}), "says of itself"),
            (written({"new": 1}), "missing or unknown fields"),
        ]
    )


def test_damaged_bytes() -> None:
    ring, bomb = element(torus, levels=2).data, zlib.compress(b"\0" * (1 << 26), 9)  # 64 MB in 65 KB
    cases = dict.fromkeys(
        (b"", b"x" * 50, ring[:-3], ring + b"x", zlib.compress(b"\0" * 10)), "element `ring`"
    )
    cases[bomb] = "does not hold 854 bytes"
    refused(
        [
            (element_file_bytes([Element("ring", "pyramid", (3, 4, 2), "deflate", data)]), words)
            for data, words in cases.items()
        ]
    )


def test_many_elements_hold_no_more_than_one_file_may() -> None:
    whole = b"\0" * sum((6 * 2**level + 1) ** 3 for level in range(6))  # 8 MB
    large = Element("a", "pyramid", (3, 6, 6), "deflate", zlib.compress(whole, 9))
    listed = [replace(large, name=f"a{at}") for at in range(17)]
    with pytest.raises(TensorError, match="more than 134,217,728 bytes"):
        read_zoo(element_file_bytes(listed))


HELD = [
    element(torus, "ring", levels=2),
    element(ball, "disc", levels=2, d=2),
    noise(3, 3, 3, name="hide"),
    noise(3, 3, name="bark"),
]
TURNED = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0))
CAR = (
    Part("ring", (0.0, 0.5, 0), 0.5, material="hide"),
    Part("ring", (0.25, -0.5, 0.0), 0.25, TURNED, (1.0, 0.5, 0.0)),
)


def test_groups_come_back() -> None:
    known = {"car": CAR, "spot": (Part("disc", (0.0, 0.0), 1.0, material="bark"),)}
    data = element_file_bytes(HELD, known)
    assert read_zoo(data).groups == known
    assert element_file_bytes(read_zoo(data).elements, read_zoo(data).groups) == data


def test_elements_without_groups_are_in_files_of_the_old_format() -> None:
    assert b"groups" not in element_file_bytes(HELD[:2])
    assert read_zoo(element_file_bytes(HELD[:1], {"car": CAR[1:]})).groups == {"car": (CAR[1],)}


BAD_PARTS: dict[str, list[dict[str, Any]]] = {
    "not a geometry": [{"geometry": "rng"}, {"geometry": "hide"}],
    "not a geometry of its dimension": [{"geometry": "disc"}],
    "a material that the file does not hold": [{"material": "hid"}],
    "a turn or a colour that is none": [
        {"place": (0, 0)},
        *({"turn": value} for value in (TURNED[:2], (*TURNED[:2], TURNED[1]))),
        {"color": (0, 0)},
    ],
    "is not (a number from|text|a list)": [
        {"geometry": ["ring"]},
        {"material": ["hide"]},
        *({"place": value} for value in ((0, 0, 1e300), (0, 0, 1e5), (0, 0, "0"), 3)),
        *({"size": value} for value in (0, -1, True, None)),
        {"turn": "abc"},
        {"turn": (TURNED[0], TURNED[1], (0, 0, -1e300))},
        {"turn": ((0, [1], 0), *TURNED[1:])},
        {"color": (0, 0, 1.5)},
    ],
}


def test_groups_of_strangers() -> None:
    for words, changes in BAD_PARTS.items():
        for change in changes:
            data = element_file_bytes(HELD, {"car": (CAR[0], CAR[1]._replace(**change))})
            with pytest.raises(TensorError, match=f"group `car`.*{words}"):
                read_zoo(data)
    for name, group, words in (
        ("no name", CAR, "has the name"),
        ("car", (), "1 to 256 parts"),
        ("car", CAR * 129, "1 to 256 parts"),
    ):
        with pytest.raises(TensorError, match=words):
            read_zoo(element_file_bytes(HELD, {name: group}))


def test_fields_are_those_of_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    for damaged in ("wheel", [CAR], [{"geometry": "ring"}], [{**CAR[0]._asdict(), "name": 1}]):
        monkeypatch.setattr(
            "scenelang.assets.element_file.group_entry", lambda group, damaged=damaged: damaged
        )
        with pytest.raises(TensorError, match="`car`"):
            read_zoo(element_file_bytes(HELD, {"car": CAR}))


def test_headers_of_other_types_are_refused_or_drawn(tmp_path: Path) -> None:
    """Columns of a table of kerning that were a dict or null ended in a traceback."""
    data = element_file_bytes(HELD[:3], {"car": CAR[:1]}, letters())
    header = json.loads(
        json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])["__metadata__"]["scenelang"]
    )
    read = 0
    for change in retyped(header):
        harmed = changed(data, lambda old, _, new=change: (old.clear(), old.update(new)))
        try:
            zoo = read_zoo(harmed)
        except TensorError:
            continue
        read += 1
        assert all(e.told() for e in zoo.elements)
        if read % 10 == 0:
            (tmp_path / "zoo.safetensors").write_bytes(harmed)
            text = "".join(f"zoo.{name};" for name, e in zoo.geometries.items() if e.dimension == 2)
            nsg.render(good(tmp_path, f"{IMPORT}{text}"), size=(16, 16))
    assert 20 < read < 400


def test_letters_and_their_marks_are_one_where_the_font_has_them() -> None:
    font = load_element_file(library.find("std/letters") or "").font
    assert font is not None
    text = "Ag\u00e9\u1ec7\u00c5\u00fc"
    known = "".join(c for c in text if c in font.letters)
    assert len(known) > 3
    assert font.line(normalize("NFD", known)) == font.line(known)
    assert font.line("\u2126") == font.line("\u03a9")  # of ohm, and omega
    for text, at in (("e\u0301x\u0301", 3), ("e\u0301\u6f22", 2), ("\u0301", 0), ("e\u0301\u0489", 2)):
        with pytest.raises(FontError) as error:
            font.line(text)
        assert error.value.at == at
    with pytest.raises(FontError, match=r"U\+00C1") as error:
        letters().line(" A\u0301")
    assert error.value.at == 1


def test_volumes_are_determinants() -> None:
    for d in (2, 3):
        rows = np.random.default_rng(d).normal(size=(d, d))
        assert elements._volume(tuple(map(tuple, rows))) == pytest.approx(np.linalg.det(rows))


BARK = noise(5, 7)


def test_colours_come_back() -> None:
    for shape in ((1, 1), (5, 7)):
        colours = np.random.default_rng(1).integers(0, 256, (*shape, 3), np.uint8)
        (found,) = read_zoo(element_file_bytes([painted("bark", colours)])).elements
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
        assert read_zoo(element_file_bytes([one])).materials == {"bark": one}
        with pytest.raises(TensorError, match="`bark` is damaged"):
            texels(replace(one, coding=other.coding))


def test_a_geometry_and_a_material_share_a_name() -> None:
    made = [element(torus, "cow", levels=2), noise(3, 3, name="cow"), noise(2, 2, 2, name="hide")]
    zoo = read_zoo(element_file_bytes(made))
    assert (list(zoo.geometries), list(zoo.materials)) == (["cow"], ["cow", "hide"])
    assert {e.digest for e in zoo.elements} == {e.digest for e in made}
    assert [e.kind for e in zoo.elements] == ["element of space", "texture", "colouring of space"]
    assert element_file_bytes(zoo.elements) == element_file_bytes(made[::-1])


def test_the_digest_is_that_of_the_colours() -> None:
    assert replace(BARK, name="other", about={}).digest == BARK.digest
    assert len({BARK.digest, noise(5, 7, seed=1).digest, replace(BARK, sizes=(7, 5)).digest}) == 3


def other(**entry: Any) -> bytes:
    def change(header: dict[str, Any], _: object) -> None:
        header["materials"]["bark"] |= entry
        header |= {key: value for key, value in entry.items() if key in header}

    return changed(element_file_bytes([BARK]), change)


def test_damaged_entries() -> None:
    refused(
        [
            (other(height=6), "a picture of 7 x 5"),
            (other(height=2049), "`height` of element `bark` is not a whole number from 1 to 2,048"),
            (other(width=0), "`width` of element `bark` is not a whole"),
            (other(coding="exr"), "a coding that this version does not know"),
            (other(coding=["webp"]), "`coding` of element `bark` is not text"),
            (other(coding="av1"), "damaged"),
            (other(form="colours"), "missing or unknown fields"),
            (other(elements={"bark": {}}), "other elements than it holds"),
            (other(format=1), "its header has missing or unknown fields"),
        ]
    )


def test_a_material_is_not_listed_as_a_geometry() -> None:
    made = element(torus, "bark", levels=2)

    def swap(header: dict[str, Any], tensors: dict[str, Any]) -> None:
        header["elements"], header["materials"] = header["materials"], header["elements"]
        tensors["bark"], tensors["material.bark"] = tensors["material.bark"], tensors["bark"]

    with pytest.raises(TensorError, match="a material among its geometries"):
        read_zoo(changed(element_file_bytes([made, BARK]), swap))


def saved(kind: str, size: tuple[int, int], **options: Any) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", size).save(file, kind, **options)
    return file.getvalue()


STILL = still(np.random.default_rng(1).integers(0, 256, (5, 7, 3), np.uint8))


def test_damaged_pictures() -> None:
    cases = [
        ("webp", BARK.data[:-30], "damaged"),
        ("webp", b"", "damaged"),
        ("webp", saved("WEBP", (8, 5)), "a picture of 8 x 5"),
        ("webp", saved("WEBP", (10000, 10000), quality=0, method=0), "damaged"),
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
        ("av1", frame_of(saved("AVIF", (300, 100), subsampling="4:4:4")), "a picture of 300 x 100"),
    ]
    refused(
        [
            (element_file_bytes([replace(BARK, coding=coding, data=data)]), words)
            for coding, data, words in cases
        ]
    )


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
