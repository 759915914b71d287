"""``scenelang fmt``: which files it takes, what it writes and how it exits."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from scenelang.cli.commands import fmt
from tests.cli.conftest import Folder

ROUGH = "square   { scale( 0.5 ); }\n"
NEAT = "square { scale(0.5); }\n"
BROKEN = "square { scale(; }\n"


def test_writes_only_what_changes(folder: Folder) -> None:
    rough, neat = folder.write("rough.nsg", ROUGH), folder.write("neat.nsg", NEAT)
    before = (folder.path / neat).stat()
    done = folder.run("fmt", rough, neat)
    assert (done.exit_code, done.stdout) == (0, "")
    assert done.stderr == "1 scene formatted, 1 scene left as it is\n"
    assert (folder.path / rough).read_text("utf-8") == NEAT
    after = (folder.path / neat).stat()
    assert (after.st_mtime_ns, after.st_ino) == (before.st_mtime_ns, before.st_ino)
    assert sorted(path.name for path in folder.path.iterdir()) == ["neat.nsg", "rough.nsg"]


def test_check_names_files_and_writes_nothing(folder: Folder) -> None:
    rough, neat = folder.write("rough.nsg", ROUGH), folder.write("neat.nsg", NEAT)
    done = folder.run("fmt", "--check", rough, neat)
    assert (done.exit_code, done.stdout) == (1, "would format rough.nsg\n")
    assert (folder.path / rough).read_text("utf-8") == ROUGH
    assert folder.run("fmt", "--check", neat).exit_code == 0


def test_a_folder_that_cannot_be_listed_hides_no_other(
    folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b"):
        (folder.path / name).mkdir()
        folder.write(f"{name}/rough.nsg", ROUGH)
    listed = os.scandir

    def scandir(path: str) -> object:
        if path.endswith("a"):
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return listed(path)

    monkeypatch.setattr(os, "scandir", scandir)
    done = folder.run("fmt", "--check", ".")
    assert (done.exit_code, done.stdout) == (2, f"would format {os.path.join('.', 'b', 'rough.nsg')}\n")
    assert "permission denied" in done.stderr


def test_diff_is_a_patch(folder: Folder) -> None:
    name = folder.write("rough.nsg", "// a\nnsg 1;\nsquare   {}\nstar {}")
    done = folder.run("fmt", "--diff", name)
    assert done.exit_code == 1
    text = (folder.path / name).read_text("utf-8")
    subprocess.run(["patch", "-s", name], cwd=folder.path, input=done.stdout, text=True, check=True)
    assert text != (folder.path / name).read_text("utf-8") == "// a\nnsg 1;\nsquare {}\nstar {}\n"
    done = folder.run("fmt", "--diff", name)
    assert (done.exit_code, done.stdout) == (0, "")


def test_standard_input(folder: Folder) -> None:
    done = folder.run("fmt", "-", stdin=ROUGH)
    assert (done.exit_code, done.stdout, done.stderr) == (0, NEAT, "")
    done = folder.run("fmt", "-", "--check", stdin=ROUGH)
    assert (done.exit_code, done.stdout) == (1, "would format <stdin>\n")
    done = folder.run("fmt", "-", stdin=BROKEN)
    assert (done.exit_code, done.stdout) == (1, "")
    assert "<stdin>:1:" in done.stderr


def test_bytes_of_standard_input_stay() -> None:
    """Line ends, a byte order mark and letters beyond ASCII, whatever the locale."""
    given = "\ufeffsquare   {} // ä\r\nstar {}".encode()
    done = subprocess.run(
        [sys.executable, "-m", "scenelang", "fmt", "-"],
        input=given,
        capture_output=True,
        env={"LC_ALL": "C", "PYTHONUTF8": "0", "PATH": ""},
        check=True,
    )
    assert done.stdout == "\ufeffsquare {}  // ä\r\nstar {}\r\n".encode()


def test_folders(folder: Folder) -> None:
    """All scenes inside, hidden ones and links passed over, other files too."""
    outside = folder.write("outside.nsg", ROUGH)
    for name in ("a/one.nsg", "a/b/two.nsg", "a/.hidden.nsg", "a/.git/three.nsg", "a/notes.txt"):
        folder.write(name, ROUGH)
    (folder.path / "a/link.nsg").symlink_to(folder.path / outside)
    (folder.path / "a/up").symlink_to(folder.path)
    done = folder.run("fmt", "a")
    assert done.exit_code == 0
    changed = sorted(
        str(p.relative_to(folder.path)) for p in folder.path.rglob("*") if p.is_file() and text(p) == NEAT
    )
    assert changed == ["a/b/two.nsg", "a/one.nsg"]


def text(path: Path) -> str:
    return path.read_text("utf-8")


def test_named_file_may_be_called_anything(folder: Folder) -> None:
    name = folder.write(".hidden.scene", ROUGH)
    assert folder.run("fmt", name).exit_code == 0
    assert text(folder.path / name) == NEAT


def test_broken_files_are_reported_and_stay(folder: Folder) -> None:
    broken, rough = folder.write("broken.nsg", BROKEN), folder.write("rough.nsg", ROUGH)
    done = folder.run("fmt", broken, rough)
    assert done.exit_code == 1
    assert "error[E0" in done.stderr
    assert "broken.nsg:1:" in done.stderr
    assert "1 scene formatted, 1 scene with syntax errors" in done.stderr
    assert text(folder.path / broken) == BROKEN
    assert text(folder.path / rough) == NEAT


def test_what_cannot_be_read(folder: Folder) -> None:
    rough = folder.write("rough.nsg", ROUGH)
    (folder.path / "latin.nsg").write_bytes(b"// \xe9\n")
    (folder.path / "empty").mkdir()
    done = folder.run("fmt", "missing.nsg", "latin.nsg", "empty", rough)
    assert done.exit_code == 2
    assert "missing.nsg: no such file or directory" in done.stderr
    assert "latin.nsg: it is not UTF-8 text: byte 3" in done.stderr
    assert text(folder.path / rough) == NEAT
    done = folder.run("fmt", "empty")
    assert (done.exit_code, done.stderr) == (2, "Error: no scenes (*.nsg) there\n")


def test_too_large(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fmt, "MAX_BYTES", 8)
    done = folder.run("fmt", folder.write("rough.nsg", ROUGH))
    assert done.exit_code == 2
    assert "rough.nsg: a file of more than" in done.stderr


def test_write_fails_whole(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(target: str, data: bytes) -> None:
        raise OSError(28, "No space left on device", target)

    name = folder.write("rough.nsg", ROUGH)
    monkeypatch.setattr(fmt, "write_whole", refuse)
    done = folder.run("fmt", name)
    assert done.exit_code == 2
    assert done.stderr == "Error: rough.nsg: no space left on device\n"
    assert text(folder.path / name) == ROUGH


def test_check_says_a_line_a_file(folder: Folder) -> None:
    folder.write("all/bad.nsg", "square { scale(0.5 }\nstar { rotate(30deg) }\n")
    folder.write("all/one.nsg", "star { rotate(30deg) }\n")
    folder.write("all/two.nsg", "square   {}\n")
    result = folder.run("fmt", "--check", "all")
    assert result.exit_code == 1
    assert result.stdout == "would format all/two.nsg\n"
    assert result.stderr.splitlines() == [
        "all/bad.nsg:1:19: error[E0103] missing `);`, and 1 more",
        "all/one.nsg:1:21: error[E0102] missing `;`",
        "1 scene would be formatted, 2 scenes with syntax errors",
    ]
