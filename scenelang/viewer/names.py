"""Names of a scene's files, resolved to slots, and which of them a form needs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from scenelang.evaluate.file_context import FileContext
from scenelang.evaluate.prepare.settings import BROUGHT
from scenelang.syntax import nodes

Json = Any


@dataclass(slots=True, eq=False)
class Frame:
    """The slots of a call of a function or a module; slot 0 holds the call around it."""

    outer: Frame | None
    size: int = 1


@dataclass(slots=True, eq=False)
class Scope:
    """The names of a block, and the block around it; without a frame its slots are those of files."""

    frame: Frame | None = None
    parent: Scope | None = None
    names: dict[str, Bound] = field(default_factory=dict)

    def find(self, name: str) -> Bound | None:
        """What a name stands for, qualified or not."""
        alias, dot, rest = name.partition(".")
        scope: Scope | None = self
        while scope is not None and alias not in scope.names:
            scope = scope.parent
        found = None if scope is None else scope.names[alias]
        return found.inside.names.get(rest) if dot and found is not None and found.inside else found


@dataclass(slots=True, eq=False)
class Bound:
    """What a name stands for.

    Args:
        kind: as of `scenelang.evaluate.names.Binding`.
        scope: where it was defined.
        node: the statement of a fn or module.
        inside: the names of an imported file.
        file: that file.
        at: place of a fn or module among all that are called.
        uses: what it needs of the names of files.
        element: what a Scene calls a geometry of a file of elements.
    """

    kind: str
    scope: Scope
    slot: int = 0
    node: Any = None
    inside: Scope | None = None
    file: FileContext | None = None
    at: int = -1
    uses: list[Bound] = field(default_factory=list)
    element: str = ""


@dataclass(slots=True)
class Line:
    """A statement of a file, what it defines, and what it needs of the names of files."""

    form: Json
    bound: Bound | None
    uses: list[Bound]


class Names(ABC):
    """Writes the statements of a scene's files as far as names go.

    Attributes:
        slots: how many all files have.
        calls: fns and modules that are called.
        params: each one's full name, statement, file and what its name stands for.
        lengths: what ``canvas`` and ``animate`` need of the names of files.
    """

    def __init__(self) -> None:
        self.slots = 0
        self.calls: list[Json] = []
        self.uses: list[Bound] = []
        self.params: list[tuple[str, nodes.Param, FileContext, Bound]] = []
        self.lengths: dict[str, list[Bound]] = {"canvas": [], "animate": []}

    @abstractmethod
    def expression(self, expr: nodes.Expr, scope: Scope) -> Json:
        """An expression."""

    @abstractmethod
    def statement(self, stmt: nodes.Stmt, scope: Scope, kind: str) -> Json:
        """A statement in a kind of block; None where it does nothing when it runs."""

    def block(self, block: nodes.Block, around: Scope, kind: str) -> Json:
        """A block in a scope of its own."""
        scope = Scope(around.frame, around)
        bodies = self._declare(block.statements, scope)
        made = [self.statement(stmt, scope, kind) for stmt in block.statements]
        for bound in bodies:
            self._body(bound)
            self.uses += bound.uses
        return [form for form in made if form is not None]

    def file(self, context: FileContext, tree: nodes.File, scope: Scope, imported: bool) -> list[Line]:
        """A file's statements; of an imported one what it brings."""
        statements = [s for s in tree.statements if not imported or isinstance(s, BROUGHT)]
        self._declare(statements, scope)
        lines: list[Line] = []
        for stmt in statements:
            self.uses = []
            if isinstance(stmt, nodes.Import):
                lines += self._import(stmt, context, scope)
            elif isinstance(stmt, nodes.Let | nodes.Param):
                form = self.statement(stmt, scope, "file")
                bound = scope.names[stmt.name.text]
                bound.uses = self.uses
                lines.append(Line(form, bound, self.uses))
                if isinstance(stmt, nodes.Param):
                    full = context.prefix + stmt.name.text
                    form[2] = full
                    self.params.append((full, stmt, context, bound))
            elif form := self.statement(stmt, scope, "file"):
                lines.append(Line(form, None, self.uses))
            if isinstance(stmt, nodes.Call) and stmt.name.text in self.lengths:
                self.lengths[stmt.name.text] += self.uses
        return lines

    def _import(self, stmt: nodes.Import, context: FileContext, scope: Scope) -> list[Line]:
        brought = context.scope.names[stmt.alias.text].value
        inside = Scope()
        bound = scope.names[stmt.alias.text] = Bound("import", scope, inside=inside, file=brought)
        tree = context.loader.parsed.get(brought.path)
        if tree is not None:
            return self.file(brought, tree, inside, imported=True)
        for name, binding in brought.scope.names.items():
            inside.names[name] = Bound("element", inside, file=bound.file, element=binding.value)
        return []

    def reached(self, roots: Iterable[Bound]) -> set[int]:
        """Identities of all names of files that something needs; writes what of it is called."""
        seen: dict[int, Bound] = {}
        stack = list(roots)
        while stack:
            bound = stack.pop()
            if id(bound) not in seen:
                seen[id(bound)] = bound
                if bound.at >= 0 and self.calls[bound.at] is None:
                    self._body(bound)
                stack += bound.uses
        return set(seen)

    def _declare(self, statements: Sequence[nodes.Stmt], scope: Scope) -> list[Bound]:
        found = []
        for stmt in statements:
            if isinstance(stmt, nodes.Fn | nodes.Module):
                kind = "fn" if isinstance(stmt, nodes.Fn) else "module"
                scope.names[stmt.name.text] = bound = Bound(kind, scope, node=stmt)
                found.append(bound)
        return found

    def _body(self, bound: Bound) -> None:
        """Write a fn or module: size of its calls, defaults, and what it is."""
        at, stmt = self._called(bound), bound.node
        around, self.uses = self.uses, bound.uses
        frame = Frame(bound.scope.frame, 1 + len(stmt.params))
        inside, defaults = Scope(frame, bound.scope), []
        for slot, param in enumerate(stmt.params, 1):
            defaults.append(None if param.default is None else self.expression(param.default, inside))
            inside.names[param.name.text] = Bound("argument", inside, slot)
        self.calls[at] = made = [0, defaults]
        if isinstance(stmt, nodes.Fn):
            made.append(self.expression(stmt.body, inside))
        else:
            made.append(self.block(stmt.body, inside, "group"))
        made[0] = frame.size
        self.uses = around

    def _called(self, bound: Bound) -> int:
        if bound.at < 0:
            bound.at = len(self.calls)
            self.calls.append(None)
        return bound.at

    def slot(self, scope: Scope) -> int:
        """A new slot."""
        if scope.frame is None:
            self.slots += 1
            return self.slots - 1
        scope.frame.size += 1
        return scope.frame.size - 1

    def hops(self, scope: Scope, to: Scope) -> int:
        """How many calls further out the slots of another scope are; -1 for those of files."""
        hops, frame = 0, scope.frame
        while frame is not to.frame:
            assert frame is not None
            hops, frame = hops + 1, frame.outer
        return -1 if frame is None else hops

    def value(self, bound: Bound, scope: Scope) -> Json:
        """A variable."""
        if bound.scope.frame is None:
            self.uses.append(bound)
            return ["g", bound.slot]
        return ["v", self.hops(scope, bound.scope), bound.slot]

    def call(self, bound: Bound, args: Sequence[nodes.Argument], scope: Scope) -> list[Json]:
        """Place of a definition, hops to where it stands, and the arguments."""
        if bound.scope.frame is None:
            self.uses.append(bound)
        given = bind([param.name.text for param in bound.node.params], args)
        return [self._called(bound), self.hops(scope, bound.scope), self.given(given, scope)]

    def given(self, values: Iterable[nodes.Expr | None], scope: Scope) -> list[Json]:
        """Arguments, None where one is left out."""
        return [None if value is None else self.expression(value, scope) for value in values]


def bind(params: Sequence[str], args: Sequence[nodes.Argument] | None) -> list[nodes.Expr | None]:
    """The argument of each parameter, None where it is left out."""
    bound: dict[str, nodes.Expr] = {}
    for at, arg in enumerate(args or ()):
        bound[params[at] if arg.name is None else arg.name.text] = arg.value
    return [bound.get(name) for name in params]
