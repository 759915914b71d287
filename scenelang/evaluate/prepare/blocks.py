"""Blocks and control flow: each block is prepared once into a list of actions over a `Builder`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

from scenelang.diagnostics.diagnostic import Fix
from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.costs import CALL_STEPS, HALF_STEPS
from scenelang.evaluate.file_context import Action, Place
from scenelang.evaluate.limits import MAX_NESTING
from scenelang.evaluate.names import UNBOUND, Binding, Definition, Env, Needs, Scope, Slots
from scenelang.evaluate.prepare.expressions import VARIES, guarded, prepare
from scenelang.evaluate.prepare.operations import condition
from scenelang.evaluate.session import Session
from scenelang.evaluate.values.value import POISON, Problem, RangeValue, Vec, unexpected
from scenelang.records import Record
from scenelang.scene.spans import SpanMap
from scenelang.syntax import nodes
from scenelang.words import LANGUAGE, SETTINGS


class Body(NamedTuple):
    """A prepared block, and what a run of it costs."""

    actions: Iterable[Action] = ()
    weight: int = 1

    def run(self, env: Env, out: Builder, session: Session, span: Span) -> None:
        """Run the block, whose steps count at ``span``."""
        session.tick(self.weight, span)
        for act in self.actions:
            act(env, out)


def prepare_statement(stmt: nodes.Stmt, place: Place) -> Action | None:
    """One statement's action; None where it does nothing when it runs."""
    place.file.weight += HALF_STEPS.get(stmt.__class__, 0)
    action: Action | None = place.session.statements[stmt.__class__](stmt, place)
    return action


