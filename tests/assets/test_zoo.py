"""Files of elements: what comes back, and what is refused."""

from __future__ import annotations

import json
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import save

from scenelang.assets.element import Element
from scenelang.assets.tensors import TensorError
from scenelang.assets.zoo import entry_of, load_zoo, read_zoo, zoo_bytes
from tests.assets.shapes import ball, element, torus


def test_elements_come_back(tmp_path: Path) -> None:
    made = [element(torus, "ring"), element(ball, "ball", cells=6, levels=3)]
    (tmp_path / "zoo.safetensors").write_bytes(zoo_bytes(made))
    zoo = load_zoo(tmp_path / "zoo.safetensors")
    assert list(zoo.elements) == sorted(made, key=lambda e: e.name)
    assert zoo.geometries["ring"].about == {"license": "none needed"}
    assert zoo_bytes(made[::-1]) == zoo_bytes(made)


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


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "header"),
        (written(elements=None), "not a file of elements"),
        (written(elements=[]), "not a file of elements"),
        (written(extra=1), "not a file of elements"),
        (written(name="other"), "other elements than it holds"),
        (written({"form": "octree"}), "form that this version does not know"),
        (written({"dimension": 4}), "sizes out of range"),
        (written({"levels": True}), "sizes out of range"),
        (written({"cells": 2.5}), "sizes out of range"),
        (written({"cells": 8, "levels": 6}), "sizes out of range"),
        (written({"levels": 3}), "does not hold"),
        (written({"levels": 1}), "does not hold"),
        (written({"about": {"license": "x" * 3000}}), "says of itself"),
        (written({"about": {"license": "\x1b[2J"}}), "says of itself"),
        (written({"about": {"x": [1]}}), "says of itself"),
        (written({"new": 1}), "missing or unknown fields"),
    ],
)
def test_damaged_files(data: bytes, words: str) -> None:
    with pytest.raises(TensorError, match=words):
        read_zoo(data)


def packed_as(data: bytes) -> bytes:
    return zoo_bytes([Element("ring", "pyramid", (3, 4, 2), "deflate", data)])


RING = element(torus, levels=2).data


@pytest.mark.parametrize("data", [b"", b"x" * 50, RING[:-3], RING + b"x", zlib.compress(b"\0" * 10)])
def test_damaged_bytes(data: bytes) -> None:
    with pytest.raises(TensorError, match="element `ring`"):
        read_zoo(packed_as(data))


def test_bytes_that_would_inflate_to_more_are_left_deflated() -> None:
    bomb = zlib.compress(b"\0" * (1 << 26), 9)  # 64 MB in 65 KB
    with pytest.raises(TensorError, match="does not hold 854 bytes"):
        read_zoo(packed_as(bomb))


def test_many_elements_hold_no_more_than_one_file_may() -> None:
    whole = b"\0" * sum((6 * 2**level + 1) ** 3 for level in range(6))  # 8 MB
    large = Element("a", "pyramid", (3, 6, 6), "deflate", zlib.compress(whole, 9))
    listed = [replace(large, name=f"a{at}") for at in range(17)]
    with pytest.raises(TensorError, match="more than 134,217,728 bytes"):
        read_zoo(zoo_bytes(listed))
