"""Definitions of a file and their uses, found without running anything by the evaluator's rules of sight."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import field
from typing import Any, Final, Literal

from scenelang.assets.records import Record
from scenelang.language import scopes, tree
from scenelang.language.diagnostics import Diagnostics, Edit, Fix, SourceFile, Span, removal
from scenelang.language.words import ANIMATED, CONSTANTS, FUNCTIONS, LANGUAGE, OPERATIONS, TRANSFORMS

Kind = Literal["let", "param", "fn", "module", "import", "argument", "loop"]
Role = Literal[
    "name",  # of a definition in sight, or of nothing known
    "member",  # of an imported file: `lib.name`
    "argument",  # the name of an argument in a call
    "function",
    "constant",
    "animated",
    "geometry",
    "transform",
    "operation",
    "setting",
    "material",
    "property",  # `v.x`
    "model",
    "path",
]

_OWN: Final[dict[str, Role]] = {**dict.fromkeys(CONSTANTS, "constant"), **dict.fromkeys(ANIMATED, "animated")}
"""Roles of the language's words in an expression."""


class Symbol(Record, frozen=False):
    """A definition."""

    name: str
    kind: Kind
    span: Span
    node: tree.Stmt | tree.Parameter | tree.ForItem
    scope: TextScope
    since: int  # the offset from which on it is in sight
    owner: Symbol | None = None  # the fn or module that it is a parameter of
    params: list[Symbol] = field(default_factory=list)

    @property
    def is_exported(self) -> bool:
        """Whether files that import this one see it."""
        return self.scope.parent is None and self.kind in ("let", "param", "fn", "module")


class TextScope(Record, frozen=False):
    """A block, a function or a loop: its names, where it reaches, and what is around it."""

    start: int
    end: int
    parent: TextScope | None = None
    names: dict[str, Symbol] = field(default_factory=dict)

    outwards, find = scopes.outwards, scopes.find


class Use(Record, frozen=False):
    """A place where a name stands."""

    start: int
    end: int
    text: str
    role: Role
    symbol: Symbol | None = None  # its definition in this file, or that of the import a member belongs to
    callee: Use | None = None  # for an argument, the use of what is called
    defines: bool = False  # whether this is the definition itself


