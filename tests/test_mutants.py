"""The list of mutants: what is changed, and that its files and tests are there."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import mutants
from tests.mutants import ROOT, TARGETS

TEXT = '''
NEAR = 0.85

def clamp(x: float = 1.0) -> float:
    """Not 2."""
    assert x > 0
    if not x or x < -3:
        raise ValueError(x + 1)
    return min(x, 40) * [True][0]
'''


def test_what_is_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "scenelang" / "file.py"
    path.parent.mkdir()
    path.write_text(TEXT)
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    found = list(mutants.mutants(path))
    assert sorted(m.name.partition(": ")[2] for m in found if m.line < 9) == [
        "NEAR = 0.85 -> NEAR = 0.425",
        "NEAR = 0.85 -> NEAR = 1.275",
        "if not x or x < -3: -> if not x and x < -3:",
        "if not x or x < -3: -> if not x or x < -2:",
        "if not x or x < -3: -> if not x or x < 3:",
        "if not x or x < -3: -> if not x or x >= -3:",
        "if not x or x < -3: -> if x or x < -3:",
        "x: float=1.0 -> x: float=0.5",
        "x: float=1.0 -> x: float=1.5",
    ]
    assert sorted(m.name.partition(" -> return ")[2] for m in found if m.line == 9) == [
        "max(x, 40) * [True][0]",
        "min(x, 20) * [True][0]",
        "min(x, 40) * [False][0]",
        "min(x, 40) * [True][1]",
        "min(x, 40) / [True][0]",
    ]
    spaces = []
    for mutant in found:
        spaces.append(space := {})
        exec(mutant.code(), space)
    assert [space["NEAR"] for space in spaces[:3]] == [0.425, 1.275, 0.85]
    assert path.read_text() == TEXT


def test_tables_name_what_there_is() -> None:
    for pattern, tests in TARGETS.items():
        assert list(ROOT.glob(pattern)), pattern
        assert all((ROOT / test).exists() for test in tests), pattern
