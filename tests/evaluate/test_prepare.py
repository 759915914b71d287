"""How the classes of the syntax tree are prepared."""

from __future__ import annotations

from typing import get_args

from scenelang.evaluate.prepare import EXPRESSIONS, STATEMENTS
from scenelang.syntax import nodes


def test_each_class_of_the_tree_is_in_its_table() -> None:
    assert list(EXPRESSIONS) == list(get_args(nodes.Expr))
    assert list(STATEMENTS) == list(get_args(nodes.Stmt))
