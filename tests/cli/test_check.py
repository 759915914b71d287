"""`scenelang check`: exit codes, formats, options, and what `--fix` and `--diff` change."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import subprocess

import pytest

from scenelang.cli.say import wants_color, width_of
from tests.cli.conftest import Folder

WARNS = "square { material flat { color([2, 0, 0]); } }"
WRONG = "square { scale(foo); }"


def test_mistakes_are_shown_and_counted(folder: Folder) -> None:
    good, bad = folder.write("good.nsg"), folder.write("a.nsg", f"{WRONG}\nstar {{ rotate(45); }}\n")
    assert folder.run("check", good, folder.write("b.nsg"), code=0).stdout == "no mistakes in 2 scenes\n"
    assert folder.run("check", good, "-q").stdout == ""
    shown = folder.run("check", good, bad, code=1).stdout
    for fact in (
        "a.nsg:1:16",
        "a.nsg:2:15",
        "^^^",
        "2 errors",
        "\nFor more, try `scenelang explain E0201`.\n",
    ):
        assert fact in shown
    missing = folder.run("check", "none.nsg", bad, code=2)
    assert missing.stderr == "Error: none.nsg: no such file or directory\n"
    assert "E0201" in missing.stdout


def test_formats(folder: Folder) -> None:
    name = folder.write("ä.nsg", f"/* ö */ {WRONG}")
    data = json.loads(folder.run("check", name, "--format", "json").stdout)
    assert data["version"] == 1
    first = data["diagnostics"][0]
    assert (first["code"], first["severity"], first["file"]) == ("E0201", "error", "ä.nsg")
    assert (first["start"], first["end"]) == ({"line": 1, "column": 24}, {"line": 1, "column": 27})
    good = folder.run("check", folder.write("b.nsg"), "--format", "json")
    assert json.loads(good.stdout) == {"version": 1, "diagnostics": []}
    sarif = json.loads(folder.run("check", name, "--format", "sarif").stdout)
    assert sarif["runs"][0]["results"][0]["ruleId"] == "E0201"
    assert folder.run("check", name, "--format", "github").stdout.startswith("::error ")
    assert folder.run("check", name, "--format", "concise").stdout.startswith("ä.nsg:1:24: error[E0201] ")


def test_folders_stand_for_their_scenes(folder: Folder) -> None:
    for name in ("a.nsg", "in/b.nsg", ".hidden/c.nsg", "in/notes.txt"):
        folder.write(name, WRONG)
    result = folder.run("check", ".", "a.nsg", "--format", "concise")
    assert [line.split(":")[0] for line in result.stdout.splitlines()] == ["a.nsg", "in/b.nsg"]
    (folder.path / "empty").mkdir()
    assert folder.run("check", "empty", code=2).stderr == "Error: no scenes (*.nsg) there\n"


def test_defines(folder: Folder) -> None:
    """One is unused only if no file uses it."""
    name, other = folder.write("a.nsg", "param width = 0.5 in 0..1; square { scale(width); }"), "b.nsg"
    folder.write(other)
    folder.run("check", name, other, "-D", "width=0.7", code=0)
    assert "E0309" in folder.run("check", name, "-D", "width=7").stdout
    unused = folder.run("check", name, other, "-D", "widht=0.7", code=1)
    assert unused.stdout.count("error[E0211]") == 1
    assert "did you mean `width`?" in unused.stdout


def test_imports(folder: Folder) -> None:
    """A mistake that two scenes import is reported once; imports stay inside the root."""
    text = 'import "lib.nsg" as lib; square { scale(lib.a); }'
    names = [folder.write(name, text) for name in ("a.nsg", "b.nsg")]
    folder.write("lib.nsg", "let a = foo;\n")
    assert folder.run("check", *names, code=1).stdout.count("error[E0201]") == 1
    folder.write("lib.nsg", "let a = 0.5;")
    folder.run("check", "-", stdin=text, code=0)
    name = folder.write("scenes/a.nsg", text.replace("lib.nsg", "../lib.nsg"))
    assert "E0215" in folder.run("check", name).stdout
    folder.run("check", name, "--root", ".", code=0)
    result = folder.run("check", "-", "--format", "concise", stdin=WRONG)
    assert result.stdout.startswith("<stdin>:1:16: error[E0201]")


def test_frames_of_an_animation(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """By default four, which is what keeps `check` from passing what `render` refuses."""
    text = "animate(1, 40);\nsquare { rotate(u); }\nif (frame == 7) { star { scale(0 / 0); } }\n"
    name = folder.write("a.nsg", text)

    def found(*options: str) -> list[str]:
        return folder.run("check", name, "--format", "concise", *options).stdout.splitlines()

    angle = f"{name}:2:17: error[E0302] expected an angle, found a bare number (frame "
    assert found() == [f"{angle}1)"]
    assert found("--frame", "3") == [f"{angle}3)"]
    assert found("--frame", "0") == []
    assert "E0337" in found("--frame", "40")[0]
    division = f"{name}:3:36: error[E0304] division by zero (frame 7)"
    assert found("--all-frames") == [f"{angle}1)", division]
    monkeypatch.setattr("scenelang.language.evaluation.MAX_OBJECTS", 4)
    assert "35 frames left out: " in folder.run("check", name, "--all-frames").stderr


def test_warnings_can_be_chosen(folder: Folder) -> None:
    name = folder.write("a.nsg", "let a = 1;\n" + WARNS)
    for options, expected in (
        ("", ["W0201", "W0301"]),
        ("--ignore W02", ["W0301"]),
        ("--ignore w0201,W0301", []),
        ("--select W02 --select W04", ["W0201"]),
        ("--select W --ignore W03", ["W0201"]),
    ):
        text = folder.run("check", name, "--format", "concise", *options.split(), code=0).stdout
        assert re.findall(r"W\d{4}", text) == expected, options
    folder.run("check", name, "--strict", code=1)
    folder.run("check", name, "--strict", "--ignore", "W", code=0)
    folder.run("check", folder.write("b.nsg", "square { rotate(45); }"), "--ignore", "W", code=1)
    folder.run("check", name, "--fix", "--ignore", "W0201")
    assert folder.read(name) == "let a = 1;\n" + WARNS
    folder.run("check", name, "--fix")
    assert folder.read(name) == "let _a = 1;\n" + WARNS


def test_most(folder: Folder) -> None:
    name = folder.write("a.nsg", "square { scale(a1, b1); translate(c1, d1); }")
    result = folder.run("check", name, "--max-diagnostics", "1", code=1)
    assert result.stdout.count("error[") == 1
    assert "\n\n… and 3 more\n\n4 errors\n" in result.stdout
    data = json.loads(folder.run("check", name, "--max-diagnostics", "3", "--format", "json").stdout)
    assert len(data["diagnostics"]) == 3


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_colour(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """For terminals, unless something says otherwise."""
    name = folder.write("a.nsg", "square { rotate(45); }")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    assert wants_color(Terminal())
    assert not wants_color(Terminal(), "never")
    assert "\x1b" not in folder.run("check", name).stdout
    monkeypatch.setenv("TERM", "dumb")
    assert not wants_color(Terminal())
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("NO_COLOR", "yes")
    assert not wants_color(Terminal())
    assert "\x1b[1;31m" in folder.run("check", name, "--color", "always").stdout
    monkeypatch.setenv("COLUMNS", "77")
    assert (width_of(Terminal()), width_of(io.StringIO())) == (77, 140)


# ---------------------------------------------------------------- --fix and --diff

BAD = "square { rotate(45) }\nstar { scale(2 ** 0.5); }\n"
GOOD = "square { rotate(45deg); }\nstar { scale(2 ^ 0.5); }\n"
LEFT = "square { scale(nothing); }\n"


def test_fixes_are_written_and_counted(folder: Folder) -> None:
    name = folder.write("a.nsg", BAD)
    result = folder.run("check", name, "--fix", code=0)
    assert folder.read(name) == GOOD
    assert result.stderr == "a.nsg: fixed 3 mistakes (E0102, E0127, E0302)\n"
    assert result.stdout == "no mistakes in 1 scene\n"
    assert os.listdir() == ["a.nsg"]


def test_what_cannot_be_fixed_is_reported(folder: Folder) -> None:
    name = folder.write("a.nsg", BAD + LEFT)
    result = folder.run("check", name, "--fix", "--format", "concise", code=1)
    assert result.stdout == "a.nsg:3:16: error[E0201] unknown name `nothing`\n"
    assert folder.read(name) == GOOD + LEFT
    os.utime(name, ns=(10**18, 10**18))
    result = folder.run("check", name, "--fix", "--format", "json")
    assert [d["code"] for d in json.loads(result.stdout)["diagnostics"]] == ["E0201"]
    assert os.stat(name).st_mtime_ns == 10**18, "a file without fixes is not written"


def test_a_fix_uncovers_the_next_mistake(folder: Folder) -> None:
    """Rounds go on until nothing is found: the angle is met only once the name is right."""
    name = folder.write("a.nsg", "modul m(x) { Square { rotate(360.00) } }\nm(45)\n")
    folder.run("check", name, "--fix", code=0)
    assert folder.read(name) == "module m(x) { square { rotate(360.00deg); } }\nm(45);\n"


def test_a_file_that_cannot_be_written(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    first, other = folder.write("a.nsg", BAD), folder.write("b.nsg", BAD)

    def refuse(path: object, data: bytes) -> None:
        if str(path) == first:
            raise PermissionError(13, "Permission denied", first)
        (folder.path / str(path)).write_bytes(data)

    monkeypatch.setattr("scenelang.cli.commands.check.write_whole", refuse)
    result = folder.run("check", first, other, "--fix", code=2)
    assert result.stderr.splitlines() == [
        "Error: a.nsg: permission denied",
        "b.nsg: fixed 3 mistakes (E0102, E0127, E0302)",
    ]
    assert (folder.read(first), folder.read(other)) == (BAD, GOOD)


def test_imports_change_only_where_they_are_named(folder: Folder) -> None:
    """Nor do others count as fixable."""
    library, scene = "module m(x) { square { rotate(360.00) } }\n", 'import "lib.nsg" as lib;\nlib.m(45)\n'
    lib, name = folder.write("lib.nsg", library), folder.write("a.nsg", scene)
    for names, count in ((name,), 1), ((name, lib), 2):
        assert f"2 errors; {count} fixable with `--fix`" in folder.run("check", *names).stdout
    result = folder.run("check", name, "--fix", code=1)
    assert "lib.nsg:1:38" in result.stdout
    assert folder.read(lib) == library
    assert folder.read(name) == 'import "lib.nsg" as lib;\nlib.m(45);\n'
    # Named under another path, it is fixed, by what is found in the scene that imports it too.
    folder.run("check", name, f"./{lib}", "--fix", code=0)
    assert folder.read(lib) == "module m(x) { square { rotate(360.00deg); } }\n"


def test_standard_input_goes_to_standard_output(folder: Folder) -> None:
    result = folder.run("check", "-", "--fix", stdin=BAD + LEFT, code=1)
    assert result.stdout == GOOD + LEFT
    assert "<stdin>: fixed 3 mistakes" in result.stderr
    assert "error[E0201]" in result.stderr
    result = folder.run("check", "-", "--fix", "-q", stdin=GOOD, code=0)
    assert (result.stdout, result.stderr) == (GOOD, "")


def test_diff_shows_and_writes_nothing(folder: Folder) -> None:
    name = folder.write("a.nsg", BAD)
    result = folder.run("check", name, "--diff", code=1)
    assert folder.read(name) == BAD
    assert result.stdout.splitlines()[:3] == ["--- a.nsg", "+++ a.nsg", "@@ -1,2 +1,2 @@"]
    assert result.stderr == "a.nsg: would fix 3 mistakes (E0102, E0127, E0302)\n"
    assert folder.run("check", folder.write("b.nsg", GOOD), "--diff", code=0).stdout == ""


@pytest.mark.skipif(shutil.which("patch") is None, reason="needs patch")
def test_the_diff_is_a_patch(folder: Folder) -> None:
    """Line ends of both kinds and a byte order mark stay, as they do with `--fix`."""
    for mark, line, end in (("", "\n", "\n"), ("", "\n", ""), ("", "\r\n", ""), ("\ufeff", "\r\n", "\r\n")):
        text = f"square {{ rotate(45); }} // \x0c\u2028{line}{line}star {{ scale(2) }}{end}"
        fixed = text.replace("45", "45deg").replace("(2)", "(2);")
        (folder.path / "a.nsg").write_bytes((mark + text).encode())
        shown = folder.run("check", "a.nsg", "--diff").stdout_bytes
        if not mark:  # which the text has no more when it is compared
            command = ["patch", "-p0", "--binary", "-o", "patched.nsg"]
            done = subprocess.run(command, input=shown, cwd=folder.path, capture_output=True, check=False)
            assert (done.returncode, folder.read("patched.nsg")) == (0, fixed), done.stdout
        coloured = folder.run("check", "a.nsg", "--diff", "--color", "always").stdout
        assert coloured.count("\ufffd") == 4  # no end of a line
        folder.run("check", "a.nsg", "--fix", code=0)
        assert folder.read("a.nsg") == mark + fixed
