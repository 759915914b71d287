"""How the classes of the syntax tree are prepared."""

from __future__ import annotations

from scenelang.evaluate.prepare import EXPRESSIONS, STATEMENTS
from scenelang.syntax import nodes


def test_each_class_of_the_tree_is_in_its_table() -> None:
    assert list(EXPRESSIONS) == nodes.Expr.__subclasses__()
    assert list(STATEMENTS) == nodes.Stmt.__subclasses__()
