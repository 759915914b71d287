"""The TextMate grammar: in step with the language, and read by VS Code's engine where that is installed."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from scenelang.editors import highlighting
from scenelang.language import words
from scenelang.language.diagnostics import SourceFile
from scenelang.language.lexer import Report, scan
from scenelang.language.tables import tables
from tests.language.reading import SCENES

ROOT = Path(__file__).parents[2]
FILES = sorted([*(ROOT / "examples").rglob("*.nsg"), *(ROOT / "tests/conformance").rglob("*.nsg"), *SCENES])
EXTENSION = ROOT / "editors/vscode"
CLASSES = {
    "NAME": r"variable|entity\.name|support\.function|constant\.language\.nsg",
    "NUMBER": r"constant\.numeric",
    "STRING": r"string\.quoted",
    "COLOR": r"constant\.other\.color",
}
KEYWORD = r"keyword\.(declaration|control)|storage\.type|constant\.language\.boolean"
SIGN = r"keyword\.operator|punctuation"


def patterns(value: Any) -> list[str]:
    """Every regular expression of a grammar."""
    if isinstance(value, dict):
        own = [text for key, text in value.items() if key in {"match", "begin", "end"}]
        return own + [found for inner in value.values() for found in patterns(inner)]
    return [found for inner in value for found in patterns(inner)] if isinstance(value, list) else []


def test_every_keyword_and_terminal_is_matched() -> None:
    """By an expression of the right class, read with Python's engine."""
    repository = highlighting.textmate()["repository"]

    def matched(group: str, text: str) -> bool:
        return any(re.fullmatch(p["match"], text) for p in repository[group]["patterns"] if "match" in p)

    for text in tables().literals:
        if text[0].isalpha():
            assert matched("keywords", text), text
        else:
            assert matched("signs", text), text
    for text in ("0", "1.", ".5", "1e-3", "30deg", "0.5rad", "0.25turn", "2s", "40ms", "#d33", "#a0B1c2"):
        assert matched("numbers", text), text
    for text in ("square", "_a1", *words.CONSTANTS, *words.ANIMATED):
        assert matched("names", text), text
    assert not matched("numbers", "30degrees")
    assert not matched("numbers", "#ggg")


def test_expressions_compile() -> None:
    found = patterns(highlighting.textmate())
    assert len(found) > 20
    for text in found:
        re.compile(text)


def test_vscode_reads_the_tokens_of_the_language() -> None:
    """Each token of every scene begins where the engine's does and has a scope of its class."""
    if shutil.which("node") is None or not (EXTENSION / "node_modules/vscode-textmate").exists():
        pytest.skip("NOT RUN: vscode-textmate is missing; run `npm ci` in editors/vscode")
    command = ["node", "test/tokenize.cjs", str(ROOT / "grammar/scenelang.tmLanguage.json"), *map(str, FILES)]
    done = subprocess.run(command, cwd=EXTENSION, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for name, found in json.loads(done.stdout).items():
        compare(Path(name), found)


def compare(path: Path, found: list[tuple[int, int, int, str]]) -> None:
    text = path.read_text("utf-8")
    source = SourceFile("", text)
    tokens = scan(source, Report(source))
    scopes = {(line, start): scope for line, start, _, scope in found}
    significant = [scope for _, _, _, scope in found if scope and not scope.startswith("comment")]
    for start, end, kind in zip(tokens.starts[:-1], tokens.ends[:-1], tokens.kinds[:-1], strict=True):
        line, column = source.position(start)
        units = len(source.line(line)[: column - 1].encode("utf-16-le")) // 2
        scope = scopes.get((line - 1, units), "")
        terminal = tables().kinds[kind]
        expected = CLASSES.get(terminal) or (KEYWORD if terminal[0].isalpha() else SIGN)
        if terminal in {"step", "as"}:  # may be names
            expected += "|" + CLASSES["NAME"]
        assert re.match(expected, scope), (path.name, line, column, text[start:end], scope)
    assert len(significant) >= len(tokens.kinds) - 1
    assert not [scope for scope in significant if scope.startswith("invalid")]
