"""Disks that are full, folders that are closed: one line of words, and nothing half-written."""

from __future__ import annotations

import os
import resource
import stat
import sys
from pathlib import Path

import pytest

from scenelang.assets.files import NotWritten, write_output, write_whole
from tests.assets.processes import leavings, one_line, run
from tests.cli.conftest import Folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="other rules for files")

# Every command that writes, with a place for the file's folder.
WRITERS = {
    "render": ("render", "a.nsg", "-o", "{}out.png", "--size", "64x64"),
    "render-animation": ("render", "moving.nsg", "-o", "{}out.gif", "--size", "16x16"),
    "reference": ("render", "a.nsg", "-o", "{}out.png", "--backend", "reference", "--size", "64x64"),
    "compile": ("compile", "a.nsg", "-o", "{}out.safetensors"),
    "compare": ("compare", "a.nsg", "-o", "{}out.png", "--size", "32x32"),
    "convert": ("convert", "a.nsg", "-o", "{}out.json"),
    "convert-nsg": ("convert", "a.nsg", "-o", "{}out.nsg"),
    "schema": ("schema", "-o", "{}out.json"),
    "dump": ("dump", "a.nsg", "-o", "{}out.txt"),
    "graph": ("dump", "a.nsg", "-o", "{}out.mmd"),
}
SCENE = "for (i in 0..<20) { square { scale(0.1); translate(i / 20, 0); } }\n"


@pytest.fixture
def scenes(folder: Folder) -> Folder:
    """A scene and a moving one."""
    folder.write("a.nsg", SCENE)
    folder.write("moving.nsg", f"animate(1s, 3);\n{SCENE}")
    return folder


