"""`scenelang check`: exit codes, formats, -D over several files."""

from __future__ import annotations

import io
import json
import re

import pytest

from scenelang.cli.say import wants_color, width_of
from tests.cli.conftest import Folder

WARNS = "square { material flat { color([2, 0, 0]); } }"


def test_good_scenes(folder: Folder) -> None:
    result = folder.run("check", folder.write("a.nsg"), folder.write("b.nsg"))
    assert (result.exit_code, result.stdout) == (0, "no mistakes in 2 scenes\n")


def test_every_mistake_with_a_caret(folder: Folder) -> None:
    result = folder.run("check", folder.write("a.nsg", "square { scale(foo); }\nstar { rotate(45); }\n"))
    assert result.exit_code == 1
    assert "a.nsg:1:16" in result.stdout
    assert "a.nsg:2:15" in result.stdout
    assert "^^^" in result.stdout
    assert "2 errors" in result.stdout


def test_strict_counts_warnings(folder: Folder) -> None:
    name = folder.write("a.nsg", WARNS)
    assert folder.run("check", name).exit_code == 0
    assert folder.run("check", name, "--strict").exit_code == 1


def test_json(folder: Folder) -> None:
    result = folder.run("check", folder.write("ä.nsg", "/* ö */ square { scale(foo); }"), "--format", "json")
    data = json.loads(result.stdout)
    assert data["version"] == 1
    first = data["diagnostics"][0]
    assert (first["code"], first["severity"], first["file"]) == ("E0201", "error", "ä.nsg")
    assert first["start"] == {"line": 1, "column": 24}
    assert first["end"] == {"line": 1, "column": 27}
    assert json.loads(folder.run("check", folder.write("b.nsg"), "--format", "json").stdout) == {
        "version": 1,
        "diagnostics": [],
    }


def test_other_formats(folder: Folder) -> None:
    name = folder.write("a.nsg", "square { scale(foo); }")
    sarif = json.loads(folder.run("check", name, "--format", "sarif").stdout)
    assert sarif["runs"][0]["results"][0]["ruleId"] == "E0201"
    assert folder.run("check", name, "--format", "github").stdout.startswith("::error ")
    assert folder.run("check", name, "--format", "concise").stdout.startswith("a.nsg:1:16: error[E0201] ")


def test_unreadable_files_are_2_and_the_others_are_checked(folder: Folder) -> None:
    result = folder.run("check", "none.nsg", folder.write("a.nsg", "square { scale(foo); }"))
    assert result.exit_code == 2
    assert result.stderr == "Error: none.nsg: no such file or directory\n"
    assert "E0201" in result.stdout


def test_folders_stand_for_their_scenes(folder: Folder) -> None:
    for name in ("a.nsg", "in/b.nsg", ".hidden/c.nsg", "in/notes.txt"):
        folder.write(name, "square { scale(foo); }")
    result = folder.run("check", ".", "a.nsg", "--format", "concise")
    assert [line.split(":")[0] for line in result.stdout.splitlines()] == ["./a.nsg", "./in/b.nsg"]
    empty = folder.run("check", ".hidden/none.nsg", ".")
    assert empty.exit_code == 2
    (folder.path / "empty").mkdir()
    result = folder.run("check", "empty")
    assert (result.exit_code, result.stderr) == (2, "Error: no scenes (*.nsg) there\n")


def test_defines(folder: Folder) -> None:
    name = folder.write("a.nsg", "param width = 0.5 in 0..1; square { scale(width); }")
    assert folder.run("check", name, "-D", "width=0.7").exit_code == 0
    assert "E0309" in folder.run("check", name, "-D", "width=7").stdout
    unused = folder.run("check", name, "-D", "widht=0.7")
    assert unused.exit_code == 1
    assert "did you mean `width`?" in unused.stdout


def test_a_define_is_unused_only_if_no_file_uses_it(folder: Folder) -> None:
    one, other = folder.write("a.nsg", "param k = 1; square { scale(k); }"), folder.write("b.nsg")
    assert folder.run("check", one, other, "-D", "k=0.7").exit_code == 0
    result = folder.run("check", one, other, "-D", "q=0.7")
    assert result.exit_code == 1
    assert result.stdout.count("error[E0211]") == 1


def test_what_two_scenes_import_is_reported_once(folder: Folder) -> None:
    folder.write("lib.nsg", "let a = foo;\n")
    text = 'import "lib.nsg" as lib; square { scale(lib.a); }'
    result = folder.run("check", folder.write("a.nsg", text), folder.write("b.nsg", text))
    assert result.stdout.count("error[E0201]") == 1


def test_root(folder: Folder) -> None:
    folder.write("lib.nsg", "let a = 0.5;")
    name = folder.write("scenes/a.nsg", 'import "../lib.nsg" as lib; square { scale(lib.a); }')
    assert "E0215" in folder.run("check", name).stdout
    assert folder.run("check", name, "--root", ".").exit_code == 0


