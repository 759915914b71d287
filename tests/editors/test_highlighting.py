"""Colours in Pygments, TextMate and Vim, held against the language's lexer; what `editors/` holds works."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pygments.lexers import get_lexer_by_name, get_lexer_for_filename
from pygments.token import Comment, Error, Keyword, Name, Number, Operator, Punctuation, String, Whitespace

from scenelang.cli.main import COMMANDS
from scenelang.editors.highlighting import NsgLexer
from scenelang.editors.workspace import ClientSettings
from scenelang.language import words
from scenelang.language.diagnostics import SourceFile
from scenelang.language.formatting import format_text
from scenelang.language.lexer import Report, scan
from scenelang.language.tables import tables
from tests.language.reading import SCENES

ROOT = Path(__file__).parents[2]
FILES = sorted([*(ROOT / "examples").rglob("*.nsg"), *(ROOT / "tests/conformance").rglob("*.nsg"), *SCENES])
EDITORS = ROOT / "editors"
VIM, VSCODE = EDITORS / "vim", EDITORS / "vscode"

CLASSES = {"NAME": Name, "NUMBER": Number, "STRING": String, "COLOR": Number.Hex}
SCOPES = {
    "NAME": r"variable|entity\.name|support\.function|constant\.language\.nsg",
    "NUMBER": r"constant\.numeric",
    "STRING": r"string\.quoted",
    "COLOR": r"constant\.other\.color",
}
KEYWORD = r"keyword\.(declaration|control)|storage\.type|constant\.language\.boolean"
SIGN = r"keyword\.operator|punctuation"


def scanned(text: str) -> list[tuple[int, int, str]]:
    """Start, end and terminal of each token of a text."""
    tokens = scan(source := SourceFile("", text), Report(source))
    kinds = (tables().kinds[kind] for kind in tokens.kinds[:-1])
    return list(zip(tokens.starts[:-1], tokens.ends[:-1], kinds, strict=True))


def same_tokens(text: str) -> None:
    read = list(NsgLexer().get_tokens_unprocessed(text))
    assert "".join(value for _, _, value in read) == text
    assert not [value for _, kind, value in read if kind in Error]
    seen = [found for found in read if found[1] not in Whitespace and found[1] not in Comment]
    tokens = scanned(text)
    assert [(start, value) for start, _, value in seen] == [(s, text[s:e]) for s, e, _ in tokens]
    for (_, kind, value), (_, _, terminal) in zip(seen, tokens, strict=True):
        if terminal in CLASSES:
            assert kind in CLASSES[terminal], (value, kind)
        elif terminal[0].isalpha():
            assert kind in Keyword, (value, kind)
        else:
            assert kind in Operator or kind in Punctuation, (value, kind)


def test_tokens_of_files() -> None:
    for path in FILES:
        same_tokens(path.read_text("utf-8"))


ODD = [
    *("0..3", "0..<4", "1.", ".5", "1.x", "5deg..6deg", "1e-3", "a.b", "// c\n", "/* m\n */", '"s\\""'),
    *("lib.name(", "#d33..", "material", "t", "u {", "\n"),
]


@settings(max_examples=60)
@given(st.lists(st.sampled_from([*tables().literals, *ODD]), max_size=30))
def test_tokens_of_any_words(parts: list[str]) -> None:
    same_tokens(" ".join(parts))


def test_the_lexer_classes_names_and_marks_errors() -> None:
    assert isinstance(get_lexer_by_name("nsg"), NsgLexer)
    assert isinstance(get_lexer_for_filename("flower.nsg"), NsgLexer)
    text = "fn f(x) = sin(x); module m() { square { scale(1); material flat; } } let a = t; f(1);"
    classes = {value: kind for _, kind, value in NsgLexer().get_tokens_unprocessed(text)}
    expected = {"f": Name.Function, "m": Name.Class, "square": Name.Class, "sin": Name.Builtin}
    for word, kind in (expected | {"scale": Name.Builtin, "t": Name.Variable}).items():
        assert classes[word] in kind, word
    assert classes["a"] is Name
    for text in ("@", "30degrees", "#ggg", '"open', "/* open", "é"):
        read = list(NsgLexer().get_tokens_unprocessed(text))
        assert "".join(value for _, _, value in read) == text
        assert any(kind in Error for _, kind, _ in read), text


def test_every_keyword_and_terminal_is_matched() -> None:
    """By an expression of the right class, read with Python's engine."""
    grammar = (ROOT / "grammar/scenelang.tmLanguage.json").read_text("utf-8")
    repository = json.loads(grammar)["repository"]

    def matched(group: str, text: str) -> bool:
        return any(re.fullmatch(p["match"], text) for p in repository[group]["patterns"] if "match" in p)

    rows = [("keywords" if text[0].isalpha() else "signs", text) for text in tables().literals]
    numbers = ["0", "1.", ".5", "1e-3", "30deg", "0.5rad", "0.25turn", "2s", "40ms", "#d33", "#a0B1c2"]
    rows += [("numbers", text) for text in numbers]
    rows += [("names", text) for text in ("square", "_a1", *words.CONSTANTS, *words.ANIMATED)]
    assert [row for row in rows if not matched(*row)] == []
    assert not matched("numbers", "30degrees")
    assert not matched("numbers", "#ggg")


