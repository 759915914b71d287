"""A folder of scenes to run commands in."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Folder


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return Folder(tmp_path)
