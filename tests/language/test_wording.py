"""Messages quote with backticks alone, wherever they are written."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "scenelang"
QUOTED = re.compile(r"(?<![\w\"])'[^'\n]*'(?!\w)")
SHELL = re.compile(r"pip install '[^']*'")
PYTHONS = "module 'scenelang' has no attribute"  # the words of Python itself


def texts(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """The texts of a module that are no docstrings, with the line of each; holes are left out."""
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield (
                node.lineno,
                "".join(str(p.value) if isinstance(p, ast.Constant) else "x" for p in node.values),
            )
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs | parts:
            yield node.lineno, node.value


def quoted(text: str) -> bool:
    """Whether a text reads like a message, and quotes something in single quotes."""
    pattern = "|" in text or "(?" in text or "\\" in text
    return (
        (" " in text.strip() or text == "'x'")
        and not pattern
        and PYTHONS not in text
        and "-src '" not in text  # a page's content policy
        and bool(QUOTED.search(SHELL.sub("", text)))
    )


def test_messages_quote_with_backticks() -> None:
    found = [
        f"{path.relative_to(PACKAGE)}:{line}: {text}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for line, text in texts(ast.parse(path.read_text("utf-8")))
        if quoted(text)
    ]
    assert found == []
