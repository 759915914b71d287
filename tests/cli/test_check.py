"""`scenelang check`: exit codes, formats, -D over several files."""

from __future__ import annotations

import json

import pytest

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


def test_what_the_passes_find(folder: Folder) -> None:
    text = "subtract { square {} intersect { star {} pentagon {} } }"
    result = folder.run("check", folder.write("a.nsg", text), "--format", "concise")
    assert result.exit_code == 1
    assert "error[E0402]" in result.stdout


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
    assert folder.run("check", ".").exit_code == 2


@pytest.mark.parametrize(
    "arguments",
    [("check",), ("check", "a.nsg", "--format", "xml"), ("check", "a.nsg", "-D", "k"), ("chekc",)],
)
def test_usage(folder: Folder, arguments: tuple[str, ...]) -> None:
    folder.write("a.nsg")
    assert folder.run(*arguments).exit_code == 2


def test_a_misspelt_command(folder: Folder) -> None:
    assert "Did you mean 'check'?" in folder.run("chekc").stderr


def test_defines(folder: Folder) -> None:
    name = folder.write("a.nsg", "param width = 0.5 in 0..1; square { scale(width); }")
    assert folder.run("check", name, "-D", "width=0.7").exit_code == 0
    assert "E0309" in folder.run("check", name, "-D", "width=7").stdout
    unused = folder.run("check", name, "-D", "widht=0.7")
    assert unused.exit_code == 1
    assert "did you mean 'width'?" in unused.stdout


def test_a_define_is_unused_only_if_no_file_uses_it(folder: Folder) -> None:
    one, other = folder.write("a.nsg", "param k = 1; square { scale(k); }"), folder.write("b.nsg")
    assert folder.run("check", one, other, "-D", "k=0.7").exit_code == 0
    result = folder.run("check", one, other, "-D", "q=0.7")
    assert result.exit_code == 1
    assert result.stdout.count("E0211") == 1


def test_what_two_scenes_import_is_reported_once(folder: Folder) -> None:
    folder.write("lib.nsg", "let a = foo;\n")
    text = 'import "lib.nsg" as lib; square { scale(lib.a); }'
    result = folder.run("check", folder.write("a.nsg", text), folder.write("b.nsg", text))
    assert result.stdout.count("E0201") == 1


def test_root(folder: Folder) -> None:
    folder.write("lib.nsg", "let a = 0.5;")
    name = folder.write("scenes/a.nsg", 'import "../lib.nsg" as lib; square { scale(lib.a); }')
    assert "E0215" in folder.run("check", name).stdout
    assert folder.run("check", name, "--root", ".").exit_code == 0
    assert folder.run("check", name, "--root", "nowhere").exit_code == 2


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


def test_models(folder: Folder) -> None:
    name = folder.write("a.nsg")
    assert folder.run("check", name, "--model", "shapes2d").exit_code == 0
    assert "E0210" in folder.run("check", name, "--model", "shapes").stdout


def test_text_that_is_no_scene(folder: Folder) -> None:
    (folder.path / "a.nsg").write_bytes(b"\xff\xfe\x00square")
    result = folder.run("check", "a.nsg")
    assert result.exit_code == 1
    assert "not UTF-8" in result.stdout
