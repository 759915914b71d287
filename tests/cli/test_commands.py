"""Help, `explain`, `export`, `models`, and whole processes."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from scenelang.cli.main import COMMANDS, cli
from scenelang.cli.options import Real, Sectioned
from scenelang.compiler.manifest import available
from scenelang.language.pages import CODES, read_page
from scenelang.language.reports import paint
from tests.cli.conftest import GOOD, Folder


def test_help_lists_every_command(folder: Folder) -> None:
    said = folder.run("--help").stdout
    assert "Draw 2D and 3D scenes" in said
    for name, words in COMMANDS.items():
        assert said.count(f"\n  {name.ljust(max(map(len, COMMANDS)))}  {words}\n") == 1
        folder.run(name, "--help", code=0)
    titles = [line for line in said.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert titles == ["Options:", "Draw:", "Write:", "Measure:", "Develop:"]
    assert folder.run("--version").stdout.startswith("scenelang ")


def test_options_of_render_stand_under_headings_once_each(folder: Folder) -> None:
    said = folder.run("render", "--help").stdout
    for title in ("\nOptions:\n", "\nAnimations:\n", "\nHow it is drawn:\n", "\nMore than a picture:\n"):
        assert said.count(title) == 1
    render = cli.get_command(click.Context(cli), "render")
    assert isinstance(render, Sectioned)
    long = [max(p.opts, key=len) for p in render.params if isinstance(p, click.Option)]
    assert {name for names in render.sections.values() for name in names.split()} < set(long)
    for name in long:
        assert len(re.findall(rf"^  (?:-\w, )?{name}\b", said, re.MULTILINE)) == 1


def options_of(command: click.Command, path: str = "") -> Iterator[tuple[str, click.Option]]:
    """All options of all commands, with the commands' names."""
    yield from ((f"{path} {p.opts[0]}", p) for p in command.params if isinstance(p, click.Option))
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from options_of(found, f"{path} {name}")


def test_options_say_what_they_are_and_take_numbers_alone() -> None:
    """The words on one stand alone; no bound lets `nan` pass, which is neither below nor above it."""
    found, numbers = dict(options_of(cli)), 0
    assert len(found) > 150
    opening = ("Of", "What", "How", "Where", "Which", "Those", "Whether", "Gets", "Behind", "By")
    for name, option in found.items():
        assert option.help is not None, name
        assert re.match(r"[A-Z]\S", option.help), name
        assert option.help.split()[0] not in opening, name
        if isinstance(option.type, click.types.FloatParamType):
            numbers += 1
            assert isinstance(option.type, Real), name
            with pytest.raises(click.BadParameter, match="not a number"):
                option.type.convert("nan", option, click.Context(cli))
    assert numbers > 5


