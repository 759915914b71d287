"""Elements in editors, over real pipes."""

from __future__ import annotations

from pathlib import Path

from scenelang.elements.zoo import zoo_bytes
from tests.elements.shapes import ball, element, torus
from tests.lsp.client import Client
from tests.lsp.test_completion import labels
from tests.lsp.test_hover import hover


def test_elements_are_proposed_and_told_of(client: Client, uri: str) -> None:
    zoo = Path(uri.removeprefix("file://")).with_name("zoo.safetensors")
    zoo.write_bytes(zoo_bytes([element(torus, "ring"), element(ball, "ball")]))
    client.replace(uri, 'import "zoo.safetensors" as zoo;\nzoo.ring { scale(0.5); }\nzoo.;\n')
    assert labels(client, client.at(uri, "zoo.;", 4)) == ["ball", "ring"]
    told = hover(client, client.at(uri, "zoo.ring", 5))
    assert "element of space: 33 × 33 × 33 distances" in told
    assert "license: none needed" in told
