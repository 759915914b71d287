"""Any text to a tree, and its diagnostics in every format."""

from __future__ import annotations

from functools import cache

from lark import Lark
from lark.exceptions import LarkError

from fuzz import text
from fuzz.oracles import check_diagnostics, check_tree, same
from fuzz.target import Target, hold, sampled
from scenelang.assets.records import deep_stack
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.lexer import MAX_MISTAKES
from scenelang.language.parser import parse
from scenelang.language.tables import grammar_path

MOST_FOR_LARK = 400
"""Characters of a text that Lark is asked about, too: it is slow."""

BEYOND = {"E0119", "E0125", "E0128"}
"""Mistakes that the grammar does not know: unknown escapes, numbers without a float64, calls of no name."""


def check(data: bytes) -> None:
    """Parse once and once more; ask Lark whether the text is one of the language."""
    source = SourceFile("fuzz.nsg", text.decode(data))
    found = Diagnostics()
    tree = parse(source, found)
    bad = check_tree(tree, source)
    check_diagnostics(list(found), [source])
    hold(len(found) <= MAX_MISTAKES + 1, "a bounded number of mistakes", len(found))
    hold(all(d.span is not None for d in found), "mistakes of syntax have places")
    hold(not bad or len(found), "no bad node without a diagnostic")
    if sampled(data, 8):
        again = Diagnostics()
        with deep_stack():  # trees are as deep as the language allows, deeper than Python compares by itself
            equal = parse(SourceFile("fuzz.nsg", source.text), again) == tree
        hold(equal, "the same text gives the same tree")
        hold(same(list(found), list(again)), "the same text gives the same diagnostics")
    codes = {d.code for d in found}
    if len(source.text) <= MOST_FOR_LARK and "E0120" not in codes:
        hold(_lark_reads(source.text) == (not codes - BEYOND), "Lark reads what the parser reads", found)


@cache
def _lark() -> Lark:
    grammar = grammar_path().read_text(encoding="utf-8")
    return Lark(grammar, parser="lalr", lexer="basic", maybe_placeholders=False)


def _lark_reads(scene: str) -> bool:
    """Whether Lark, with the same grammar and its own lexer and parser, reads a text."""
    try:
        _lark().parse(scene.replace("\ufeff", " "))
    except LarkError:
        return False
    return True


TARGET = Target(
    name="parse",
    summary="any text gives a tree whose spans nest, diagnostics inside the text that every format renders, "
    "and mistakes exactly where Lark with the same grammar refuses",
    check=check,
    seeds=text.seeds,
    mutate=text.mutate,
    dictionary=text.dictionary,
    most_bytes=1200,
)
