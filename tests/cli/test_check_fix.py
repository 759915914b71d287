"""`scenelang check --fix` and `--diff`: what changes, where it goes, and what does not change."""

from __future__ import annotations

import json
import os
import shutil
import stat
import subprocess

import pytest

from tests.cli.conftest import Folder

BAD = "square { rotate(45) }\nstar { scale(2 ** 0.5); }\n"
GOOD = "square { rotate(45deg); }\nstar { scale(2 ^ 0.5); }\n"


def read(folder: Folder, name: str) -> str:
    return (folder.path / name).read_bytes().decode("utf-8")


def test_fixes_are_written_and_counted(folder: Folder) -> None:
    name = folder.write("a.nsg", BAD)
    result = folder.run("check", name, "--fix")
    assert result.exit_code == 0
    assert read(folder, name) == GOOD
    assert result.stderr == "a.nsg: fixed 3 mistakes (E0102, E0127, E0302)\n"
    assert result.stdout == "no mistakes in 1 scene\n"
    assert [path.name for path in folder.path.iterdir()] == ["a.nsg"]


def test_what_is_left_is_reported(folder: Folder) -> None:
    name = folder.write("a.nsg", BAD + "square { scale(nothing); }\n")
    result = folder.run("check", name, "--fix", "--format", "concise")
    assert result.exit_code == 1
    assert result.stdout == "a.nsg:3:16: error[E0201] unknown name `nothing`\n"
    assert read(folder, name) == GOOD + "square { scale(nothing); }\n"


def test_a_fix_uncovers_the_next_mistake(folder: Folder) -> None:
    """Rounds go on until nothing is found: the angle is met only once the name is right."""
    name = folder.write("a.nsg", "modul m(x) { squar { rotate(360.00) } }\nm(45)\n")
    assert folder.run("check", name, "--fix").exit_code == 0
    assert read(folder, name) == "module m(x) { square { rotate(360.00deg); } }\nm(45);\n"


def test_a_file_without_fixes_is_not_touched(folder: Folder) -> None:
    name = folder.write("a.nsg", "square { scale(nothing); }\n")
    os.utime(folder.path / name, ns=(10**18, 10**18))
    folder.run("check", name, "--fix")
    assert (folder.path / name).stat().st_mtime_ns == 10**18


def test_line_ends_and_byte_order_mark_stay(folder: Folder) -> None:
    path = folder.path / "a.nsg"
    path.write_bytes("\ufeffsquare { rotate(45); }\r\nstar { scale(2) }\r\n".encode())
    assert folder.run("check", "a.nsg", "--fix").exit_code == 0
    assert path.read_bytes() == "\ufeffsquare { rotate(45deg); }\r\nstar { scale(2); }\r\n".encode()


def test_permissions_and_links_stay(folder: Folder) -> None:
    name = folder.write("real/a.nsg", BAD)
    os.chmod(folder.path / name, 0o640)
    (folder.path / "link.nsg").symlink_to(folder.path / name)
    assert folder.run("check", "link.nsg", "--fix").exit_code == 0
    assert (folder.path / "link.nsg").is_symlink()
    assert read(folder, name) == GOOD
    assert stat.S_IMODE((folder.path / name).stat().st_mode) == 0o640


def test_a_file_that_cannot_be_written(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    first, other = folder.write("a.nsg", BAD), folder.write("b.nsg", BAD)

    def refuse(path: object, data: bytes) -> None:
        if str(path) == first:
            raise PermissionError(13, "Permission denied", first)
        (folder.path / str(path)).write_bytes(data)

    monkeypatch.setattr("scenelang.cli.commands.check.write_whole", refuse)
    result = folder.run("check", first, other, "--fix")
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [
        "Error: a.nsg: permission denied",
        "b.nsg: fixed 3 mistakes (E0102, E0127, E0302)",
    ]
    assert (read(folder, first), read(folder, other)) == (BAD, GOOD)


def test_imports_change_only_where_they_are_named(folder: Folder) -> None:
    library, scene = "module m(x) { square { rotate(360.00) } }\n", 'import "lib.nsg" as lib;\nlib.m(45)\n'
    lib, name = folder.write("lib.nsg", library), folder.write("a.nsg", scene)
    result = folder.run("check", name, "--fix")
    assert result.exit_code == 1
    assert "lib.nsg:1:38" in result.stdout
    assert read(folder, lib) == library
    assert read(folder, name) == 'import "lib.nsg" as lib;\nlib.m(45);\n'
    # Named under another path, it is fixed, by what is found in the scene that imports it too.
    assert folder.run("check", name, f"./{lib}", "--fix").exit_code == 0
    assert read(folder, lib) == "module m(x) { square { rotate(360.00deg); } }\n"


def test_standard_input_goes_to_standard_output(folder: Folder) -> None:
    result = folder.run("check", "-", "--fix", stdin=BAD + "square { scale(nothing); }\n")
    assert result.exit_code == 1
    assert result.stdout == GOOD + "square { scale(nothing); }\n"
    assert "<stdin>: fixed 3 mistakes" in result.stderr
    assert "error[E0201]" in result.stderr
    result = folder.run("check", "-", "--fix", "-q", stdin=GOOD)
    assert (result.exit_code, result.stdout, result.stderr) == (0, GOOD, "")


def test_diff_shows_and_writes_nothing(folder: Folder) -> None:
    name = folder.write("a.nsg", BAD)
    result = folder.run("check", name, "--diff")
    assert result.exit_code == 1
    assert read(folder, name) == BAD
    assert result.stdout.splitlines()[:3] == ["--- a.nsg", "+++ a.nsg", "@@ -1,2 +1,2 @@"]
    assert result.stderr == "a.nsg: would fix 3 mistakes (E0102, E0127, E0302)\n"
    good = folder.write("b.nsg", GOOD)
    assert (folder.run("check", good, "--diff").exit_code, folder.run("check", good, "--diff").stdout) == (
        0,
        "",
    )


@pytest.mark.skipif(shutil.which("patch") is None, reason="needs patch")
@pytest.mark.parametrize("end", ["\n", ""])
@pytest.mark.parametrize("line", ["\n", "\r\n"])
def test_the_diff_is_a_patch(folder: Folder, end: str, line: str) -> None:
    text = f"square {{ rotate(45); }} // \x0c\u2028{line}{line}star {{ scale(2) }}{end}"
    (folder.path / "a.nsg").write_bytes(text.encode())
    shown = folder.run("check", "a.nsg", "--diff").stdout_bytes
    done = subprocess.run(
        ["patch", "-p0", "--binary"], input=shown, cwd=folder.path, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stdout
    patched = read(folder, "a.nsg")
    (folder.path / "a.nsg").write_bytes(text.encode())
    folder.run("check", "a.nsg", "--fix")
    assert read(folder, "a.nsg") == patched != text


def test_ignored_warnings_are_not_fixed(folder: Folder) -> None:
    name = folder.write("a.nsg", "let a = 1;\nsquare {}\n")
    folder.run("check", name, "--fix", "--ignore", "W0201")
    assert read(folder, name) == "let a = 1;\nsquare {}\n"
    folder.run("check", name, "--fix")
    assert read(folder, name) == "let _a = 1;\nsquare {}\n"


def test_formats_give_what_is_left(folder: Folder) -> None:
    name = folder.write("a.nsg", BAD + "square { scale(nothing); }\n")
    data = json.loads(folder.run("check", name, "--fix", "--format", "json").stdout)
    assert [d["code"] for d in data["diagnostics"]] == ["E0201"]