class Names:
    """All names of a file."""

    def __init__(self, file: tree.File, at: int | None = None) -> None:
        """Find all names, or those in sight of an offset: of statements elsewhere what they define."""
        self._at = at
        self.source: SourceFile = file.span.source
        self.top = TextScope(0, file.span.end + 1)
        self.uses: list[Use] = []
        self.symbols: list[Symbol] = []
        self.scopes: list[TextScope] = [self.top]
        self._unresolved: list[tuple[Use, TextScope]] = []
        self._statements(file.statements, self.top, "file")
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

    def scope_at(self, offset: int) -> TextScope:
        """The innermost scope at an offset."""
        best = self.top
        for scope in self.scopes:
            if scope.start <= offset < scope.end and scope.start >= best.start and scope.end <= best.end:
                best = scope
        return best

    def visible(self, offset: int) -> Iterator[Symbol]:
        """The definitions in sight of an offset, inner ones first, hidden ones left out."""
        seen: set[str] = set()
        for scope in self.scope_at(offset).outwards():
            for name, symbol in scope.names.items():
                if name not in seen and symbol.since <= offset:
                    seen.add(name)
                    yield symbol

    def exported(self) -> list[Symbol]:
        """Definitions that files that import this one see."""
        return [symbol for symbol in self.top.names.values() if symbol.is_exported]

    def _define(
        self,
        name: tree.Name,
        kind: Kind,
        node: tree.Stmt | tree.Parameter | tree.ForItem,
        scope: TextScope,
        since: int,
        owner: Symbol | None = None,
    ) -> Symbol:
        symbol = Symbol(name.text, kind, name.span, node, scope, since, owner)
        self.symbols.append(symbol)
        scope.names.setdefault(symbol.name, symbol)
        self._add(name.span, name.text, "name", symbol).defines = True
        return symbol

    def _scope(self, start: int, end: int, parent: TextScope) -> TextScope:
        scope = TextScope(start, end, parent)
        self.scopes.append(scope)
        return scope

    def _statements(self, statements: Iterable[tree.Stmt], scope: TextScope, kind: str) -> None:
        bodies = []
        for stmt in statements:
            if isinstance(stmt, tree.Fn | tree.Module):
                which: Kind = "fn" if isinstance(stmt, tree.Fn) else "module"
                bodies.append((stmt, self._define(stmt.name, which, stmt, scope, scope.start)))
        for stmt in statements:
            near = isinstance(stmt, tree.Let | tree.Param | tree.Import) or self._is_near(stmt, scope)
            if near and not isinstance(stmt, tree.Fn | tree.Module):
                self._walk(stmt, scope, kind)
        for definition, symbol in bodies:
            around = self._scope(definition.name.span.end, definition.span.end, scope)
            for param in definition.params:
                if param.default is not None and self._is_near(definition, scope):
                    self._walk(param.default, around, "group")
                formal = self._define(param.name, "argument", param, around, param.span.end, symbol)
                symbol.params.append(formal)
            if self._is_near(definition, scope):
                self._walk(definition.body, around, "group")

    def _is_near(self, stmt: tree.Stmt, scope: TextScope) -> bool:
        """Test whether what is inside a statement is looked at."""
        at, span = self._at, stmt.span
        return at is None or scope is not self.top or span.start <= at <= span.end

    def _walk(self, node: Any, scope: TextScope, kind: str) -> None:
        """Note the names in a statement or an expression, in a block of some kind."""
        match node:
            case tree.Block():
                inside = self._scope(node.span.start, node.span.end, scope)
                self._statements(node.statements, inside, kind)
            case tree.ModelStatement():
                if isinstance(node.name, tree.String):
                    self._add(node.name.span, node.name.value, "model")
            case tree.Let() | tree.Param():
                if self._is_near(node, scope):
                    self._children(node, scope, kind)
                which: Kind = "let" if isinstance(node, tree.Let) else "param"
                self._define(node.name, which, node, scope, node.span.end)
            case tree.Import():
                self._add(node.path.span, node.path.value, "path")
                self._define(node.alias, "import", node, scope, node.span.end)
            case tree.For() | tree.ForItem():
                self._walk(node.iterable, scope, kind)
                # An item may be about to be written, or to go on.
                more = isinstance(node, tree.ForItem) + isinstance(node.body, tree.BadExpr)
                loop = self._scope(node.body.span.start, node.span.end + more, scope)
                self._define(node.variable, "loop", node, loop, node.body.span.start)
                self._walk(node.body, loop, kind)
            case tree.If():
                at: tree.If | tree.Block | None = node
                while isinstance(at, tree.If):  # there may be very many arms
                    self._walk(at.condition, scope, kind)
                    self._walk(at.then, scope, kind)
                    at = at.otherwise
                if at is not None:
                    self._walk(at, scope, kind)
            case tree.Node() | tree.Combined():
                word = node.keyword
                self._arguments(node.args or (), scope, Use(word.start, word.end, word.text, "setting"))
                if isinstance(node, tree.Node):
                    self._walk(node.body, scope, "group")
                else:
                    self._walk(node.child, scope, kind)
            case tree.MaterialUse() | tree.MaterialExpr():
                for name in [node.name] if node.shading is None else [node.shading, node.name]:
                    if "." in name.text:
                        self._reference(name, scope, "material", "material")
                    else:
                        self._add(name.span, name.text, "material")
                if node.body is not None:
                    self._walk(node.body, scope, "material")
            case tree.Call():
                self._call(node, scope, kind)
            case tree.NameRef():
                text = node.name.text
                if (own := _OWN.get(text)) is None or scope.find(text) is not None:
                    self._reference(node.name, scope, "name")
                else:
                    self._add(node.name.span, text, own)
            case tree.CallExpr():
                name = node.name
                plain = name.text in FUNCTIONS and scope.find(name.text) is None
                head = self._add(name.span, name.text, "function") if plain else None
                self._arguments(node.args, scope, head or self._reference(name, scope, "name"))
            case tree.Member():
                self._walk(node.value, scope, kind)
                symbol = scope.find(node.value.name.text) if isinstance(node.value, tree.NameRef) else None
                imported = symbol is not None and symbol.kind == "import"
                role: Role = "member" if imported else "property"
                self._add(node.name.span, node.name.text, role, symbol if imported else None)
            case _:
                self._children(node, scope, kind)

    def _children(self, node: Any, scope: TextScope, kind: str) -> None:
        for child in tree.children(node):
            if not isinstance(child, tree.Name):
                self._walk(child, scope, kind)

    def _call(self, stmt: tree.Call, scope: TextScope, kind: str) -> None:
        name = stmt.name.text
        own = None if name in LANGUAGE else scope.find(name)
        meaning = scopes.head_of(stmt, own, kind)
        role: Role | None = "setting" if meaning == "setting" else None
        if meaning == "move":
            moves = name in TRANSFORMS and (kind != "material" or name not in OPERATIONS)
            role = "transform" if moves else "operation"
        elif meaning == "leaf" and own is not None:
            role = "geometry"
        span = stmt.name.span
        head = self._add(span, name, role) if role else self._reference(stmt.name, scope, "geometry")
        self._arguments(stmt.args or (), scope, head)
        if stmt.body is not None:
            value = head is not None and head.symbol is not None and head.symbol.kind in ("let", "argument")
            self._walk(stmt.body, scope, "material" if value else "object")

    def _add(self, span: Span, text: str, role: Role, symbol: Symbol | None = None) -> Use:
        use = Use(span.start, span.end, text, role, symbol)
        self.uses.append(use)
        return use

    def _reference(
        self, name: tree.Name, scope: TextScope, otherwise: Role, member: Role = "member"
    ) -> Use | None:
        """The use of a plain or dotted name; of a dotted one that of its last part."""
        alias, _, rest = name.text.partition(".")
        symbol = scope.find(alias)
        if not rest:
            use = self._add(name.span, alias, "name" if symbol else otherwise, symbol)
            if symbol is None:
                self._unresolved.append((use, scope))
            return use
        source, span = name.span.source, name.span
        self._add(Span(source, span.start, span.start + len(alias)), alias, "name", symbol)
        tail = Span(source, span.end - len(rest), span.end)
        if symbol is not None and symbol.kind == "import":
            return self._add(tail, rest, member, symbol)
        return None

    def _arguments(self, args: Iterable[tree.Argument], scope: TextScope, head: Use | None) -> None:
        for arg in args:
            if arg.name is not None:
                self._add(arg.name.span, arg.name.text, "argument").callee = head
            self._walk(arg.value, scope, "")


