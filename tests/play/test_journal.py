"""What is not saved is kept, for its owner alone, and found again."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

from scenelang.web.folder import MOST_DAYS, MOST_KEPT, Journal, state_folder

SCENE = Path("/scenes/a.nsg")


def test_a_text_is_found_again(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "deep/play")
    assert journal.find(SCENE) is None
    journal.keep(SCENE, "square; // \u202e", "abc")
    journal.keep(Path("/scenes/b.nsg"), "other", None)
    found = Journal(tmp_path / "deep/play").find(SCENE)
    assert found is not None
    assert (found.text, found.disk) == ("square; // \u202e", "abc")
    assert 0 <= found.seconds < 60
    (entry,) = [path for path in journal.folder.iterdir() if "square" in path.read_text()]
    assert entry.stat().st_mode & 0o777 == 0o600
    assert journal.folder.stat().st_mode & 0o777 == 0o700
    journal.drop(SCENE)
    assert journal.find(SCENE) is None
    journal.drop(SCENE)


def test_damaged_entries_are_none(tmp_path: Path) -> None:
    good = {"file": str(SCENE), "text": "x", "disk": None, "time": 0}
    changes = ({"file": "/other.nsg"}, {"text": 1}, {"time": "now"})
    wrong = [json.dumps({**good, **change}).encode() for change in changes]
    journal = Journal(tmp_path)
    journal.keep(SCENE, "x", None)
    (entry,) = tmp_path.iterdir()
    for data in (*wrong, b"", b"{", b"[]", b"\xff", b'{"file": "/scenes/a.nsg"}', b"[" * 100_000):
        entry.write_bytes(data)
        assert journal.find(SCENE) is None, data[:80]


def test_old_ones_go(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    for number in range(MOST_KEPT + 5):
        journal.keep(Path(f"/scenes/{number}.nsg"), "x", None)
        at = time.time() - (MOST_KEPT + 5 - number)
        os.utime(journal._place(Path(f"/scenes/{number}.nsg")), (at, at))
    old = time.time() - (MOST_DAYS + 1) * 86400
    os.utime(journal._place(Path("/scenes/50.nsg")), (old, old))
    journal.tidy()
    kept = [n for n in range(MOST_KEPT + 5) if journal.find(Path(f"/scenes/{n}.nsg"))]
    assert kept == [n for n in range(4, MOST_KEPT + 5) if n != 50]


def test_where_it_lies() -> None:
    home = Path.home()
    for environment, platform, expected in (
        ({"SCENELANG_STATE": "/own", "XDG_STATE_HOME": "/x"}, "linux", Path("/own")),
        ({"XDG_STATE_HOME": "/x"}, "linux", Path("/x/scenelang")),
        ({"XDG_STATE_HOME": "x"}, "linux", home / ".local/state/scenelang"),
        ({}, "darwin", home / "Library/Application Support/scenelang"),
        ({"LOCALAPPDATA": "/local"}, "win32", Path("/local/scenelang")),
    ):
        assert state_folder(environment, platform) == expected