def test_models(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    assert folder.run("models").stdout.startswith("shapes2d  2D  ")
    said = folder.run("models", "shapes2d").stdout
    for words in ("square, triangle, star, pentagon", "digest", "seed", "revision", "parameters"):
        assert words in said
    listed = json.loads(folder.run("models", "--format", "json").stdout)
    facts = json.loads(folder.run("models", "shapes2d", "--format", "json").stdout)
    assert [each["manifest"]["name"] for each in listed] == available()
    assert listed[0] == facts
    assert facts["weights"]["training"]["config"]["model"] == "shapes2d"
    assert facts["weights"]["parameters"] > 1000
    assert not re.search(r"(?<![.\d])\d+\.(\d{6}|0\b)", said)
    monkeypatch.setattr("scenelang.compiler.weights.weights_path", lambda name: folder.path / "none")
    assert "missing or damaged" in folder.run("models", "shapes2d").stdout


# ---------------------------------------------------------------- explain


def test_explain(folder: Folder) -> None:
    """A page by its code as it was printed, lists, words, and what is near."""
    page = folder.run("explain", "E0302", code=0).stdout
    assert page.startswith("error[E0302]: bare number where an angle is wanted\n\n")
    assert "\n    square { rotate(45); }\n" in page
    assert not re.search("```|#|\x1b", page)
    assert "\n    parts.nsg:\n    import" in folder.run("explain", "E0216").stdout
    assert "\x1b[1;31m" in folder.run("explain", "E0302", "--color", "always").stdout
    for given in ("e0302", " E0302", "error[E0302]", "[E0302]:"):
        assert folder.run("explain", given).stdout == page
    for arguments in ((), ("--list",), ("E0302", "--list")):
        shown = folder.run("explain", *arguments).stdout
        assert re.findall(r"^  ([EW]\d{4})  ", shown, re.MULTILINE) == list(CODES)
        assert shown.startswith("syntax\n  E0101")
    shown = folder.run("explain", "semicolon").stdout
    assert re.findall(r"[EW]\d{4}", shown) == ["E0102", "E0130", "W0101"]
    for word in ("colour", "Color"):
        found = re.findall(r"[EW]\d{4}", folder.run("explain", word).stdout)
        assert {"E0118", "E0301", "E0330", "W0301"} <= set(found)
    for wrong, advice in (("E9302", "Did you mean"), ("rumba", "--list"), ("", "--list")):
        assert advice in folder.run("explain", wrong, code=2).stderr


def test_explain_as_json(folder: Folder) -> None:
    data = json.loads(folder.run("explain", "E0309", "--format", "json").stdout)
    assert (data["version"], data["code"], data["severity"]) == (1, "E0309", "error")
    assert data["title"] == "param outside its range"
    assert data["text"].startswith("# E0309: ")
    assert [example["kind"] for example in data["examples"]] == ["bad", "good"]
    assert data["examples"][0]["options"] == ["-D", "size=7"]
    listed = json.loads(folder.run("explain", "--format", "json").stdout)
    assert [item["code"] for item in listed["codes"]] == list(CODES)


def test_every_page_reads_well_in_a_terminal() -> None:
    for page in map(read_page, CODES):
        text = page.plain(60)
        assert not re.search(r"```|^#|<!--|\]\(|[ \t]$", text, re.MULTILINE), page.code
        prose = [line for line in text.splitlines()[1:] if not line.startswith("    ")]
        assert all(len(line) <= 60 for line in prose if " " in line), page.code
        assert all(example.text.splitlines()[0] in text for example in page.examples), page.code
        colored = page.plain(60, lambda text, style: paint(style, text, True))
        assert re.sub(r"\x1b\[[\d;]*m", "", colored) == text


# ---------------------------------------------------------------- export


def test_pages_of_scenes_programs_and_json(folder: Folder) -> None:
    scene = folder.write("a.nsg", "param k = 1 in 0..2;" + GOOD)
    assert folder.run("export", scene, "-o", "a.html", "-D", "k=2", code=0).output == ""
    text = folder.read("a.html")
    assert text.startswith("<!doctype html>")
    assert "<title>a</title>" in text
    folder.run("compile", scene, "-o", "b.safetensors", code=0)
    folder.run("convert", scene, "-o", "c.json", code=0)
    result = folder.run("export", scene, "b.safetensors", "c.json", "-o", "out", "-v", code=0)
    assert sorted(os.listdir("out")) == ["a.html", "b.html", "c.html"]
    assert "out/b.html" in result.output
    folder.run("export", "-", "-o", "out/", "--title", "Sales & more", stdin=GOOD, code=0)
    assert "<title>Sales &amp; more</title>" in folder.read("out/stdin.html")


def test_scenes_without_pages(folder: Folder) -> None:
    """Scenes with errors are left out; a page replaces no input and follows no link nobody wrote."""
    names = (
        folder.write("a.nsg"),
        folder.write("b.nsg", "circle;"),
        folder.write("c.nsg", 'model "shapes2d-reading"; star;'),
    )
    result = folder.run("export", *names, "nowhere.nsg", "-o", "out", code=2)
    assert os.listdir("out") == ["a.html"]
    for fact in ("E0204", "nowhere.nsg: no such file", "`shapes2d-reading` draws whole pictures"):
        assert fact in result.output
    folder.run("export", names[1], "-o", "b.html", code=1)
    folder.run("export", names[0], "-o", "a.html", "-D", "k=1", code=1)
    assert not Path("a.html").exists()
    folder.write("a.html")
    assert "an input of the same command" in folder.run("export", "a.html", "-o", "a.html").output
    os.symlink("elsewhere.html", "out/b.html")
    assert "is a link" in folder.run("export", "b.nsg", "-o", "out").output


# ---------------------------------------------------------------- whole processes


def process(*command: str, **environment: str) -> tuple[int, str, str]:
    run = subprocess.run(
        [sys.executable, "-m", *command],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        check=False,
    )
    return run.returncode, run.stdout, run.stderr


def test_whole_processes(folder: Folder) -> None:
    folder.write("a.nsg")
    assert process("scenelang", "render", "a.nsg", "-o", "a.png", "--size", "32x32") == (0, "", "")
    assert Path("a.png").exists()
    # a terminal may lack characters of a scene
    folder.write("b.nsg", "// ☂\nsquare { scale(☂); }\n")
    code, out, err = process("scenelang", "check", "b.nsg", PYTHONIOENCODING="latin-1")
    assert (code, "\\u2602" in out, err) == (1, True, "")


INSIDE_EXEC = """
import sys, types
command = types.ModuleType("scenelang.cli.main")
command.main = lambda: exec("import signal; signal.raise_signal(signal.SIGINT)")
sys.modules[command.__name__] = command
from scenelang.cli.start import main
main()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signal")
def test_interrupted_while_a_class_is_made_from_text(folder: Folder) -> None:
    folder.write("probe.py", INSIDE_EXEC)
    assert process("probe") == (130, "", "")
