"""What a call calls: its parameters, whoever defined them."""

from __future__ import annotations

from dataclasses import dataclass, field

from scenelang import words
from scenelang.lsp.context import Cursor
from scenelang.lsp.describe import describe_symbol
from scenelang.lsp.sight import sight_at
from scenelang.lsp.workspace import Document, Workspace
from scenelang.resolve.names import Names
from scenelang.resolve.symbols import Symbol
from scenelang.syntax import nodes


@dataclass(frozen=True, slots=True)
class Callee:
    """What is called.

    Args:
        name: its name.
        head: how it is called, for people.
        params: names of its parameters.
        about: a line on each parameter.
        text: what it does.
        positional: whether arguments may go without names.
        variadic: whether the last parameter may be repeated.
        required: the parameters without a default, where they are known.
    """

    name: str
    head: str
    params: tuple[str, ...]
    about: dict[str, str] = field(default_factory=dict)
    text: str = ""
    positional: bool = True
    variadic: bool = False


def find_callee(docs: Workspace, document: Document, cursor: Cursor) -> Callee | None:
    """What the call around the cursor calls; None where there is none or it is unknown."""
    call = cursor.call
    if call is None:
        return None
    found = find_symbol(docs, document, sight_at(document.parsed, call.start), call.name, call.start)
    if found is not None:
        return callee_of(found[1])
    return callee_of_word(call.name, cursor.block.kind == "material")


def find_symbol(
    docs: Workspace, document: Document, names: Names, name: str, offset: int
) -> tuple[Document, Symbol] | None:
    """The fn or module that a plain or dotted name stands for at an offset; ``names`` are in sight there."""
    alias, _, rest = name.partition(".")
    symbol = names.scope_at(offset).find(alias)
    if symbol is None:
        return None
    if rest and symbol.kind == "import" and isinstance(symbol.node, nodes.Import):
        library = docs.imported(document, symbol.node.path.value)
        member = library.names.top.symbols.get(rest) if library is not None else None
        if library is None or member is None or not member.is_exported:
            return None
        document, symbol = library, member
    return (document, symbol) if symbol.kind in ("fn", "module") else None


def callee_of(symbol: Symbol) -> Callee:
    """A fn or module as a callee."""
    head, text = describe_symbol(symbol)
    return Callee(symbol.name, head, tuple(p.name for p in symbol.params), {}, text)


def callee_of_word(name: str, in_material: bool) -> Callee | None:
    """A word of the language as a callee."""
    word = words.word_for_call(name, in_material)
    if word is None:
        return None
    about = dict(zip(word.params, word.about, strict=False))
    return Callee(name, word.head, word.params, about, word.text, name != "shear", word.variadic)
