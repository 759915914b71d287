"""The documentation's code does what its pages say: run in order, page by page, in a folder of its own.

A block of scene text or JSON with a ``title`` is written to a file of that name. Each line of ``sh`` is run
by the real command line, in this process; Python blocks of a page share their names. A ``text`` block right
after either is what it prints; ``…`` in it stands for anything. A command without one succeeds.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from scenelang.cli.main import main

ROOT = Path(__file__).parents[1]
PAGES = [
    "index",
    "tutorial",
    "cookbook",
    "embedding",
    "language",
    "formatting",
    "data",
    "drawing",
    "sweep",
    "viewer",
]
MARKED = {"elements": pytest.mark.more, "animation": pytest.mark.slow}  # which learn, and draw films
_BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```\n(?:\n```text\n(.*?)^```$)?", re.MULTILINE | re.DOTALL)
VENV = ".venv/bin/"
_LONG = {"watch", "train", "lab", "lsp", "play"}  # commands that do not end, or not soon
_OTHERS = {"python3", "python", "pip", "git", "mkdocs"}  # parsed by test_docs.py, not run here


def run(arguments: list[str]) -> tuple[int, str]:
    """A command's exit code and output."""
    data, code = io.BytesIO(), 0
    printed = io.TextIOWrapper(data, "utf-8", write_through=True)
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        try:
            main(arguments)
        except SystemExit as end:
            code = int(end.code or 0)
    return code, data.getvalue().decode("utf-8")


def like(expected: str) -> re.Pattern[str]:
    return re.compile(".*".join(map(re.escape, expected.strip().split("…"))), re.DOTALL)


def run_shell(text: str, expected: str | None, place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    printed = ""
    for line in text.splitlines():
        command, _, source = line.split(" #")[0].partition(" < ")
        words = shlex.split(command.removeprefix(VENV))
        if not words or words[0] in _OTHERS or words[1] in _LONG:
            continue
        assert words[0] == "scenelang", f"{place}: {line}"
        if source:
            monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(Path(source.strip()).read_bytes())))
        code, said = run(words[1:])
        printed += said
        assert code == 0 or (expected is not None and code == 1), f"{place}: {line}\n{said}"
    if expected is not None:
        assert like(expected).fullmatch(printed.strip()), f"{place} prints\n{printed}"


@pytest.mark.parametrize("page", [*PAGES, *(pytest.param(page, marks=mark) for page, mark in MARKED.items())])
def test_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / f"docs/{page}.md").read_text("utf-8")
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "__main__"}
    for block in _BLOCK.finditer(text):
        language, head, code, expected = block.groups()
        place = f"{page}.md:{text[: block.start()].count(chr(10)) + 1}"
        title = re.search(r'title="([^"]+)"', head)
        if title is not None:
            Path(title[1]).parent.mkdir(parents=True, exist_ok=True)
            Path(title[1]).write_text(code, "utf-8")
        if language == "sh":
            run_shell(code, expected, place, monkeypatch)
        if language == "python":
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(code, place, "exec"), names)
            if expected is not None:
                assert like(expected).fullmatch(printed.getvalue().strip()), f"{place}: {printed.getvalue()}"


def test_pages_have_something_to_run() -> None:
    """The pattern finds the blocks that a simple count finds, and outputs among them."""
    for page in (*PAGES, *MARKED):
        text = (ROOT / f"docs/{page}.md").read_text("utf-8")
        counted = len(re.findall(r"^```\w", text, re.MULTILINE))
        found = list(_BLOCK.finditer(text))
        assert len(found) + sum(block[4] is not None for block in found) == counted, page
    assert _BLOCK.search("```sh\na\n```\n\n```text\nb\n```\n")[4] == "b\n"  # type: ignore[index]
