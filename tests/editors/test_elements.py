"""Elements in editors, over real pipes."""

from __future__ import annotations

from base64 import b64decode
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scenelang.assets.element import Part
from scenelang.assets.zoo import zoo_bytes
from tests.assets.shapes import ball, element, noise, square, torus
from tests.editors.client import CAPABILITIES, Client
from tests.editors.test_completion import labels
from tests.editors.test_hover import hover


def test_elements_are_proposed_and_told_of(client: Client, uri: str) -> None:
    zoo = Path(uri.removeprefix("file://")).with_name("zoo.safetensors")
    zoo.write_bytes(zoo_bytes([element(torus, "ring"), element(ball, "ball")]))
    client.replace(uri, 'import "zoo.safetensors" as zoo;\nzoo.ring { scale(0.5); }\nzoo.;\n')
    assert labels(client, client.at(uri, "zoo.;", 4)) == ["ball", "ring"]
    told = hover(client, client.at(uri, "zoo.ring", 5))
    assert "element of space: 33 × 33 × 33 distances" in told
    assert "license: none needed" in told


def test_materials_are_proposed_told_of_and_found(client: Client, uri: str) -> None:
    zoo = Path(uri.removeprefix("file://")).with_name("zoo.safetensors")
    zoo.write_bytes(zoo_bytes([element(torus, "ring"), noise(2, 3, name="ring"), noise(2, 2)]))
    text = (
        'import "zoo.safetensors" as zoo;\nsphere { material diffuse zoo.ring; }\ntorus { material zoo.; }\n'
    )
    client.replace(uri, text)
    assert labels(client, client.at(uri, "zoo.; }", 4)) == ["bark", "ring"]
    assert "zoo" in labels(client, client.at(uri, "material diffuse zoo", 9))
    assert labels(client, client.at(uri, "diffuse zoo", 8))[-1] == "zoo"
    told = hover(client, client.at(uri, "zoo.ring;", 5))
    assert "texture: 3 × 2 colours" in told
    assert "distances" not in told
    found = client.request("textDocument/definition", client.at(uri, "zoo.ring;", 5))
    assert found["range"]["start"]["line"] == 0


@pytest.mark.parametrize("shows", [True, False])
def test_elements_are_shown_where_the_editor_shows_pictures(
    shows: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if shows:
        markdown = {"parser": "marked", "allowedTags": ["p", "img"]}
        monkeypatch.setitem(CAPABILITIES["general"], "markdown", markdown)
    (tmp_path / "zoo.safetensors").write_bytes(
        zoo_bytes([element(torus, "ring"), element(square, "tile", d=2)])
    )
    client = Client(tmp_path)
    try:
        text = 'import "zoo.safetensors" as zoo;\nzoo.ring { }\nzoo.tile { }\n'
        uri = client.open((tmp_path / "a.nsg").as_uri(), text)
        told = [hover(client, client.at(uri, name, 5)) for name in ("zoo.ring", "zoo.tile", "zoo.ring")]
    finally:
        client.kill()
    pictures = [text.partition("(data:image/png;base64,")[2].partition(")")[0] for text in told]
    assert pictures[0] == pictures[2]
    assert [bool(picture) for picture in pictures] == [shows] * 3
    if shows:
        ring, tile = (np.asarray(Image.open(BytesIO(b64decode(picture)))) for picture in pictures[:2])
        assert ring.shape == tile.shape == (96, 96, 3)
        assert max(map(len, pictures)) < 20_000
        assert tile[48, 48].tolist() == [34, 34, 34]
        assert tile[2, 2].tolist() == [255, 255, 255]
        assert np.ptp(ring[40:56, 40:56, 0]) > 40  # lit


def test_groups_are_proposed_and_told_of(client: Client, uri: str) -> None:
    zoo = Path(uri.removeprefix("file://")).with_name("zoo.safetensors")
    ring = Part("ring", (0.0, 0.5, 0.0), 0.5)
    zoo.write_bytes(zoo_bytes([element(torus, "ring")], {"car": (ring, ring), "ring": (ring,)}))
    client.replace(uri, 'import "zoo.safetensors" as zoo;\nzoo.car();\nzoo.ring();\nzoo.;\n')
    assert labels(client, client.at(uri, "zoo.;", 4)) == ["car()", "ring", "ring()"]
    assert "car(): group of 2 ring" in hover(client, client.at(uri, "zoo.car", 5))
    told = hover(client, client.at(uri, "zoo.ring", 5))
    assert "distances" in told
    assert "ring(): group of ring" in told
