"""Fixtures: a server for each module of tests, over a folder of small scenes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")
pytest.importorskip("watchfiles")

from tests.play.client import Page, Server

SQUARE = "canvas(64, 48);\nsquare { scale(0.5); material flat { color(#f00); } }\n"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = tmp_path_factory.mktemp("scenes")
    for name in ("a", "b"):
        (folder / f"{name}.nsg").write_text(SQUARE)
    server = Server(folder, tmp_path_factory.mktemp("state"))
    server.folder = folder  # type: ignore[attr-defined]
    yield server
    assert server.end() == 130


@pytest.fixture
def folder(server: Server) -> Path:
    path: Path = server.folder  # type: ignore[attr-defined]
    return path


@pytest.fixture
def page(server: Server) -> Iterator[Page]:
    with server.page() as page:
        yield page
