"""What every name of a file stands for: definitions, their uses, and what can be seen from where.

The walk follows the evaluator's rules of sight: functions and modules are known in their whole block,
everything else from its line on, and an inner block may bind a name anew. One file is looked at by itself;
what an imported file brings is asked of the `Library` when somebody wants to know.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator

from scenelang.diagnostics.span import SourceFile, Span
from scenelang.resolve.symbols import Kind, Role, Scope, Symbol, Use
from scenelang.syntax import nodes
from scenelang.words import ANIMATED, CONSTANTS, FUNCTIONS, OPERATIONS, SETTINGS, TRANSFORMS


class Names:
    """All names of a file.

    Args:
        file: its tree.
    """

    def __init__(self, file: nodes.File) -> None:
        self.source: SourceFile = file.span.source
        self.top = Scope(0, file.span.end + 1)
        self.uses: list[Use] = []
        self.symbols: list[Symbol] = []
        self.scopes: list[Scope] = [self.top]
        self._unresolved: list[tuple[Use, Scope]] = []
        self._block(file.statements, self.top, "file")
        for use, scope in self._unresolved:
            use.symbol = scope.find(use.text)  # used before its line: still the one that is meant
        self.uses.sort(key=lambda use: (use.start, use.end))
        self._starts = [use.start for use in self.uses]

    def at(self, offset: int) -> Use | None:
        """The name at an offset, or right before it."""
        index = bisect_right(self._starts, offset) - 1
        if index >= 0 and offset <= self.uses[index].end:
            use = self.uses[index]
            if offset == use.end and use.end - use.start > 0 and index + 1 < len(self.uses):
                after = self.uses[index + 1]
                return after if after.start == offset else use
            return use
        return None

    def scope_at(self, offset: int) -> Scope:
        """The innermost scope at an offset."""
        best = self.top
        for scope in self.scopes:
            if scope.start <= offset < scope.end and scope.start >= best.start and scope.end <= best.end:
                best = scope
        return best

    def visible(self, offset: int) -> Iterator[Symbol]:
        """The definitions in sight of an offset, inner ones first, hidden ones left out."""
        seen: set[str] = set()
        scope: Scope | None = self.scope_at(offset)
        while scope is not None:
            for name, symbol in scope.symbols.items():
                if name not in seen and symbol.since <= offset:
                    seen.add(name)
                    yield symbol
            scope = scope.parent

    def exported(self) -> list[Symbol]:
        """What files that import this one see."""
        return [symbol for symbol in self.top.symbols.values() if symbol.is_exported]

    # ------------------------------------------------------------ definitions

    def _define(self, symbol: Symbol) -> Symbol:
        self.symbols.append(symbol)
        symbol.scope.symbols.setdefault(symbol.name, symbol)
        span = symbol.span
        self.uses.append(Use(span.start, span.end, symbol.name, "name", symbol, defines=True))
        return symbol

    def _scope(self, start: int, end: int, parent: Scope) -> Scope:
        scope = Scope(start, end, parent)
        self.scopes.append(scope)
        return scope

    def _block(self, statements: Iterable[nodes.Stmt], scope: Scope, kind: str) -> None:
        bodies = []
        for stmt in statements:
            if isinstance(stmt, nodes.Fn | nodes.Module):
                which: Kind = "fn" if isinstance(stmt, nodes.Fn) else "module"
                symbol = Symbol(stmt.name.text, which, stmt.name.span, stmt, scope, scope.start)
                bodies.append((stmt, self._define(symbol)))
        for stmt in statements:
            self._statement(stmt, scope, kind)
        for definition, symbol in bodies:
            self._body(definition, symbol, scope)

    def _body(self, stmt: nodes.Fn | nodes.Module, symbol: Symbol, scope: Scope) -> None:
        around = self._scope(stmt.name.span.end, stmt.span.end, scope)
        for param in stmt.params:
            if param.default is not None:
                self._expr(param.default, around)
            formal = Symbol(
                param.name.text, "argument", param.name.span, param, around, param.span.end, symbol
            )
            symbol.params.append(self._define(formal))
        if isinstance(stmt, nodes.Fn):
            self._expr(stmt.body, around)
        else:
            inside = self._scope(stmt.body.span.start, stmt.body.span.end, around)
            self._block(stmt.body.statements, inside, "group")

    # ------------------------------------------------------------ statements

    def _inner(self, block: nodes.Block, scope: Scope, kind: str) -> None:
        inside = self._scope(block.span.start, block.span.end, scope)
        self._block(block.statements, inside, kind)

    def _statement(self, stmt: nodes.Stmt, scope: Scope, kind: str) -> None:
        match stmt:
            case nodes.Model():
                if isinstance(stmt.name, nodes.String):
                    self._add(stmt.name.span, stmt.name.value, "model")
            case nodes.Let():
                self._expr(stmt.value, scope)
                self._define(Symbol(stmt.name.text, "let", stmt.name.span, stmt, scope, stmt.span.end))
            case nodes.Param():
                self._expr(stmt.default, scope)
                if stmt.range is not None:
                    self._expr(stmt.range, scope)
                self._define(Symbol(stmt.name.text, "param", stmt.name.span, stmt, scope, stmt.span.end))
            case nodes.Import():
                self._add(stmt.path.span, stmt.path.value, "path")
                self._define(Symbol(stmt.alias.text, "import", stmt.alias.span, stmt, scope, stmt.span.end))
            case nodes.For():
                self._expr(stmt.iterable, scope)
                loop = self._scope(stmt.body.span.start, stmt.span.end, scope)
                name = stmt.variable
                self._define(Symbol(name.text, "loop", name.span, stmt, loop, stmt.body.span.start))
                self._inner(stmt.body, loop, kind)
            case nodes.If():
                at: nodes.If | nodes.Block | None = stmt
                while isinstance(at, nodes.If):  # there may be very many arms
                    self._expr(at.condition, scope)
                    self._inner(at.then, scope, kind)
                    at = at.otherwise
                if at is not None:
                    self._inner(at, scope, kind)
            case nodes.Node():
                self._inner(stmt.body, scope, "chain" if stmt.kind == "chain" else "group")
            case nodes.Combined():
                self._statement(stmt.child, scope, kind)
            case nodes.MaterialUse():
                self._add(stmt.name.span, stmt.name.text, "material")
                if stmt.body is not None:
                    self._inner(stmt.body, scope, "material")
            case nodes.Call():
                self._call(stmt, scope, kind)
            case _:
                pass

    def _call(self, stmt: nodes.Call, scope: Scope, kind: str) -> None:
        name = stmt.name.text
        if name in SETTINGS:
            head: Use | None = self._add(stmt.name.span, name, "setting")
        elif kind == "material" and name in OPERATIONS:
            head = self._add(stmt.name.span, name, "operation")
        elif name in TRANSFORMS or name in OPERATIONS:
            head = self._add(stmt.name.span, name, "transform" if name in TRANSFORMS else "operation")
        else:
            head = self._reference(stmt.name, scope, "geometry")
        self._arguments(stmt.args or (), scope, head)
        if stmt.body is not None:
            value = head is not None and head.symbol is not None and head.symbol.kind in ("let", "argument")
            self._inner(stmt.body, scope, "material" if value else "object")

    # ------------------------------------------------------------ expressions

    def _add(self, span: Span, text: str, role: Role, symbol: Symbol | None = None) -> Use:
        use = Use(span.start, span.end, text, role, symbol)
        self.uses.append(use)
        return use

    def _reference(self, name: nodes.Name, scope: Scope, otherwise: Role) -> Use | None:
        """The use of a plain or dotted name; of a dotted one that of its last part."""
        alias, _, rest = name.text.partition(".")
        symbol = scope.find(alias)
        if not rest:
            use = self._add(name.span, alias, "name" if symbol else otherwise, symbol)
            if symbol is None and otherwise in ("geometry", "name"):
                self._unresolved.append((use, scope))
            return use
        source, span = name.span.source, name.span
        self._add(Span(source, span.start, span.start + len(alias)), alias, "name", symbol)
        tail = Span(source, span.end - len(rest), span.end)
        if symbol is not None and symbol.kind == "import":
            return self._add(tail, rest, "member", symbol)
        return None

    def _arguments(self, args: Iterable[nodes.Argument], scope: Scope, head: Use | None) -> None:
        for arg in args:
            if arg.name is not None:
                use = self._add(arg.name.span, arg.name.text, "argument")
                use.callee = head
            self._expr(arg.value, scope)

    def _expr(self, expr: nodes.Expr, scope: Scope) -> None:
        match expr:
            case nodes.NameRef():
                self._value(expr.name, scope)
            case nodes.CallExpr():
                name = expr.name
                plain = name.text in FUNCTIONS and scope.find(name.text) is None
                head = self._add(name.span, name.text, "function") if plain else None
                head = head or self._reference(name, scope, "name")
                self._arguments(expr.args, scope, head)
            case nodes.Member():
                self._member(expr, scope)
            case nodes.MaterialExpr():
                self._add(expr.name.span, expr.name.text, "material")
                if expr.body is not None:
                    self._inner(expr.body, scope, "material")
            case nodes.Vector():
                for item in expr.items:
                    self._expr(item, scope)
            case nodes.Binary():
                self._expr(expr.left, scope)
                self._expr(expr.right, scope)
            case nodes.Unary():
                self._expr(expr.operand, scope)
            case nodes.Range():
                for part in (expr.start, expr.stop, expr.step):
                    if part is not None:
                        self._expr(part, scope)
            case nodes.Conditional():
                for part in (expr.condition, expr.then, expr.otherwise):
                    self._expr(part, scope)
            case nodes.Index():
                self._expr(expr.value, scope)
                self._expr(expr.index, scope)
            case _:
                pass

    def _value(self, name: nodes.Name, scope: Scope) -> None:
        text = name.text
        if scope.find(text) is None and "." not in text:
            if text in CONSTANTS:
                self._add(name.span, text, "constant")
                return
            if text in ANIMATED:
                self._add(name.span, text, "animated")
                return
        self._reference(name, scope, "name")

    def _member(self, expr: nodes.Member, scope: Scope) -> None:
        self._expr(expr.value, scope)
        role: Role = "property"
        symbol = None
        if isinstance(expr.value, nodes.NameRef):
            symbol = scope.find(expr.value.name.text)
            if symbol is not None and symbol.kind == "import":
                role = "member"
            else:
                symbol = None
        self._add(expr.name.span, expr.name.text, role, symbol)