def prepare_block(statements: Sequence[nodes.Stmt], place: Place, span: Span) -> Body:
    """Prepare a block in its own scope, which ``place`` brings along.

    Functions and modules are known in the whole block; their bodies are prepared after it, when all
    names of the block are known to them.
    """
    file, scope = place.file, place.scope
    file.nesting += 1
    if file.nesting > MAX_NESTING:
        raise file.session.halt("E0324", f"a tree of more than {MAX_NESTING} levels", span)
    before = file.weight
    declared = [_declare(stmt, place) for stmt in statements if isinstance(stmt, nodes.Fn | nodes.Module)]
    bodies = [prepare_body for prepare_body in declared if prepare_body is not None]
    for stmt in statements:
        if isinstance(stmt, nodes.Let | nodes.Param):
            scope.later.setdefault(stmt.name.text, stmt.name.span)
        elif isinstance(stmt, nodes.Import):
            scope.later.setdefault(stmt.alias.text, stmt.alias.span)
    prepared = [_collected(stmt, place) for stmt in statements]
    scope.later.clear()
    actions = [action for action in prepared if action is not None]
    if bodies and not (scope.slots.root is not None and scope is file.scope):
        actions = _unbind(scope) + actions
    for prepare_body in bodies:
        prepare_body()
    file.nesting -= 1
    weight, file.weight = file.weight - before, before  # whoever runs the block counts it
    return Body(tuple(actions), 1 + len(actions) + weight // 2)


def prepare_inner(block: nodes.Block | None, place: Place) -> Body:
    """Prepare a block of a statement, with the place inside it; nothing to run where there is none."""
    return Body() if block is None else prepare_block(block.statements, place, block.span)


def _collected(stmt: nodes.Stmt, place: Place) -> Action | None:
    """`prepare_statement`, noting what the statement depends on; one that no frame changes runs once.

    That holds of statements of a file or its groups. Loops and modules run more than once in a frame.
    """
    session = place.session
    if not session.replays or place.repeated or place.scope.slots.root is None:
        return prepare_statement(stmt, place)
    around, session.needs = session.needs, Needs()
    try:
        action = prepare_statement(stmt, place)
        needs = session.needs
    finally:
        around.on.append(session.needs)
        session.needs = around
    fills = isinstance(stmt, nodes.Call | nodes.Node | nodes.For | nodes.If)
    setting = isinstance(stmt, nodes.Call) and stmt.name.text in SETTINGS
    if action is None or not fills or setting or place.kind not in ("file", "group"):
        return action
    return Replayed(action, needs, session, stmt.span)


def _unbind(scope: Scope) -> list[Action]:
    """In a loop, a function must not see what the pass before left in a slot."""
    slots = [b.slot for b in scope.names.values() if b.kind == "let" and b.slots is scope.slots]

    def action(env: Env, out: Builder) -> None:
        for slot in slots:
            env[slot] = UNBOUND

    return [action] if slots else []


def misplaced(
    place: Place, span: Span, fact: str, name: str = "", help: str | None = None, fix: Fix | None = None
) -> None:
    """Report a statement in the wrong place, unless nothing is known about the place.

    Several in one block with the same ``fact``, a message with ``{}`` for the name, are one report: it is the
    block that is of the wrong kind.
    """
    if place.kind != "unknown":
        key = ("E0330", span.source, span) if place.block is None else ("E0330", place.block, fact)
        place.report.error_once(key, "E0330", fact.format(name), span, help=help, fix=fix)


# ---------------------------------------------------------------- definitions


def define(name: nodes.Name, binding: Binding, place: Place) -> bool:
    """Bind a name in this scope; reports a second definition and keeps the first."""
    scope = place.scope
    earlier = scope.names.get(name.text)
    scope.later.pop(name.text, None)
    if place.report.damage(name.span.source).holds(name.span):
        # What it stands for is known when its statement reads again.
        binding.kind = "poison"
    elif earlier is not None:
        message = f"`{name.text}` is already defined in this scope"
        help = "names are bound once; an inner block may bind them anew"
        labels = earlier.labels("first defined here")
        place.report.error("E0202", message, name.span, labels=labels, help=help)
        return False
    scope.names[name.text] = binding
    return True


def prepare_let(stmt: nodes.Let, place: Place) -> Action | None:
    code = prepare(stmt.value, place)
    name, session, slots = stmt.name.span, place.session, place.scope.slots
    slot, known = slots.add(), code.value is not VARIES
    value = code.value if known else None
    define(stmt.name, Binding("let", name, slots, slot, value, known, session.needs), place)
    get, watch = code.run, session.watch

    def action(env: Env, out: Builder) -> None:
        env[slot] = get(env)

    def watched(env: Env, out: Builder) -> None:
        env[slot] = get(env)
        if watch is not None:
            watch(name, env[slot])

    return action if watch is None else watched


def _declare(stmt: nodes.Fn | nodes.Module, place: Place) -> Callable[[], None] | None:
    """Make a function or module known; returns how to prepare its body."""
    name, outer = stmt.name, place.scope.slots
    if isinstance(stmt, nodes.Module) and name.text in LANGUAGE:
        message = f"`{name.text}` is a word of the language and names no module"
        place.report.error("E0209", message, name.span, help="rename it")
        return None
    definition = Definition(stmt, outer)
    binding = Binding("fn" if isinstance(stmt, nodes.Fn) else "module", name.span, value=definition)
    define(name, binding, place)
    return lambda: _prepare_body(stmt, definition, place)


def _prepare_body(stmt: nodes.Fn | nodes.Module, definition: Definition, place: Place) -> None:
    file, report, session = place.file, place.report, place.session
    slots = Slots(definition.outer, owner=stmt.name.span)
    inside = Place(file, Scope(slots, place.scope), "group")
    defaults: list[Callable[[Env], Any]] = []
    places = [slots.add() for _ in stmt.params]
    optional = False
    for param, slot in zip(stmt.params, places, strict=True):
        at = param.name.span
        if param.default is not None:
            optional = True
            defaults.append(prepare(param.default, inside).run)
        else:
            if optional:
                message = f"`{param.name.text}` has no default but follows one that has"
                report.error("E0308", message, param.span, help="put it first, or give it a default")
            defaults.append(lambda env: POISON)
        define(param.name, Binding("argument", at, slots, slot), inside)
    definition.defaults = tuple(defaults)
    before = file.weight
    around, session.needs = session.needs, definition.needs
    if isinstance(stmt, nodes.Fn):
        definition.run = prepare(stmt.body, inside).run
        definition.weight = CALL_STEPS + (file.weight - before) // 2
        file.weight = before
    else:
        body = prepare_inner(stmt.body, inside._replace(scope=Scope(slots, inside.scope)))
        definition.run, definition.weight = body
    session.needs = around
    definition.size = slots.size


def skip(stmt: nodes.Fn | nodes.Module | nodes.BadStmt, place: Place) -> Action | None:
    """Nothing to run: `prepare_block` has declared it, or recovery has reported it."""
    return None


# ---------------------------------------------------------------- control flow


def _items(value: Any) -> Any:
    if value.__class__ is Vec:
        return value.items
    if value.__class__ is RangeValue:
        if value.unit != "number" and value.step is None:
            help = "add a step, as in 0deg..90deg step 30deg"
            raise Problem("E0311", f"a range of {value.unit}s without a step", help)
        value.count()
        return value
    advice = "write 0..<n for n passes" if value.__class__ is float else None
    raise unexpected("a range or a vector", value, advice)


def prepare_for(stmt: nodes.For, place: Place) -> Action | None:
    get = prepare(stmt.iterable, place).run
    loop = place.inner()._replace(repeated=True)
    slot = loop.scope.slots.add()
    define(stmt.variable, Binding("loop", stmt.variable.span, loop.scope.slots, slot), loop)
    actions, weight = prepare_inner(stmt.body, loop.inner())
    session, span = place.session, stmt.iterable.span
    check = guarded(place, _items, span, (), item_steps=0)

    def action(env: Env, out: Builder) -> None:
        values = check(get(env))
        if values is POISON:
            return
        for value in values:
            env[slot] = value
            if session.watch is not None:
                session.watch(stmt.variable.span, value)
            session.tick(weight + 1, span)
            for act in actions:
                act(env, out)

    return action


def prepare_if(stmt: nodes.If, place: Place) -> Action | None:
    arms: list[tuple[Callable[[Env], Any], Body]] = []
    at: nodes.If | nodes.Block | None = stmt
    while isinstance(at, nodes.If):
        test = condition(at.condition, place).run
        arms.append((test, prepare_inner(at.then, place.inner())))
        at = at.otherwise
    last = prepare_inner(at, place.inner()) if at is not None else None
    session, span = place.session, stmt.condition.span

    def action(env: Env, out: Builder) -> None:
        chosen = last
        for test, body in arms:
            value = test(env)
            if value is True:
                chosen = body
                break
            if value is POISON:
                return
        if chosen is not None:
            chosen.run(env, out, session, span)

    return action


class Replayed(Record, frozen=False):
    """The action of a statement of a file or a group that runs at most once in a frame.

    Args:
        varies: whether frames change it, once that was asked.
        kept: what it put into its block, the places of that, and the steps, objects and parts it counted.
    """

    action: Callable[[Any, Builder], None]
    needs: Needs
    session: Session
    span: Span
    varies: bool | None = None
    kept: tuple[Builder, SpanMap, int, int, int] | None = None

    def __call__(self, env: Any, out: Builder) -> None:
        """Run the statement, or replay what it did."""
        if self.varies is None:
            self.varies = self.needs.varies()
        session = self.session
        if self.varies:
            self.action(env, out)
        elif self.kept is None:
            own = Builder(out.material, out.material_span, out.moved)
            steps, objects, parts = session.steps, session.objects, session.parts
            around, session.spans = session.spans, SpanMap()
            try:
                self.action(env, own)
            finally:
                around.add(session.spans)
                spans, session.spans = session.spans, around
            own.material = own.material if out.material is None else None
            own.moved = own.moved if own.transforms else None
            counted = session.steps - steps, session.objects - objects, session.parts - parts
            self.kept = (own, spans, *counted)
            out.extend(own)
        else:
            own, spans, steps, objects, parts = self.kept
            if (own.children and out.moved) or (own.material and out.material):
                self.action(env, out)  # an error that needs the place it stands in
                return
            session.tick(steps, self.span)
            session.count_parts(parts, self.span)
            session.count_objects(objects, self.span)
            session.spans.add(spans)
            out.extend(own)
