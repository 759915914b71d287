"""Writing: full disks, closed folders, links, inputs as outputs, Ctrl-C; nothing lost or half-written."""

from __future__ import annotations

import fcntl
import os
import random
import resource
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from scenelang.assets.files import NotWritten, write_output, write_whole
from scenelang.drawing.image import Image
from scenelang.output.frames import FrameStore, put_frame
from tests.assets.processes import SOON_S, leavings, one_line, run
from tests.cli.conftest import Folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="other rules for files")

# Commands that write, with a place for the file's folder.
WRITERS = {
    "render": ("render", "a.nsg", "-o", "{}out.png", "--size", "64x64"),
    "render-animation": ("render", "moving.nsg", "-o", "{}out.gif", "--size", "16x16"),
    "compile": ("compile", "a.nsg", "-o", "{}out.safetensors"),
    "compare": ("compare", "a.nsg", "-o", "{}out.png", "--size", "32x32"),
    "convert": ("convert", "a.nsg", "-o", "{}out.json"),
    "schema": ("schema", "-o", "{}out.json"),
    "dump": ("dump", "a.nsg", "-o", "{}out.txt"),
}
WORK = Path(".out.gif.frames")
FILM = "render", "moving.nsg", "-o", "out.gif", "--size", "16x16", "--backend", "reference"
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


@pytest.mark.parametrize("name", ["render", "render-animation", "convert", "dump"])
def test_a_disk_that_is_full(scenes: Folder, name: str) -> None:
    """Nothing is left half-written, and an old file stays as it was."""
    arguments = [word.format("") for word in WRITERS[name]]
    target = Path(arguments[3])
    if name != "dump":
        target.write_bytes(b"the old one")
    before = leavings(scenes.path)
    assert "too large" in one_line(run(*arguments, preexec_fn=full))
    assert leavings(scenes.path) == before
    assert not target.exists() or target.read_bytes() == b"the old one"


@pytest.mark.parametrize("name", WRITERS)
def test_folders_that_take_no_file(scenes: Folder, name: str) -> None:
    """Even the superuser makes no files in /sys."""
    for place in ("none/", "a.nsg/", *["/sys/kernel/"] * Path("/sys/kernel").is_dir()):
        result = scenes.run(*(word.format(place) for word in WRITERS[name]))
        assert result.exit_code == 2, result.output
        last = result.stderr.splitlines()[-1]
        assert last.startswith("Error: ")
        assert "permi" in last or not place.startswith("/sys")
    assert not Path("none").exists()
    arguments = [word.format("") for word in WRITERS[name]]
    out = arguments[arguments.index("-o") + 1]
    os.mkdir(out)
    result = scenes.run(*arguments)
    assert result.exit_code == (0 if os.listdir(out) else 2)  # pictures are drawn into folders
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
    subprocess.run([sys.executable, "-c", KILLED], cwd=folder.path, check=False)
    Path(".out.png.part").touch()
    assert len(os.listdir()) == 2
    write_whole("out", b"whole")
    assert sorted(os.listdir()) == [".out.png.part", "out"]


@pytest.mark.parametrize("locks", [True, False])
def test_two_write_one_file_at_once(folder: Folder, monkeypatch: pytest.MonkeyPatch, locks: bool) -> None:
    """The second comes just before the first renames its file."""

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


