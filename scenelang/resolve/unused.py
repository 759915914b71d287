"""Names that a file defines and never uses; `scenelang check` and editors ask, rendering does not."""

from __future__ import annotations

from typing import Final

from scenelang.diagnostics.diagnostic import Diagnostics, Edit, Fix
from scenelang.diagnostics.fixes import removal
from scenelang.resolve.names import Names, Symbol, Use
from scenelang.syntax import nodes

_DRAWING: Final = (nodes.Call, nodes.Node, nodes.For, nodes.If, nodes.Combined)
_KINDS: Final = ("let", "param", "fn", "module", "import")


def find_unused(file: nodes.File, diagnostics: Diagnostics) -> None:
    """Warn of definitions and imports that nothing uses.

    Names that begin with ``_`` are left out, and so is what a file without objects defines at top level: it
    is a library. The tree is one without syntax errors.
    """
    names = Names(file)
    used = {use.symbol for use in names.uses if not _is_inside_its_definition(use)}
    library = not any(isinstance(stmt, _DRAWING) for stmt in file.statements)
    for symbol in names.symbols:
        if symbol in used or symbol.kind not in _KINDS or symbol.name.startswith("_"):
            continue
        if symbol.kind == "import":
            fix = removal(symbol.span.source, symbol.node.span.start, symbol.node.span.end)
            message = f"import `{symbol.name}` is never used"
            diagnostics.add("W0201", message, symbol.span, help="delete it", fix=fix)
        elif not (library and symbol.scope is names.top):
            _warn(symbol, diagnostics)


def _is_inside_its_definition(use: Use) -> bool:
    """Whether a use is the definition itself, or a call of a function or module in its own body."""
    symbol = use.symbol
    if symbol is None or use.defines or symbol.kind not in ("fn", "module"):
        return use.defines
    return symbol.node.span.start <= use.start < symbol.node.span.end


def _warn(symbol: Symbol, diagnostics: Diagnostics) -> None:
    name, span = symbol.name, symbol.span
    if symbol.kind == "param":
        help = "it changes nothing: use it or delete it"
        diagnostics.add("W0201", f"param `{name}` is never used", span, help=help)
        return
    fix = Fix(f"rename to `_{name}`", (Edit(span, f"_{name}"),))
    diagnostics.add(
        "W0201",
        f"{symbol.kind} `{name}` is never used",
        span,
        help="delete it, or let its name begin with `_`",
        fix=None if f"_{name}" in span.source.text else fix,
    )
