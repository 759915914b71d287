"""Names that a file defines and never uses; `scenelang check` and editors ask, rendering does not.

The walk follows the evaluator's rules of sight: functions and modules are visible in their whole block,
everything else from its line on, and an inner block may bind a name anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from scenelang.diagnostics.diagnostic import Diagnostics, Edit, Fix
from scenelang.diagnostics.fixes import removal
from scenelang.syntax import nodes

_DRAWING: Final = (nodes.Call, nodes.Node, nodes.For, nodes.If, nodes.Combined)
_KINDS: Final = {nodes.Let: "let", nodes.Param: "param", nodes.Fn: "fn", nodes.Module: "module"}


@dataclass(slots=True, eq=False)
class _Defined:
    """A name and whether something outside its own definition uses it."""

    name: nodes.Name
    stmt: nodes.Stmt | None = None
    used: bool = False


@dataclass(slots=True)
class _Scope:
    parent: _Scope | None = None
    names: dict[str, _Defined] = field(default_factory=dict)

    def find(self, text: str) -> _Defined | None:
        scope: _Scope | None = self
        while scope is not None:
            if text in scope.names:
                return scope.names[text]
            scope = scope.parent
        return None


def find_unused(file: nodes.File, diagnostics: Diagnostics) -> None:
    """Warn of definitions and imports that nothing uses.

    Names that begin with ``_`` are left out, and so is what a file without objects defines at top level: it
    is a library.

    Args:
        file: a tree without syntax errors.
        diagnostics: receives W0201.
    """
    walk = _Walk()
    top = _Scope()
    walk.block(file.statements, top)
    library = not any(isinstance(stmt, _DRAWING) for stmt in file.statements)
    for found in walk.defined:
        if found.used or found.stmt is None or found.name.text.startswith("_"):
            continue
        if isinstance(found.stmt, nodes.Import):
            fix = removal(found.name.span.source, found.stmt.span.start, found.stmt.span.end)
            message = f"import `{found.name.text}` is never used"
            diagnostics.add("W0201", message, found.name.span, help="delete it", fix=fix)
        elif not (library and top.names.get(found.name.text) is found):
            _warn(found, top, diagnostics)


def _warn(found: _Defined, top: _Scope, diagnostics: Diagnostics) -> None:
    name, kind = found.name, _KINDS[type(found.stmt)]
    if kind == "param":
        help = "it changes nothing: use it or delete it"
        diagnostics.add("W0201", f"param `{name.text}` is never used", name.span, help=help)
        return
    fix = Fix(f"rename to `_{name.text}`", (Edit(name.span, f"_{name.text}"),))
    diagnostics.add(
        "W0201",
        f"{kind} `{name.text}` is never used",
        name.span,
        help="delete it, or let its name begin with `_`",
        fix=None if f"_{name.text}" in name.span.source.text else fix,
    )


class _Walk:
    """Reads a file once; `defined` holds what it defines, in the order of the text."""

    def __init__(self) -> None:
        self.defined: list[_Defined] = []
        self.inside: list[_Defined] = []

    def use(self, text: str, scope: _Scope) -> None:
        found = scope.find(text.partition(".")[0])
        if found is not None and found not in self.inside:
            found.used = True

    def define(self, name: nodes.Name, scope: _Scope, stmt: nodes.Stmt | None = None) -> _Defined:
        """Bind a name; what has no statement is a loop variable or an argument, of which nothing is said."""
        found = _Defined(name, stmt)
        scope.names[name.text] = found
        self.defined.append(found)
        return found

    def block(self, statements: Sequence[nodes.Stmt], scope: _Scope) -> None:
        """Statements in a scope of their own, as `prepare_block` goes through them."""
        bodies = [
            (stmt, self.define(stmt.name, scope, stmt))
            for stmt in statements
            if isinstance(stmt, nodes.Fn | nodes.Module)
        ]
        for stmt in statements:
            self.statement(stmt, scope)
        for stmt, own in bodies:
            self.inside.append(own)
            self.body(stmt, scope)
            self.inside.pop()

    def body(self, stmt: nodes.Fn | nodes.Module, scope: _Scope) -> None:
        """Parameters and body of a function or module."""
        inner = _Scope(scope)
        for param in stmt.params:
            if param.default is not None:
                self.expression(param.default, inner)
            self.define(param.name, inner)
        if isinstance(stmt, nodes.Fn):
            self.expression(stmt.body, inner)
        else:
            self.block(stmt.body.statements, _Scope(inner))

    def statement(self, stmt: nodes.Stmt, scope: _Scope) -> None:
        match stmt:
            case nodes.Let():
                self.expression(stmt.value, scope)
                self.define(stmt.name, scope, stmt)
            case nodes.Param():
                self.expressions((stmt.default, stmt.range), scope)
                self.define(stmt.name, scope, stmt)
            case nodes.Import():
                self.define(stmt.alias, scope, stmt)
            case nodes.Model():
                self.expression(stmt.name, scope)
            case nodes.For():
                self.expression(stmt.iterable, scope)
                loop = _Scope(scope)
                self.define(stmt.variable, loop)
                self.block(stmt.body.statements, _Scope(loop))
            case nodes.If():
                self.choice(stmt, scope)
            case nodes.Call():
                self.use(stmt.name.text, scope)
                self.expressions((arg.value for arg in stmt.args or ()), scope)
                if stmt.body is not None:
                    self.block(stmt.body.statements, _Scope(scope))
            case nodes.Node():
                self.block(stmt.body.statements, _Scope(scope))
            case nodes.Combined():
                self.statement(stmt.child, scope)
            case nodes.MaterialUse():
                self.use(stmt.name.text, scope)
                if stmt.body is not None:
                    self.block(stmt.body.statements, _Scope(scope))
            case _:
                pass

    def choice(self, stmt: nodes.If, scope: _Scope) -> None:
        """An `if` with all its arms, which may be many."""
        at: nodes.If | nodes.Block | None = stmt
        while isinstance(at, nodes.If):
            self.expression(at.condition, scope)
            self.block(at.then.statements, _Scope(scope))
            at = at.otherwise
        if at is not None:
            self.block(at.statements, _Scope(scope))

    def expressions(self, exprs: Iterable[nodes.Expr | None], scope: _Scope) -> None:
        for expr in exprs:
            if expr is not None:
                self.expression(expr, scope)

    def expression(self, expr: nodes.Expr, scope: _Scope) -> None:
        match expr:
            case nodes.NameRef():
                self.use(expr.name.text, scope)
            case nodes.Vector():
                self.expressions(expr.items, scope)
            case nodes.Range():
                self.expressions((expr.start, expr.stop, expr.step), scope)
            case nodes.Unary():
                self.expression(expr.operand, scope)
            case nodes.Binary():
                self.expressions((expr.left, expr.right), scope)
            case nodes.Conditional():
                self.expressions((expr.condition, expr.then, expr.otherwise), scope)
            case nodes.CallExpr():
                self.use(expr.name.text, scope)
                self.expressions((arg.value for arg in expr.args), scope)
            case nodes.Member():
                self.expression(expr.value, scope)
            case nodes.Index():
                self.expressions((expr.value, expr.index), scope)
            case nodes.MaterialExpr():
                self.use(expr.name.text, scope)
                if expr.body is not None:
                    self.block(expr.body.statements, _Scope(scope))
            case _:
                pass
