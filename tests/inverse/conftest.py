"""Settings of these tests."""

import pytest

from tests.inverse.fewer import settle_by_fewer


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    settle_by_fewer(monkeypatch)