def full() -> None:
    """No file may grow beyond a few bytes; as on a full disk, writing fails in the middle."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (40, 40))


@pytest.mark.parametrize("name", WRITERS)
def test_a_disk_that_is_full(scenes: Folder, name: str) -> None:
    """Nothing is left half-written, and an old file stays as it was."""
    arguments = [word.format("") for word in WRITERS[name]]
    target = Path(arguments[arguments.index("-o") + 1])
    if name not in ("dump", "convert-nsg"):  # the others have none
        target.write_bytes(b"the old one")
    before = leavings(scenes.path)
    assert "too large" in one_line(run(*arguments, preexec_fn=full))
    assert leavings(scenes.path) == before
    assert not target.exists() or target.read_bytes() == b"the old one"


@pytest.mark.skipif(not Path("/sys/kernel").is_dir(), reason="no folder that is closed to all")
@pytest.mark.parametrize("name", WRITERS)
def test_a_folder_that_is_closed(scenes: Folder, name: str) -> None:
    """Even the superuser makes no files in /sys."""
    result = scenes.run(*(word.format("/sys/kernel/") for word in WRITERS[name]))
    assert result.exit_code == 2
    assert "Traceback" not in result.stderr
    last = result.stderr.splitlines()[-1]
    assert last.startswith("Error: ")
    assert "permi" in last


@pytest.mark.parametrize("name", WRITERS)
def test_a_folder_that_is_not_there_or_a_file(scenes: Folder, name: str) -> None:
    for place in ("none/", "a.nsg/"):
        result = scenes.run(*(word.format(place) for word in WRITERS[name]))
        assert result.exit_code == 2, result.output
        assert result.stderr.splitlines()[-1].startswith("Error: ")
    assert not Path("none").exists()


@pytest.mark.parametrize("name", WRITERS)
def test_a_target_that_is_a_folder(scenes: Folder, name: str) -> None:
    arguments = [word.format("") for word in WRITERS[name]]
    at = arguments.index("-o") + 1
    os.mkdir(arguments[at])
    result = scenes.run(*arguments)
    inside = os.listdir(arguments[at])
    assert result.exit_code == (0 if inside else 2)  # pictures are drawn into folders
    assert not [name for name in leavings(scenes.path) if name.endswith(".part")]


def test_a_full_device(folder: Folder) -> None:
    said = one_line(run("schema", "-o", "/dev/full"))
    assert said == "cannot write `/dev/full`: no space left on device"
    with open("/dev/full", "w") as device:
        for arguments in (("schema",), ("--help",), ("models",), ("check", folder.write("a.nsg"))):
            assert one_line(run(*arguments, stdout=device)) == "no space left on device"


def test_devices_stay_devices(folder: Folder) -> None:
    """Renaming a file over /dev/null would replace it."""
    assert folder.run("schema", "-o", "/dev/null").exit_code == 0
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    assert run("schema", "-o", "/dev/stdout").stdout.startswith("{")


def test_permissions_and_links_are_kept(tmp_path: Path) -> None:
    """A link is followed where a user named it, and replaced where we chose its name."""
    target, link, ours = tmp_path / "a", tmp_path / "link", tmp_path / "ours"
    target.write_bytes(b"1")
    target.chmod(0o640)
    link.symlink_to("a")
    ours.symlink_to("a")
    write_output(link, b"2")
    write_whole(ours, b"3")
    assert link.is_symlink()
    assert target.read_bytes() == b"2"
    assert not ours.is_symlink()
    ours.unlink()
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    mask = os.umask(0o027)
    try:
        write_whole(tmp_path / "new", b"3")
    finally:
        os.umask(mask)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640
    assert sorted(os.listdir(tmp_path)) == ["a", "link", "new"]


def test_long_names(tmp_path: Path) -> None:
    write_whole(tmp_path / ("x" * 255), b"1")
    write_whole(tmp_path / ("é" * 127), b"1")
    with pytest.raises(NotWritten) as caught:
        write_whole(tmp_path / ("x" * 256), b"1")
    assert caught.value.filename.endswith("x" * 256)
    assert len(os.listdir(tmp_path)) == 2


KILLED = """
import os, signal
from scenelang.assets.files import write_whole
os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
write_whole("out", b"half")
"""


def test_what_a_killed_process_leaves_goes_with_the_next_writing(folder: Folder) -> None:
    """What others are writing, or what is not ours, stays."""
    import subprocess

    subprocess.run([sys.executable, "-c", KILLED], cwd=folder.path, check=False)
    Path(".out.png.part").touch()
    assert len(os.listdir()) == 2
    write_whole("out", b"whole")
    assert sorted(os.listdir()) == [".out.png.part", "out"]


@pytest.mark.parametrize("locks", [True, False])
def test_two_write_one_file_at_once(folder: Folder, monkeypatch: pytest.MonkeyPatch, locks: bool) -> None:
    """The second comes just before the first renames its file."""
    import fcntl

    def no_locks(*_: object) -> None:
        raise OSError(37, "No locks available")

    if not locks:
        monkeypatch.setattr(fcntl, "flock", no_locks)
    replace, seen = os.replace, []

    def late(part: Path, place: Path) -> None:
        seen.append(part)
        if len(seen) == 1:
            write_whole("out", b"second")
        replace(part, place)

    monkeypatch.setattr(os, "replace", late)
    write_whole("out", b"first")
    assert Path("out").read_bytes() == b"first"
    assert len(set(seen)) == 2
    assert os.listdir() == ["out"]


def test_readers_that_have_enough(folder: Folder) -> None:
    """`scenelang dump … | head` says nothing when the pipe closes."""
    import subprocess

    folder.write("a.nsg", "for (i in 0..<90) { square { scale(0.1); translate(i / 90, 0); } }\n" * 20)
    for arguments in (
        ("dump", "a.nsg", "--format", "json"),
        ("convert", "a.nsg", "--to", "json"),
        ("schema",),
    ):
        command = [sys.executable, "-m", "scenelang", *arguments]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdout is not None
            assert process.stderr is not None
            process.stdout.read(1)
            process.stdout.close()
            said = process.stderr.read().decode()
        assert "Traceback" not in said
        assert "Exception" not in said
        assert "Error" not in said
