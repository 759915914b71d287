"""How the classes of the syntax tree are prepared."""

from __future__ import annotations

from scenelang.language import tree
from scenelang.language.statements import EXPRESSIONS, STATEMENTS


def test_each_class_of_the_tree_is_in_its_table() -> None:
    assert list(EXPRESSIONS) == tree.Expr.__subclasses__()
    assert list(STATEMENTS) == tree.Stmt.__subclasses__()
