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
    rough, neat = folder.write(".rough.scene", ROUGH), folder.write("neat.nsg", NEAT)
    before = os.stat(neat)
    done = folder.run("fmt", "--check", rough, neat, code=1)
    assert done.stdout == f"would format {rough}\n"
    assert folder.read(rough) == ROUGH
    done = folder.run("fmt", rough, neat, code=0)
    assert (done.stdout, done.stderr) == ("", "1 scene formatted, 1 scene left as it is\n")
    assert folder.read(rough) == NEAT
    after = os.stat(neat)
    assert (after.st_mtime_ns, after.st_ino) == (before.st_mtime_ns, before.st_ino)
    assert sorted(os.listdir()) == [rough, neat]
    folder.run("fmt", "--check", neat, code=0)


def test_a_folder_that_cannot_be_listed_hides_no_other(
    folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b"):
        folder.write(f"{name}/rough.nsg", ROUGH)
    listed = os.scandir

    def scandir(path: str) -> object:
        if path.endswith("a"):
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return listed(path)

    monkeypatch.setattr(os, "scandir", scandir)
    done = folder.run("fmt", "--check", ".", code=2)
    assert done.stdout == f"would format {os.path.join('b', 'rough.nsg')}\n"
    assert "permission denied" in done.stderr


def test_diff_is_a_patch(folder: Folder) -> None:
    name = folder.write("rough.nsg", "// a\nnsg 1;\nsquare   {}\nstar {}")
    done = folder.run("fmt", "--diff", name, code=1)
    subprocess.run(["patch", "-s", name], cwd=folder.path, input=done.stdout, text=True, check=True)
    assert folder.read(name) == "// a\nnsg 1;\nsquare {}\nstar {}\n"
    assert folder.run("fmt", "--diff", name, code=0).stdout == ""


def test_standard_input(folder: Folder) -> None:
    """Line ends, a byte order mark and letters beyond ASCII stay, whatever the locale."""
    assert folder.run("fmt", "-", "--check", stdin=ROUGH, code=1).stdout == "would format <stdin>\n"
    done = folder.run("fmt", "-", stdin=BROKEN, code=1)
    assert done.stdout == ""
    assert "<stdin>:1:" in done.stderr
    run = subprocess.run(
        [sys.executable, "-m", "scenelang", "fmt", "-"],
        input="\ufeffsquare   {} // ä\r\nstar {}".encode(),
        capture_output=True,
        env={"LC_ALL": "C", "PYTHONUTF8": "0", "PATH": ""},
        check=True,
    )
    assert (run.stdout, run.stderr) == ("\ufeffsquare {}  // ä\r\nstar {}\r\n".encode(), b"")


def test_folders(folder: Folder) -> None:
    """All scenes inside, hidden ones and links passed over, other files too."""
    names = ("outside.nsg", "a/one.nsg", "a/b/two.nsg", "a/.hidden.nsg", "a/.git/three.nsg", "a/notes.txt")
    for name in names:
        folder.write(name, ROUGH)
    Path("a/link.nsg").symlink_to(folder.path / "outside.nsg")
    Path("a/up").symlink_to(folder.path)
    folder.run("fmt", "a", code=0)
    assert [name for name in names if folder.read(name) == NEAT] == ["a/one.nsg", "a/b/two.nsg"]


def test_broken_and_unreadable_files_stay(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    broken, rough = folder.write("broken.nsg", BROKEN), folder.write("rough.nsg", ROUGH)
    done = folder.run("fmt", broken, rough, code=1)
    for fact in ("error[E0", "broken.nsg:1:", "1 scene formatted, 1 scene with syntax errors"):
        assert fact in done.stderr
    assert (folder.read(broken), folder.read(rough)) == (BROKEN, NEAT)
    folder.write(rough, ROUGH)
    Path("latin.nsg").write_bytes(b"// \xe9\n")
    done = folder.run("fmt", "missing.nsg", "latin.nsg", rough, code=2)
    assert "missing.nsg: no such file or directory" in done.stderr
    assert "latin.nsg: it is not UTF-8 text: byte 3" in done.stderr
    assert folder.read(rough) == NEAT
    monkeypatch.setattr(fmt, "MAX_BYTES", 8)
    assert "rough.nsg: a file of more than" in folder.run("fmt", rough, code=2).stderr


def test_check_says_a_line_a_file(folder: Folder) -> None:
    folder.write("all/bad.nsg", "square { scale(0.5 }\nstar { rotate(30deg) }\n")
    folder.write("all/one.nsg", "star { rotate(30deg) }\n")
    folder.write("all/two.nsg", "square   {}\n")
    result = folder.run("fmt", "--check", "all", code=1)
    assert result.stdout == "would format all/two.nsg\n"
    assert result.stderr.splitlines() == [
        "all/bad.nsg:1:19: error[E0103] missing `);`, and 1 more",
        "all/one.nsg:1:21: error[E0102] missing `;`",
        "1 scene would be formatted, 2 scenes with syntax errors",
    ]
