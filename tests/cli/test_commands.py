"""The other commands, and whole processes."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from scenelang.cli.main import COMMANDS, cli
from scenelang.cli.options import Real, Sectioned
from scenelang.compiler.manifest import available
from tests.cli.conftest import Folder


def test_help_lists_every_command(folder: Folder) -> None:
    said = folder.run("--help").stdout
    assert "Draw 2D and 3D scenes" in said
    for name, words in COMMANDS.items():
        assert said.count(f"\n  {name.ljust(max(map(len, COMMANDS)))}  {words}\n") == 1
        assert folder.run(name, "--help").exit_code == 0
    titles = [line for line in said.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert titles == ["Options:", "Draw:", "Write:", "Measure:", "Develop:"]


def options_of(command: click.Command, path: str = "") -> Iterator[tuple[str, click.Option]]:
    """All options of all commands, with the commands' names."""
    yield from ((f"{path} {p.opts[0]}", p) for p in command.params if isinstance(p, click.Option))
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from options_of(found, f"{path} {name}")


def test_the_words_on_an_option_stand_alone() -> None:
    found = dict(options_of(cli))
    assert len(found) > 150
    opening = ("Of", "What", "How", "Where", "Which", "Those", "Whether", "Gets", "Behind", "By")
    for name, option in found.items():
        assert option.help is not None, name
        assert re.match(r"[A-Z]\S", option.help), name
        assert option.help.split()[0] not in opening, name


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


def test_no_option_takes_what_is_not_a_number() -> None:
    """Whose bounds `nan` would pass, as it is neither below nor above them."""
    found = 0
    context = click.Context(cli)
    for name, option in options_of(cli):
        if isinstance(option.type, click.types.FloatParamType):
            found += 1
            assert isinstance(option.type, Real), name
            with pytest.raises(click.BadParameter, match="not a number"):
                option.type.convert("nan", option, context)
    assert found > 5


def test_version(folder: Folder) -> None:
    assert folder.run("--version").stdout.startswith("scenelang ")


def test_models(folder: Folder) -> None:
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


def test_models_without_weights(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenelang.compiler.weights.weights_path", lambda name: folder.path / "none")
    assert "missing or damaged" in folder.run("models", "shapes2d").stdout


def process(*arguments: str, **options: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "scenelang", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)  # type: ignore[call-overload, no-any-return]


def test_whole_processes(folder: Folder) -> None:
    folder.write("a.nsg")
    with process("render", "a.nsg", "-o", "a.png", "--size", "32x32") as drawn:
        assert drawn.communicate() == ("", "")
    assert drawn.returncode == 0
    assert Path("a.png").exists()
    with process("check", "none.nsg") as checked:
        assert checked.communicate() == ("", "Error: none.nsg: no such file or directory\n")
    assert checked.returncode == 2


def test_a_scene_of_any_characters_on_a_terminal_of_few(folder: Folder) -> None:
    name = folder.write("a.nsg", "// ☂\nsquare { scale(☂); }\n")
    with process("check", name, env={**os.environ, "PYTHONIOENCODING": "latin-1"}) as run:
        out, err = run.communicate()
    assert run.returncode == 1
    assert "\\u2602" in out
    assert err == ""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signal")
def test_interrupted(folder: Folder) -> None:
    name = folder.write("a.nsg", "for (i in 0..<400) { star { scale(4.5, 0.9); rotate(1turn * rand(i)); } }")
    with process("render", name, "-o", "a.png", "--size", "4096x4096", "-v") as run:
        assert run.stderr is not None
        for line in run.stderr:
            if line.startswith("1 warning"):
                break  # what comes next takes seconds: torch is loaded, and the picture is drawn
        run.send_signal(signal.SIGINT)
        _, err = run.communicate()
    assert run.returncode == 130, err
    assert "Traceback" not in err
    assert os.listdir() == ["a.nsg"]


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
    found = subprocess.run([sys.executable, "-m", "probe"], capture_output=True, check=False)
    assert (found.returncode, found.stderr) == (130, b"")