def test_vscode_reads_the_tokens_of_the_language() -> None:
    """Each token of every scene begins where the engine's does and has a scope of its class."""
    if shutil.which("node") is None or not (VSCODE / "node_modules/vscode-textmate").exists():
        pytest.skip("NOT RUN: vscode-textmate is missing; run `npm ci` in editors/vscode")
    command = ["node", "test/tokenize.cjs", str(ROOT / "grammar/scenelang.tmLanguage.json"), *map(str, FILES)]
    done = subprocess.run(command, cwd=VSCODE, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for name, found in json.loads(done.stdout).items():
        text = Path(name).read_text("utf-8")
        scopes = {(line, start): scope for line, start, _, scope in found}
        for start, _, terminal in scanned(text):
            column = text[text.rfind("\n", 0, start) + 1 : start]
            place = text.count("\n", 0, start), len(column.encode("utf-16-le")) // 2
            expected = SCOPES.get(terminal) or (KEYWORD if terminal[0].isalpha() else SIGN)
            if terminal in {"step", "as"}:  # may be names
                expected += "|" + SCOPES["NAME"]
            assert re.match(expected, scopes.get(place, "")), (name, place, terminal, scopes.get(place))
        assert not [scope for scope in scopes.values() if scope.startswith("invalid")]


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
    *[("// a", "Comment"), ("TODO", "Todo"), ("nsg 1", "Declare"), ("1;", "Number"), ("let", "Declare")],
    *[("mist =", ""), ("= mat", "Operator"), ("material", "Material"), ("flat", "Object")],
    *[("color", "Transform"), ("#d33", "Color"), ("fn", "Declare"), ("wave", "Defined"), ("x)", "")],
    *[("0.5 ", "Number"), ("+ sin", "Operator"), ("sin", "Function"), ("1turn", "Number")],
    *[("turn", "Number"), (".5e-1", "Number"), ("still", "Comment"), ("param", "Declare")],
    *[("in 0", "Control"), ("0..1", "Number"), ("..1", "Operator"), ("step", "Control"), ("chain", "Node")],
    *[("star", "Object"), ("30deg", "Number"), ("mist {", "Object"), ('"a', "String"), ('\\"b', "Escape")],
    *[("subtract", "Node"), ("dot", "Call"), ("axis", ""), ("X,", "Constant"), ("u)", "Animated")],
]