def test_standard_input(folder: Folder) -> None:
    folder.write("lib.nsg", "let a = 0.5;")
    text = 'import "lib.nsg" as lib; square { scale(lib.a); }'
    assert folder.run("check", "-", stdin=text).exit_code == 0
    result = folder.run("check", "-", "--format", "concise", stdin="square { scale(foo); }")
    assert result.stdout.startswith("<stdin>:1:16: error[E0201]")


def test_frames(folder: Folder) -> None:
    name = folder.write("a.nsg", "animate(1, 10); square { translate(u, 0); }")
    assert folder.run("check", name, "--frame", "9").exit_code == 0
    assert "E0337" in folder.run("check", name, "--frame", "10").stdout


def test_several_frames_of_an_animation(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """By default four, which is what keeps `check` from passing what `render` refuses."""
    text = "animate(1, 40);\nsquare { rotate(u); }\nif (frame == 7) { star { scale(0 / 0); } }\n"
    name = folder.write("a.nsg", text)

    def found(*options: str) -> list[str]:
        return folder.run("check", name, "--format", "concise", *options).stdout.splitlines()

    angle = f"{name}:2:17: error[E0302] expected an angle, found a bare number (frame "
    assert found() == [f"{angle}1)"]
    assert found("--frame", "3") == [f"{angle}3)"]
    assert found("--frame", "0") == []
    division = f"{name}:3:36: error[E0304] division by zero (frame 7)"
    assert found("--all-frames") == [f"{angle}1)", division]
    monkeypatch.setattr("scenelang.language.evaluation.MAX_OBJECTS", 4)
    result = folder.run("check", name, "--all-frames")
    assert "35 frames left out: " in result.stderr


def test_summary_counts_what_can_be_fixed(folder: Folder) -> None:
    """Only in files that were named: others would not be changed."""
    folder.write("lib.nsg", "let a = sqrrt(2);\n")
    name = folder.write(
        "a.nsg", 'import "lib.nsg" as lib;\nsquare { rotate(45); scale(lib.a); }\nstar { scale(2) }\n'
    )
    assert folder.run("check", name).stdout.splitlines()[-2] == "3 errors; 2 fixable with `--fix`"
    assert folder.run("check", name, "lib.nsg").stdout.splitlines()[-2] == "3 errors; 3 fixable with `--fix`"
    assert folder.run("check", name).stdout.endswith("\nFor more, try `scenelang explain E0302`.\n")
    assert not re.search("fixable|explain", folder.run("check", name, "--quiet").stdout)
    assert folder.run("check", folder.write("b.nsg"), "-q").stdout == ""


def test_warnings_can_be_chosen(folder: Folder) -> None:
    name = folder.write("a.nsg", "let a = 1;\n" + WARNS)
    codes = ("W0201", "W0301")

    def shown(*arguments: str) -> list[str]:
        text = folder.run("check", name, "--format", "concise", *arguments).stdout
        return [code for code in codes if code in text]

    assert shown() == ["W0201", "W0301"]
    assert shown("--ignore", "W02") == ["W0301"]
    assert shown("--ignore", "w0201,W0301") == []
    assert shown("--select", "W02", "--select", "W04") == ["W0201"]
    assert shown("--select", "W", "--ignore", "W03") == ["W0201"]
    assert folder.run("check", name, "--strict", "--ignore", "W").exit_code == 0
    errors = folder.write("b.nsg", "square { rotate(45); }")
    assert folder.run("check", errors, "--ignore", "W").exit_code == 1


def test_most(folder: Folder) -> None:
    name = folder.write("a.nsg", "square { scale(a1, b1); translate(c1, d1); }")
    result = folder.run("check", name, "--max-diagnostics", "1")
    assert result.exit_code == 1
    assert result.stdout.count("error[") == 1
    assert "\n\n… and 3 more\n\n4 errors\n" in result.stdout
    data = json.loads(folder.run("check", name, "--max-diagnostics", "3", "--format", "json").stdout)
    assert len(data["diagnostics"]) == 3


def test_colour(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    name = folder.write("a.nsg", "square { rotate(45); }")
    assert "\x1b" not in folder.run("check", name).stdout
    assert "\x1b[1;31m" in folder.run("check", name, "--color", "always").stdout
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[1;31m" in folder.run("check", name, "--color", "always").stdout
    assert "\x1b" not in folder.run("check", name, "--color", "auto").stdout


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_colours_are_for_terminals(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    assert wants_color(Terminal())
    assert not wants_color(io.StringIO())
    assert wants_color(io.StringIO(), "always")
    assert not wants_color(Terminal(), "never")
    monkeypatch.setenv("TERM", "dumb")
    assert not wants_color(Terminal())
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("NO_COLOR", "yes")
    assert not wants_color(Terminal())
    monkeypatch.setenv("COLUMNS", "77")
    assert width_of(Terminal()) == 77
    assert width_of(io.StringIO()) == 140
