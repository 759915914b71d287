"""One server for all tests of this folder, the scenes that it has open, and a document to work on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.editors.client import Client

LIBRARY = """// Pieces to import.
let unit = 0.5;
// A dot of some size.
module dot(at, size = 0.2) { star { scale(size * unit); translate(at); } }
fn twice(x) = 2 * x;
"""
SCENE = """nsg 1;
import "lib.nsg" as lib;
param k = 0.5 in 0..1;
let r = lib.twice(k);    // how large
module ring(n, c = #d33) {
  for (i in 0..<n) {
    square { scale(0.2 * r); twirl(k); translate(0.5, 0); rotate(1turn * i / n); material flat { color(c); } }
  }
}
ring(3, c = hsv(0.1, 1, 1));
lib.dot(at = [0.1, 0.2], size = r);
"""


@pytest.fixture(scope="package")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("scenes")
    (root / "lib.nsg").write_text(LIBRARY, "utf-8")
    (root / "main.nsg").write_text(SCENE, "utf-8")
    return root


@pytest.fixture(scope="package")
def client(folder: Path) -> Iterator[Client]:
    with Client(folder) as client:
        yield client
        assert client.stop() == 0
        assert "internal error" not in str(client.logged)


@pytest.fixture
def uri(client: Client, folder: Path) -> Iterator[str]:
    uri = client.open((folder / "main.nsg").as_uri(), SCENE)
    assert client.diagnostics(uri) == []
    yield uri
    client.close(uri)
    client.next_diagnostics(uri)
    client.published.pop(uri)