@pytest.fixture
def outside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that the hostile one has links to, with files named like those of a store."""
    place = tmp_path_factory.mktemp("outside")
    for name in ("lock", "film.gif", f"{'a' * 40}.png", "mine"):
        (place / name).write_bytes(b"somebody's")
    return place


def unharmed(outside: Path) -> bool:
    return len(leavings(outside)) == 4 and {p.read_bytes() for p in outside.iterdir()} == {b"somebody's"}


@pytest.mark.parametrize("plant", ["folder", "lock", "hard lock", "film.gif"])
def test_a_work_folder_with_links(scenes: Folder, outside: Path, plant: str) -> None:
    if plant == "folder":
        WORK.symlink_to(outside)
    else:
        WORK.mkdir()
        name = plant.split()[-1]
        (os.link if "hard" in plant else os.symlink)(outside / name, WORK / name)
    result = scenes.run(*FILM)
    assert unharmed(outside)
    if plant in ("folder", "lock"):
        assert result.exit_code == 2
        assert "is a link" in result.stderr
        assert not Path("out.gif").exists()
    else:
        assert result.exit_code == 0
        assert not WORK.exists()


def test_what_is_not_the_stores_stays(scenes: Folder) -> None:
    WORK.mkdir()
    for name in ("diary.png", ".notes.part", "film"):
        (WORK / name).write_bytes(b"somebody's")
    assert scenes.run(*FILM).exit_code == 0
    assert sorted(os.listdir(WORK)) == [".notes.part", "diary.png", "film"]


def test_a_kept_frame_that_is_a_link(tmp_path: Path, outside: Path) -> None:
    key = "a" * 40
    with FrameStore(tmp_path / "work") as store:
        store.file(key).symlink_to(outside / f"{key}.png")
        put_frame({store.file(key): np.zeros((2, 3, 3), np.float32).view(Image).encode()})
        assert store.has(key, (3, 2))
    assert unharmed(outside)


def test_names_that_the_user_did_not_write(scenes: Folder, outside: Path) -> None:
    for name, arguments in (
        ("a.png", ("render", "a.nsg", "moving.nsg", "-o", "./", "--size", "16x16", "--backend", "reference")),
        ("a-compare.png", ("compare", "a.nsg", "--size", "32x32")),
        ("a.png", ("watch", "a.nsg", "--size", "16x16")),
    ):
        if not Path(name).is_symlink():
            Path(name).symlink_to(outside / "mine")
        result = scenes.run(*arguments)
        assert result.exit_code == 2
        assert "is a link" in result.stderr
        assert unharmed(outside)


@pytest.mark.parametrize("name", sorted(WRITERS.keys() - {"schema"}))
def test_an_output_that_is_the_input(scenes: Folder, name: str) -> None:
    arguments = [word.format("") for word in WRITERS[name]]
    source, out = Path(arguments[1]), Path(arguments[3])
    before = source.read_bytes()
    for link in (os.symlink, os.link):
        link(source, out)
        there = leavings(scenes.path)
        result = scenes.run(*arguments)
        assert result.exit_code == 2
        message = result.stderr.splitlines()[-1]
        assert message.endswith(f"cannot write `{out}`: it is an input of the same command")
        assert (source.read_bytes(), leavings(scenes.path)) == (before, there)
        out.unlink()


def test_outputs_by_the_inputs_own_names(folder: Folder) -> None:
    folder.write("lib.nsg", "let k = 0.5;\n")
    folder.write("a.nsg", 'import "lib.nsg" as l;\nsquare { scale(l.k); }\n')
    before = [Path(name).read_bytes() for name in ("a.nsg", "lib.nsg")]
    for command in (("convert", "--to", "nsg"), ("dump",), ("dump", "--format", "dot")):
        for out in ("a.nsg", "./a.nsg", "lib.nsg"):
            result = folder.run(*command, "a.nsg", "-o", out)
            assert result.exit_code == 2
            assert "is an input" in result.stderr
    assert [Path(name).read_bytes() for name in ("a.nsg", "lib.nsg")] == before


def test_an_output_that_is_standard_input(folder: Folder) -> None:
    before = Path(folder.write("a.nsg")).read_bytes()
    with open("a.nsg") as file:
        said = one_line(run("convert", "-", "-o", "a.nsg", stdin=file))
    assert "is an input" in said
    assert Path("a.nsg").read_bytes() == before


def test_commands_that_work_in_place(folder: Folder) -> None:
    """Commands that are there to change a file do, also behind a link."""
    folder.write("a.nsg", "square   { scale(1) }\n")
    os.symlink("a.nsg", "link.nsg")
    assert folder.run("check", "--fix", "link.nsg").exit_code == 0
    assert folder.run("fmt", "link.nsg").exit_code == 0
    assert Path("a.nsg").read_text() == "square { scale(1); }\n"
    assert os.path.islink("link.nsg")


READY = "import sys, scenelang.cli.start as s; print('ready', flush=True); s.main()"
MANY = "for (i in 0..<300) { star { scale(0.9); rotate(1turn * rand(i)); } }\n"
# Command -> its words, and the moments (s) among which some are drawn.
LONG = {
    "compile": (("compile", "long.nsg", "-o", "out.safetensors"), 1.5),
    "render": (("render", "many.nsg", "-o", "out.png", "--size", "3000x3000"), 5.0),
    "check": (("check", "long.nsg"), 1.0),
    "animation": (("render", "moving.nsg", "-o", "out.gif", "--size", "512x512"), 5.0),
}


@contextmanager
def started(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A process whose command has just begun; its standard output is the rest of its words."""
    command = [sys.executable, "-c", READY, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        try:
            yield process
        finally:
            process.kill()


def interrupted(folder: Folder, name: str, moment_s: float, number: signal.Signals) -> None:
    line = "square { scale(0.1); translate(0.5, -0.5); material flat { color(#d33); } }\n"
    folder.write("long.nsg", line * 8_000)
    folder.write("many.nsg", MANY)
    folder.write("moving.nsg", f"animate(20s, 24);\ngroup {{ {MANY} rotate(1turn * u); }}")
    before = leavings(folder.path)
    with started(*LONG[name][0]) as process:
        time.sleep(moment_s)
        process.send_signal(number)
        _, said = process.communicate(timeout=SOON_S)
    if process.returncode in (0, 1):
        pytest.skip("it was done before")
    assert process.returncode == 128 + number, said
    assert "Traceback" not in said
    assert "Exception ignored" not in said
    assert leavings(folder.path) == before


@pytest.mark.parametrize("name", ["compile", "render"])
def test_ctrl_c_leaves_nothing(folder: Folder, name: str) -> None:
    interrupted(folder, name, random.Random(name).uniform(0, LONG[name][1]), signal.SIGINT)


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_at_other_moments(folder: Folder, name: str, number: signal.Signals) -> None:
    for seed in range(3):
        interrupted(folder, name, random.Random(seed).uniform(0, LONG[name][1]), number)
