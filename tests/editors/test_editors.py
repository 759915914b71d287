"""What `editors/` holds works: the Vim files in Vim, snippets in the parser, settings in the server."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from scenelang.cli.main import COMMANDS
from scenelang.language.formatting import format_text

EDITORS = Path(__file__).parents[2] / "editors"
VIM, VSCODE = EDITORS / "vim", EDITORS / "vscode"
SAMPLE = """// a comment TODO
nsg 1;
let mist = material flat { color(#d33); };
fn wave(x) = 0.5 + sin(1turn * x) * .5e-1; /* block
still */ param k = 0.25 in 0..1 step 0.25;
chain {
  star { scale(30deg); mist { hue("a\\"b"); } }
  subtract dot(axis = X, u);
}
"""
EXPECTED = [
    *[("// a", "nsgComment"), ("TODO", "nsgTodo"), ("nsg 1", "nsgDeclare"), ("1;", "nsgNumber")],
    *[("let", "nsgDeclare"), ("mist =", ""), ("= mat", "nsgOperator"), ("material", "nsgMaterial")],
    *[("flat", "nsgObject"), ("color", "nsgTransform"), ("#d33", "nsgColor"), ("fn", "nsgDeclare")],
    *[
        ("wave", "nsgDefined"),
        ("x)", ""),
        ("0.5 ", "nsgNumber"),
        ("+ sin", "nsgOperator"),
        ("sin", "nsgFunction"),
    ],
    *[("1turn", "nsgNumber"), ("turn", "nsgNumber"), (".5e-1", "nsgNumber"), ("still", "nsgComment")],
    *[("param", "nsgDeclare"), ("in 0", "nsgControl"), ("0..1", "nsgNumber"), ("..1", "nsgOperator")],
    *[("step", "nsgControl"), ("chain", "nsgNode"), ("star", "nsgObject"), ("30deg", "nsgNumber")],
    *[("mist {", "nsgObject"), ('"a', "nsgString"), ('\\"b', "nsgEscape"), ("subtract", "nsgNode")],
    *[("dot", "nsgCall"), ("axis", ""), ("X,", "nsgConstant"), ("u)", "nsgAnimated")],
]


def vim(folder: Path, script: str) -> str:
    """What a script in Vim's ex mode writes to `out`, with our files first in its path."""
    (folder / "script.vim").write_text(script)
    command = ["vim", "-u", "NONE", "-i", "NONE", "-N", "-n", "-es", "-S", "script.vim"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    out = folder / "out"
    assert out.exists(), done.stdout + done.stderr
    return out.read_text("utf-8")


needs_vim = pytest.mark.skipif(shutil.which("vim") is None, reason="NOT RUN: there is no vim here")
HEAD = f"set runtimepath^={VIM}\nfiletype plugin indent on\nsyntax on\nedit scene.nsg\n"


@needs_vim
def test_vim_colours(tmp_path: Path) -> None:
    (tmp_path / "scene.nsg").write_text(SAMPLE, "utf-8")
    script = [HEAD, "let g:out = [&filetype, b:current_syntax, &commentstring, &shiftwidth]"]
    for text, _ in EXPECTED:
        before = SAMPLE[: SAMPLE.index(text)]
        line, column = before.count("\n") + 1, len(before.rpartition("\n")[2].encode()) + 1
        script.append(f"call add(g:out, synIDattr(synID({line}, {column}, 1), 'name'))")
    script += ["call writefile(map(g:out, 'string(v:val)'), 'out')", "qall!"]
    found = [line.strip("'") for line in vim(tmp_path, "\n".join(script)).splitlines()]
    assert found[:4] == ["nsg", "nsg", "// %s", "2"]
    told = list(zip([text for text, _ in EXPECTED], found[4:], strict=True))
    assert told == EXPECTED


@needs_vim
def test_vim_formats_and_indents(tmp_path: Path) -> None:
    (tmp_path / "scene.nsg").write_text("square   {}\n\n\n\nstar{}\n", "utf-8")
    program = tmp_path / "scenelang"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m scenelang "$@"\n')
    program.chmod(0o755)
    script = (
        f"{HEAD}let $PATH = '{tmp_path}:' . $PATH\n"
        "NsgFormat\nlet g:out = getline(1, '$')\n"
        "call setline(1, ['group {', 'square {', 'scale(', '1,', ');', '}', '}'])\nnormal gg=G\n"
        "call writefile(g:out + ['--'] + getline(1, '$'), 'out')\nqall!\n"
    )
    formatted, indented = vim(tmp_path, script).split("--\n")
    assert formatted == "square {}\n\nstar {}\n"
    assert indented == "group {\n  square {\n    scale(\n      1,\n    );\n  }\n}\n"


def test_snippets_are_scene_text_in_the_canonical_layout() -> None:
    for name, snippet in json.loads((VSCODE / "snippets/nsg.json").read_text("utf-8")).items():
        body = snippet["body"]
        text = re.sub(r"\$\{\d+\|([^,|]*)[^}]*\}", r"\1", body if isinstance(body, str) else "\n".join(body))
        text = re.sub(r"\$\d+", "", re.sub(r"\$\{\d+:([^}]*)\}", r"\1", text))
        text = re.sub(r"\n\s*(?=\n)", "", text).strip() + "\n"
        # Snippets are opened blocks to write in, even where little text would fit on one line.
        assert re.sub(r"\s", "", format_text(text)) == re.sub(r"\s", "", text), name


def test_extension_names_what_exists() -> None:
    package = json.loads((VSCODE / "package.json").read_text("utf-8"))
    given = package["contributes"]
    ignored = (VSCODE / ".gitignore").read_text("utf-8").splitlines()
    paths = [package["icon"], given["languages"][0]["configuration"]]
    paths += [item["path"].removeprefix("./") for item in (*given["grammars"], *given["snippets"])]
    for path in paths:
        assert path in ignored or (VSCODE / path).exists(), path
    for name in ("language-configuration.json", "syntaxes/markdown.tmLanguage.json", "package-lock.json"):
        json.loads((VSCODE / name).read_text("utf-8"))
    client = (VSCODE / "src/extension.js").read_text("utf-8")
    commands = {command["command"] for command in given["commands"]}
    assert commands == set(re.findall(r'registerCommand\("([^"]+)"', client))
    settings = {name.removeprefix("scenelang.") for name in given["configuration"]["properties"]}
    assert settings == set(re.findall(r'\.get\(\s*"([\w.]+)"', client))


def test_extension_passes_the_settings_of_the_server() -> None:
    pytest.importorskip("pygls")
    from scenelang.editors.workspace import Settings

    hints = {"values": False, "arguments": False}
    changed = {"model": "m", "root": "/r", "debounceMs": 7, "inlayHints": hints}
    default, read = Settings.read({}), Settings.read({"scenelang": changed})
    client = (VSCODE / "src/extension.js").read_text("utf-8")
    for name in Settings.__dataclass_fields__:
        assert getattr(read, name) != getattr(default, name)
    for key in ("model", "root", "debounceMs", "inlayHints", "values", "arguments"):
        assert re.search(rf"\b{key}:", client), key
    package = json.loads((VSCODE / "package.json").read_text("utf-8"))
    properties = package["contributes"]["configuration"]["properties"]
    assert properties["scenelang.debounceMs"]["default"] == default.debounce_ms


def test_editors_start_a_command_that_exists() -> None:
    helix = tomllib.loads((EDITORS / "helix/languages.toml").read_text("utf-8"))
    server, language = helix["language-server"]["scenelang"], helix["language"][0]
    assert server["args"][0] in COMMANDS
    assert language["formatter"]["args"][0] in COMMANDS
    assert '"scenelang", "lsp"' in (EDITORS / "neovim/scenelang.lua").read_text("utf-8")
    assert 'args: ["lsp", "--stdio"]' in (VSCODE / "src/extension.js").read_text("utf-8")
    assert "lsp" in COMMANDS
