"""Odd files in place of scenes, programs, weights and imports: refused in a line, unread."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.assets.processes import SOON_S, one_line, run
from tests.cli.conftest import Folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such files")

COMMANDS = [
    ("check", "{}.nsg"),
    ("check", "{}.json"),
    ("fmt", "{}.nsg"),
    ("render", "{}.nsg", "-o", "out.png"),
    ("render", "{}.safetensors", "-o", "out.png"),
    ("compile", "{}.nsg", "-o", "out.safetensors"),
    ("compare", "{}.nsg", "-o", "out.png"),
    ("convert", "{}.json", "-o", "out.nsg"),
    ("dump", "{}.nsg"),
    ("dump", "{}.nsg", "-o", "out.mmd"),
]
SUFFIXES = ("nsg", "json", "safetensors", "glb")


@contextmanager
def soon() -> Iterator[None]:
    """Fails where something waits."""

    def ring(number: int, frame: object) -> None:
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(SOON_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def test_a_pipe_in_a_whole_process(folder: Folder) -> None:
    pipes(folder)
    assert one_line(run("check", "it.nsg")) == "it.nsg: not a regular file"


def pipes(folder: Folder) -> None:
    for suffix in SUFFIXES:
        os.mkfifo(f"it.{suffix}")


def zeros(folder: Folder) -> None:
    for suffix in SUFFIXES:
        os.symlink("/dev/zero", f"it.{suffix}")


def directories(folder: Folder) -> None:
    for suffix in SUFFIXES:
        os.mkdir(f"it.{suffix}")


def loops(folder: Folder) -> None:
    for suffix in SUFFIXES:
        os.symlink(f"it.{suffix}", f"it.{suffix}")


def secrets(folder: Folder) -> None:
    """Files that nobody may read; for the superuser there are some in /proc."""
    for suffix in SUFFIXES:
        os.symlink("/proc/self/mem", f"it.{suffix}")


@pytest.mark.parametrize("arguments", COMMANDS, ids=lambda arguments: "-".join(arguments[:2]))
def test_pipes_are_refused_unread(folder: Folder, arguments: tuple[str, ...]) -> None:
    pipes(folder)
    with soon():
        result = folder.run(*(word.format("it") for word in arguments))
    assert result.exit_code == 2
    assert result.stderr.endswith("not a regular file\n")
    assert sorted(os.listdir()) == [f"it.{suffix}" for suffix in sorted(SUFFIXES)]


@pytest.mark.parametrize("make", [zeros, directories, loops, secrets], ids=lambda make: make.__name__)
@pytest.mark.parametrize("arguments", COMMANDS, ids=lambda arguments: "-".join(arguments[:2]))
def test_other_things_are_refused(folder: Folder, make: object, arguments: tuple[str, ...]) -> None:
    if make is secrets and not Path("/proc/self/mem").exists():
        pytest.skip("no such file")
    make(folder)  # type: ignore[operator]
    before = sorted(os.listdir())
    with soon():
        result = folder.run(*(word.format("it") for word in arguments))
    assert result.exit_code == 2, result.output
    assert "Error: " in result.stderr
    assert sorted(set(os.listdir()) - {"out"}) == before


def test_pipes_of_shells_are_read(folder: Folder) -> None:
    read, write = os.pipe()
    os.write(write, b"square { scale(0.5); }")
    os.close(write)
    done = run("check", f"/dev/fd/{read}", pass_fds=(read,))
    os.close(read)
    assert (done.returncode, done.stdout) == (0, "no mistakes in 1 scene\n")


@pytest.mark.parametrize(
    "path",
    [
        "../outside.nsg", "sub/../../outside.nsg", "./.././outside.nsg", "..//outside.nsg", "/etc/passwd",
        "//etc/passwd", "/proc/self/environ", "C:/x.nsg", "c:x.nsg", "C:\\\\x.nsg", "\\\\\\\\server\\\\x.nsg",
        "\\\\x.nsg", "//server/share/x.nsg", "\\\\\\\\?\\\\C:\\\\x.nsg", "link.nsg", "folder/outside.nsg",
        "loop/../../outside.nsg", "sub/../link.nsg", "file:///etc/passwd", "http://localhost/x.nsg",
        "..\\\\outside.nsg", "LINK.NSG", "~/x.nsg", "$HOME/x.nsg", "fd/0", "x.nsg\\u0000",
    ],
)  # fmt: skip
def test_imports_stay_inside(folder: Folder, path: str) -> None:
    """However a path is spelt, nothing outside the folder is read: its name would be known then."""
    (folder.path / "outside.nsg").write_text("let secret = 1;")
    root = folder.path / "root"
    (root / "sub").mkdir(parents=True)
    os.symlink(folder.path / "outside.nsg", root / "link.nsg")
    os.symlink(folder.path, root / "folder")
    os.symlink("loop", root / "loop")
    os.symlink("/dev/fd", root / "fd")
    (root / "a.nsg").write_text(f'import "{path}" as lib; square {{ scale(lib.secret); }}')
    result = folder.run("check", "root/a.nsg", "--format", "concise")
    assert result.exit_code == 1
    codes = {line.partition("[")[2][:5] for line in result.stdout.splitlines()}
    assert codes <= {"E0214", "E0215", "E0119", "E0113"}, result.stdout


@pytest.mark.parametrize("make", [pipes, zeros, directories, loops])
def test_imports_of_odd_files(folder: Folder, make: object) -> None:
    make(folder)  # type: ignore[operator]
    folder.write("a.nsg", 'import "it.nsg" as lib; square {}')
    done = run("check", "a.nsg", "--format", "concise")
    assert done.returncode == 1
    assert "[E0214]" in done.stdout or "[E0215]" in done.stdout
    assert done.stderr == ""


def test_a_file_that_grows_while_it_is_read_is_bounded(folder: Folder) -> None:
    from scenelang.assets.files import read_regular

    Path("a").write_bytes(b"x" * 1000)
    assert len(read_regular("a", 10)) == 11


@pytest.mark.parametrize("suffix", ["nsg", "json"])
def test_ten_megabytes(folder: Folder, suffix: str) -> None:
    """One byte more is refused; up to there an error or a scene comes in time."""
    filler = b"// " if suffix == "nsg" else b""
    for size, refused in ((10_000_000, False), (10_000_001, True)):
        Path(f"a.{suffix}").write_bytes(filler + b" " * (size - len(filler)))
        done = run("check", f"a.{suffix}", "--format", "concise")
        assert ("E0324" in done.stdout) == refused, done.stdout[:300]


BOMBS = {
    "brackets": "[" * 1_000_000,
    "objects": '{"nodes":' * 1_000_000,
    "pairs": "[]," * 500_000,
    "escapes": '"' + '\\"' * 900_000,
    "digits": '{"canvas": [' + "9" * 1_500_000 + ", 1]}",
    "exponents": '{"background": [1e' + "9" * 1_000_000 + ", 0, 0]}",
    "fractions": '{"background": [0.' + "1" * 1_500_000 + ", 0, 0]}",
    "keys": '{"' + "k" * 1_500_000 + '": 1}',
    "many keys": "{" + ",".join(f'"k{at}": 0' for at in range(80_000)) + "}",
    "texts": '{"model": "' + "x" * 1_500_000 + '"}',
    "nodes": '{"nodes": [' + ",".join(['{"kind":"object"}'] * 60_000) + "]}",
    "groups": '{"nodes": [' + '{"kind":"group","children":[' * 300_000,
    "nulls": '{"nodes": [' + "null," * 300_000 + "null]}",
    "unicode": '{"model": "' + "\\ud800" * 300_000 + '"}',
}


@pytest.mark.parametrize("name", BOMBS)
def test_json_that_is_made_to_explode(folder: Folder, name: str) -> None:
    """Within the size limit: an error in words, in bounded memory."""
    import resource

    Path("a.json").write_text(BOMBS[name])

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))

    done = run("check", "a.json", "--format", "concise", preexec_fn=limit)
    if name == "fractions":  # a number like any other
        assert done.returncode == 0
        return
    assert done.returncode == 1, done.stderr[-500:]
    assert done.stdout.startswith("a.json:1:") or "error[E" in done.stdout
    assert len(done.stdout) < 20_000
    assert done.stderr == ""
