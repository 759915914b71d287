"""Ready groups: what a file says of them comes back, and what it may not say does not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from scenelang.assets import element as groups
from scenelang.assets.element import Part
from scenelang.assets.tensors import TensorError
from scenelang.assets.zoo import read_zoo, zoo_bytes
from tests.assets.shapes import ball, element, noise, torus

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
    data = zoo_bytes(HELD, known)
    assert read_zoo(data).groups == known
    assert zoo_bytes(read_zoo(data).elements, read_zoo(data).groups) == data


def test_elements_without_groups_are_in_files_of_the_old_format() -> None:
    assert b"groups" not in zoo_bytes(HELD[:2])
    assert read_zoo(zoo_bytes(HELD[:1], {"car": CAR[1:]})).groups == {"car": (CAR[1],)}


BAD_PARTS: dict[str, list[dict[str, Any]]] = {
    "not a geometry": [{"geometry": "rng"}, {"geometry": "hide"}, {"geometry": ["ring"]}],
    "not a geometry of its dimension": [{"geometry": "disc"}],
    "a material that the file does not hold": [{"material": "hid"}, {"material": ["hide"]}],
    "out of range": [
        *({"place": value} for value in ((0, 0), (0, 0, 1e300), (0, 0, 1e5), (0, 0, "0"), 3)),
        *({"size": value} for value in (0, -1, True)),
        *({"turn": value} for value in (TURNED[:2], (*TURNED[:2], TURNED[1]), "abc")),
        {"turn": (TURNED[0], TURNED[1], (0, 0, -1e300))},
        {"turn": ((0, [1], 0), *TURNED[1:])},
        {"color": (0, 0)},
        {"color": (0, 0, 1.5)},
    ],
}


def test_groups_of_strangers() -> None:
    for words, changes in BAD_PARTS.items():
        for change in changes:
            data = zoo_bytes(HELD, {"car": (CAR[0], CAR[1]._replace(**change))})
            with pytest.raises(TensorError, match=f"group `car`.*{words}"):
                read_zoo(data)
    for name, group, words in (
        ("no name", CAR, "has the name"),
        ("car", (), "1 to 256 parts"),
        ("car", CAR * 129, "1 to 256 parts"),
    ):
        with pytest.raises(TensorError, match=words):
            read_zoo(zoo_bytes(HELD, {name: group}))


def test_fields_are_those_of_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    for damaged in ("wheel", [CAR], [{"geometry": "ring"}], [{**CAR[0]._asdict(), "name": 1}]):
        monkeypatch.setattr("scenelang.assets.zoo.group_entry", lambda group, damaged=damaged: damaged)
        with pytest.raises(TensorError, match="group `car`"):
            read_zoo(zoo_bytes(HELD, {"car": CAR}))


def test_volumes_are_determinants() -> None:
    for d in (2, 3):
        rows = np.random.default_rng(d).normal(size=(d, d))
        assert groups._volume(tuple(map(tuple, rows))) == pytest.approx(np.linalg.det(rows))