def vim(folder: Path, script: str) -> str:
    """What a script in Vim's ex mode writes to `out`, with our files first in its path."""
    head = f"set runtimepath^={VIM}\nfiletype plugin indent on\nsyntax on\nedit scene.nsg\n"
    (folder / "script.vim").write_text(head + script)
    command = ["vim", "-u", "NONE", "-i", "NONE", "-N", "-n", "-es", "-S", "script.vim"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    out = folder / "out"
    assert out.exists(), done.stdout + done.stderr
    return out.read_text("utf-8")


@pytest.mark.skipif(shutil.which("vim") is None, reason="NOT RUN: there is no vim here")
def test_vim_colours_formats_and_indents(tmp_path: Path) -> None:
    (tmp_path / "scene.nsg").write_text(SAMPLE, "utf-8")
    (tmp_path / "other.nsg").write_text("square   {}\n\n\n\nstar{}\n", "utf-8")
    program = tmp_path / "scenelang"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m scenelang "$@"\n')
    program.chmod(0o755)
    script = [f"set runtimepath^={VIM}", "filetype plugin indent on", "syntax on", "edit scene.nsg"]
    script += ["let g:out = [&filetype, b:current_syntax, &commentstring, &shiftwidth]"]
    for text, _ in EXPECTED:
        before = SAMPLE[: SAMPLE.index(text)]
        line, column = before.count("\n") + 1, len(before.rpartition("\n")[2].encode()) + 1
        script.append(f"call add(g:out, synIDattr(synID({line}, {column}, 1), 'name'))")
    script += [
        f"let $PATH = '{tmp_path}:' . $PATH",
        "edit other.nsg",
        "NsgFormat",
        "let g:out += ['--'] + getline(1, '$') + ['--']",
        "call setline(1, ['group {', 'square {', 'scale(', '1,', ');', '}', '}'])",
        "normal gg=G",
        "call writefile(g:out + getline(1, '$'), 'out')",
        "qall!",
    ]
    (tmp_path / "script.vim").write_text("\n".join(script))
    command = ["vim", "-u", "NONE", "-i", "NONE", "-N", "-n", "-es", "-S", "script.vim"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert (tmp_path / "out").exists(), done.stdout + done.stderr
    found, formatted, indented = (tmp_path / "out").read_text("utf-8").split("--\n")
    options, names = found.splitlines()[:4], found.splitlines()[4:]
    assert options == ["nsg", "nsg", "// %s", "2"]
    read = zip([text for text, _ in EXPECTED], names, strict=True)
    assert [(text, name.removeprefix("nsg")) for text, name in read] == EXPECTED
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


def test_extensions_name_files_commands_and_settings_that_exist() -> None:
    package = json.loads((VSCODE / "package.json").read_text("utf-8"))
    given: dict[str, Any] = package["contributes"]
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
    properties = given["configuration"]["properties"]
    settings = {name.removeprefix("scenelang.") for name in properties}
    assert settings == set(re.findall(r'\.get\(\s*"([\w.]+)"', client))
    # It passes the settings of the server.
    hints = {"values": False, "arguments": False}
    changed = {"model": "m", "root": "/r", "debounceMs": 7, "inlayHints": hints}
    default, read = ClientSettings.read({}), ClientSettings.read({"scenelang": changed})
    for name in ClientSettings.__dataclass_fields__:
        assert getattr(read, name) != getattr(default, name)
    for key in (*changed, *hints):
        assert re.search(rf"\b{key}:", client), key
    assert properties["scenelang.debounceMs"]["default"] == default.debounce_ms
    helix = tomllib.loads((EDITORS / "helix/languages.toml").read_text("utf-8"))
    server, language = helix["language-server"]["scenelang"], helix["language"][0]
    assert {server["args"][0], language["formatter"]["args"][0], "lsp"} <= COMMANDS.keys()
    assert '"scenelang", "lsp"' in (EDITORS / "neovim/scenelang.lua").read_text("utf-8")
    assert 'args: ["lsp", "--stdio"]' in (VSCODE / "src/extension.js").read_text("utf-8")
