"""Files of the folder and no others, written whole; what is not saved is kept for its owner alone."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path, PureWindowsPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenelang.web.folder import MOST_DAYS, MOST_KEPT, Changed, Denied, Folder, Journal, fits, state_folder

ESCAPES = [
    *("../out.nsg", "a/../../out.nsg", "..", ".", "", "/etc/passwd", "/tmp/out.nsg", "a//b.nsg", "/", "a/"),
    *("..\\out.nsg", "a\\b.nsg", "C:\\out.nsg", "C:out.nsg", "\\\\host\\share\\out.nsg", "//host/out.nsg"),
    *("a.nsg\0.txt", "a\0.nsg", "a.txt", "a.nsg/", "a.nsg:stream.nsg", "a.NSG", "~/.nsg", ".hidden.nsg"),
    *("CON.nsg", "aux.nsg", "com1.b.nsg", "LPT9 .nsg", "a/nul.nsg", "nul/a.nsg", "com¹.nsg", "CONIN$.nsg"),
    *(" a.nsg", "a /b.nsg", "a./b.nsg", "a\n.nsg", "a\u202egsn.nsg", "a\ud800.nsg", "%2e%2e/a.nsg/../b"),
    *("a/" * 9 + "b.nsg", "ä" * 120 + ".nsg", "….nsg/../../x", "a|b.nsg", "a*.nsg", 'a"b.nsg', "a?.nsg"),
]


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    inside = tmp_path / "in"
    inside.mkdir()
    (tmp_path / "out.nsg").write_text("outside")
    (inside / "a.nsg").write_text("square;")
    return Folder(inside)


def test_names_that_lead_elsewhere(folder: Folder) -> None:
    for name in ESCAPES:
        with pytest.raises(Denied):
            folder.read(name)
        with pytest.raises(Denied):
            folder.write(name, "x", None)
        for names in (("a.nsg", name), (name, "b.nsg")):
            with pytest.raises(Denied):
                folder.rename(*names)
    assert (folder.path.parent / "out.nsg").read_text() == "outside"
    assert [path.name for path in folder.path.iterdir()] == ["a.nsg"]


@given(
    st.text(st.characters(), max_size=12) | st.lists(st.sampled_from("./\\:ab\0 ~"), max_size=12).map("".join)
)
def test_what_fits_stays_inside_on_any_system(name: str) -> None:
    name += ".nsg"
    if fits(name):
        assert Path(os.path.normpath(f"/in/{name}")) == Path(f"/in/{name}")
        windows = PureWindowsPath("C:/in") / name
        assert windows.parts[:2] == ("C:\\", "in")
        assert ".." not in windows.parts
        assert not windows.is_reserved()


@pytest.mark.parametrize("kind", ["file", "folder", "dangling", "inside"])
def test_links_are_not_written_through(folder: Folder, kind: str) -> None:
    outside, link = folder.path.parent, folder.path / "link"
    name = "link/out.nsg" if kind == "folder" else "link.nsg"
    target = {"file": "out.nsg", "folder": "", "dangling": "new.nsg", "inside": "in/a.nsg"}[kind]
    (link if kind == "folder" else folder.path / "link.nsg").symlink_to(outside / target)
    if kind == "inside":
        assert folder.read(name)[0] == "square;"
    else:
        with pytest.raises(Denied):
            folder.read(name)
    for base in (None, folder.read("a.nsg")[1]):
        with pytest.raises(Denied):
            folder.write(name, "x", base)
    with pytest.raises(Denied):
        folder.rename("a.nsg", name)
    assert (outside / "out.nsg").read_text() == "outside"
    assert not (outside / "new.nsg").exists()
    assert (folder.path / "a.nsg").read_text() == "square;"


def test_a_file_that_has_changed_is_not_overwritten(folder: Folder) -> None:
    text, disk = folder.read("a.nsg")
    (folder.path / "a.nsg").write_text("disc;")
    with pytest.raises(Changed) as change:
        folder.write("a.nsg", f"{text} // mine", disk)
    assert change.value.text == "disc;"
    assert (folder.path / "a.nsg").read_text() == "disc;"
    again = folder.write("a.nsg", "mine", change.value.disk)
    assert folder.read("a.nsg") == ("mine", again)
    with pytest.raises(Changed):
        folder.write("a.nsg", "new", None)
    assert folder.write("deep/b.nsg", "new", None) == folder.read("deep/b.nsg")[1]
    assert folder.names() == ["a.nsg", "deep/b.nsg"]
    assert not list(folder.path.rglob("*.part"))


def test_line_ends_stay(folder: Folder) -> None:
    (folder.path / "a.nsg").write_bytes("\ufeffsquare;\r\ntriangle;\r\n".encode())
    text, disk = folder.read("a.nsg")
    assert text == "square;\ntriangle;\n"
    folder.write("a.nsg", f"{text}star;\n", disk)
    assert (folder.path / "a.nsg").read_bytes() == b"square;\r\ntriangle;\r\nstar;\r\n"


def test_what_is_not_a_scene_is_neither_read_nor_written(folder: Folder) -> None:
    os.mkfifo(folder.path / "pipe.nsg")
    (folder.path / "binary.nsg").write_bytes(b"\xff")
    (folder.path / "large.nsg").write_bytes(b"x" * 10_000_001)
    for name in ("pipe.nsg", "binary.nsg", "large.nsg"):
        with pytest.raises(Denied):
            folder.read(name)
    with pytest.raises(Denied):
        folder.write("big.nsg", "x" * 10_000_001, None)
    assert not (folder.path / "big.nsg").exists()


def test_renaming_takes_no_other_name(folder: Folder) -> None:
    folder.write("b.nsg", "b", None)
    with pytest.raises(Denied):
        folder.rename("a.nsg", "b.nsg")
    with pytest.raises(Denied):
        folder.rename("none.nsg", "c.nsg")
    folder.rename("a.nsg", "deep/c.nsg")
    assert folder.names() == ["b.nsg", "deep/c.nsg"]
    assert folder.read("deep/c.nsg")[0] == "square;"


def test_hidden_folders_and_links_are_not_listed(folder: Folder) -> None:
    for name in (".git/x.nsg", "node_modules/y.nsg", "deep/z.nsg", "other.txt"):
        path = folder.path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("square;")
    (folder.path / "loop").symlink_to(folder.path)
    assert folder.names() == ["a.nsg", "deep/z.nsg"]


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