_DRAWING: Final = (tree.Call, tree.Node, tree.For, tree.If, tree.Combined)
_KINDS: Final = ("let", "param", "fn", "module", "import")


def find_unused(file: tree.File, diagnostics: Diagnostics) -> None:
    """Warn of definitions and imports that nothing uses.

    Names that begin with ``_`` are left out, and so is what a file without objects defines at top level: it
    is a library. The tree is one without syntax errors.
    """
    names = Names(file)
    used = {use.symbol for use in names.uses if not _is_inside_its_definition(use)}
    library = not any(isinstance(stmt, _DRAWING) for stmt in file.statements)
    for symbol in names.symbols:
        name, kind, span = symbol.name, symbol.kind, symbol.span
        if symbol in used or kind not in _KINDS or name.startswith("_"):
            continue
        if library and symbol.scope is names.top and kind != "import":
            continue
        fix: Fix | None = None
        if kind == "import":
            help, fix = "delete it", removal(span.source, symbol.node.span.start, symbol.node.span.end)
        elif kind == "param":
            help = "it changes nothing: use it or delete it"
        else:
            help = "delete it, or let its name begin with `_`"
            if f"_{name}" not in span.source.text:
                fix = Fix(f"rename to `_{name}`", (Edit(span, f"_{name}"),))
        diagnostics.add("W0201", f"{kind} `{name}` is never used", span, help=help, fix=fix)


def _is_inside_its_definition(use: Use) -> bool:
    """Test whether a use is the definition itself, or a call of a function or module in its own body."""
    if (symbol := use.symbol) is None or use.defines or symbol.kind not in ("fn", "module"):
        return use.defines
    return symbol.node.span.start <= use.start < symbol.node.span.end
