"""Blocks and control flow: each block is prepared once into a list of actions over a `Builder`."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

from scenelang.diagnostics.diagnostic import Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.costs import CALL_STEPS, HALF_STEPS
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.limits import MAX_NESTING
from scenelang.evaluate.names import UNBOUND, Binding, Definition, Env, Frame, Needs, Scope
from scenelang.evaluate.prepare.expressions import VARIES, guarded, prepare, watched
from scenelang.evaluate.prepare.operations import condition
from scenelang.evaluate.replay import Still
from scenelang.evaluate.report.undefined import tell_bound
from scenelang.evaluate.values.value import POISON, Problem, RangeValue, Vec, unexpected
from scenelang.syntax import nodes
from scenelang.words import LANGUAGE, SETTINGS

Kind = Literal["file", "group", "chain", "object", "material", "unknown"]
"""What a block may hold. ``unknown`` is the block of something misspelt: nothing is out of place there."""

Action = Callable[[Env, Builder], None]


class Place(NamedTuple):
    """Where a statement stands.

    Args:
        unit: its file.
        scope: the names it sees.
        kind: the kind of block around it.
        nested: whether a ``for`` or ``if`` stands between it and that block's braces.
        repeated: whether a ``for`` stands around it, however far out.
        block: the names of that block, which tell it from others.
    """

    unit: Unit
    scope: Scope
    kind: Kind
    nested: bool = False
    repeated: bool = False
    block: Scope | None = None


class Body(NamedTuple):
    """A prepared block."""

    actions: tuple[Action, ...]
    weight: int


def prepare_statement(stmt: nodes.Stmt, place: Place) -> Action | None:
    """One statement's action; None where it does nothing when it runs."""
    place.unit.weight += HALF_STEPS.get(stmt.__class__, 0)
    action: Action | None = place.unit.session.statements[stmt.__class__](stmt, place)
    return action


def prepare_block(statements: Sequence[nodes.Stmt], place: Place, span: Span) -> Body:
    """Prepare a block in its own scope, which ``place`` brings along.

    Functions and modules are known in the whole block; their bodies are prepared after it, when all
    names of the block are known to them.
    """
    unit, scope = place.unit, place.scope
    unit.nesting += 1
    if unit.nesting > MAX_NESTING:
        message = f"a tree of more than {MAX_NESTING} levels"
        raise unit.session.halt("E0324", message, span)
    before = unit.weight
    bodies = [declare(stmt, place) for stmt in statements if isinstance(stmt, nodes.Fn | nodes.Module)]
    for stmt in statements:
        if isinstance(stmt, nodes.Let | nodes.Param):
            scope.later.setdefault(stmt.name.text, stmt.name.span)
    prepared = [_collected(stmt, place) for stmt in statements]
    scope.later.clear()
    actions = [action for action in prepared if action is not None]
    if any(bodies):
        actions = _unbind(scope, place) + actions
    for body in bodies:
        if body is not None:
            body()
    unit.nesting -= 1
    weight, unit.weight = unit.weight - before, before  # whoever runs the block counts it
    return Body(tuple(actions), 1 + len(actions) + weight // 2)


def _collected(stmt: nodes.Stmt, place: Place) -> Action | None:
    """`prepare_statement`, noting what the statement depends on; one that no frame changes runs once.

    That holds of statements of a file or its groups. Loops and modules run more than once in a frame.
    """
    session = place.unit.session
    if not session.replays or place.repeated or place.scope.frame.root is None:
        return prepare_statement(stmt, place)
    around, session.needs = session.needs, Needs()
    try:
        action = prepare_statement(stmt, place)
        needs = session.needs
    finally:
        around.on.append(session.needs)
        session.needs = around
    fills = isinstance(stmt, nodes.Call | nodes.Node | nodes.For | nodes.If)
    if action is None or not fills or place.kind not in ("file", "group"):
        return action
    if isinstance(stmt, nodes.Call) and stmt.name.text in SETTINGS:
        return action
    return Still(action, needs, session, stmt.span)


def _unbind(scope: Scope, place: Place) -> list[Action]:
    """In a loop, a function must not see what the pass before left in a slot."""
    if scope.frame.root is not None and scope is place.unit.scope:
        return []
    slots = [b.slot for b in scope.names.values() if b.kind == "let" and b.frame is scope.frame]

    def action(env: Env, out: Builder) -> None:
        for slot in slots:
            env[slot] = UNBOUND

    return [action] if slots else []


def inner(place: Place, kind: Kind | None = None) -> Place:
    """The place inside a block: a new scope, and a new kind unless control flow passes it on."""
    scope = Scope(place.scope.frame, place.scope)
    if kind is None:
        return Place(place.unit, scope, place.kind, True, place.repeated, place.block)
    return Place(place.unit, scope, kind, False, place.repeated, scope)


def misplaced(
    place: Place, span: Span, message: str, help: str | None = None, fix: Fix | None = None
) -> bool:
    """Report a statement in the wrong place, unless nothing is known about the place.

    Several of a sort in one block are told as one: it is the block that is of the wrong kind.
    """
    session = place.unit.session
    if place.kind == "unknown":
        return True
    if place.block is None:
        session.report.error("E0330", message, span, help=help, fix=fix)
    else:
        sort = re.sub(r"`[^`]*`", "", message)
        session.report.error_once(("E0330", place.block, sort), "E0330", message, span, help=help, fix=fix)
    return True


# ---------------------------------------------------------------- definitions


def define(name: nodes.Name, binding: Binding, place: Place) -> bool:
    """Bind a name in this scope; reports a second definition and keeps the first."""
    unit, scope = place.unit, place.scope
    earlier = scope.names.get(name.text)
    scope.later.pop(name.text, None)
    if unit.damage and unit.damage.holds(name.span):
        # What it stands for is known when its statement reads again.
        binding.kind = "poison"
        scope.names[name.text] = binding
        tell_bound(
            unit.session.report, name, earlier or (scope.parent.find(name.text) if scope.parent else None)
        )
        return True
    if earlier is not None:
        labels = (Label(earlier.span, "first defined here"),) if earlier.span else ()
        unit.session.report.error(
            "E0202",
            f"`{name.text}` is already defined in this scope",
            name.span,
            labels=labels,
            help="names are bound once; an inner block may bind them anew",
        )
        return False
    scope.names[name.text] = binding
    return True


def prepare_let(stmt: nodes.Let, place: Place) -> Action | None:
    code = prepare(stmt.value, place.unit, place.scope)
    name = stmt.name.span
    place.unit.session.report.origins[id(name.source), name.start] = stmt.value
    frame = place.scope.frame
    slot = frame.slot()
    known = code.value is not VARIES
    value = code.value if known else None
    binding = Binding("let", stmt.name.span, frame, slot, value, known, place.unit.session.needs)
    define(stmt.name, binding, place)
    get = watched(code.run, stmt.name.span, place.unit)

    def action(env: Env, out: Builder) -> None:
        env[slot] = get(env)

    return action


def declare(stmt: nodes.Fn | nodes.Module, place: Place) -> Callable[[], None] | None:
    """Make a function or module known; returns how to prepare its body."""
    unit, scope = place.unit, place.scope
    name = stmt.name
    if isinstance(stmt, nodes.Module) and name.text in LANGUAGE:
        message = f"`{name.text}` is a word of the language and names no module"
        unit.session.report.error("E0209", message, name.span, help="rename it")
        return None
    frame = Frame(scope.frame)
    definition = Definition(stmt, scope.frame)
    kind: Literal["fn", "module"] = "fn" if isinstance(stmt, nodes.Fn) else "module"
    define(name, Binding(kind, name.span, value=definition), place)
    return lambda: _prepare_body(stmt, definition, frame, place)


def _prepare_body(stmt: nodes.Fn | nodes.Module, definition: Definition, frame: Frame, place: Place) -> None:
    unit = place.unit
    scope = Scope(frame, place.scope)
    params = Place(unit, scope, "group")
    defaults = []
    slots = [frame.slot() for _ in stmt.params]
    optional = False
    for index, (param, slot) in enumerate(zip(stmt.params, slots, strict=True)):
        at = param.name.span
        unit.session.report.parameters[id(at.source), at.start] = id(stmt), index
        if param.default is not None:
            optional = True
            defaults.append(prepare(param.default, unit, scope).run)
        else:
            if optional:
                message = f"`{param.name.text}` has no default but follows one that has"
                unit.session.report.error(
                    "E0308", message, param.span, help="put it first, or give it a default"
                )
            defaults.append(lambda env: POISON)
        define(param.name, Binding("argument", param.name.span, frame, slot), params)
    definition.defaults = tuple(defaults)
    before = unit.weight
    around, unit.session.needs = unit.session.needs, definition.needs
    if isinstance(stmt, nodes.Fn):
        name = stmt.name.span
        unit.session.report.origins[id(name.source), name.start] = stmt.body
        definition.run = prepare(stmt.body, unit, scope).run
        definition.weight = CALL_STEPS + (unit.weight - before) // 2
        unit.weight = before
    else:
        body = prepare_block(stmt.body.statements, Place(unit, Scope(frame, scope), "group"), stmt.body.span)
        definition.run = body.actions
        definition.weight = body.weight
    unit.session.needs = around
    definition.slots = frame.size


def skip_declared(stmt: nodes.Fn | nodes.Module, place: Place) -> Action | None:
    return None  # done by `declare`


def skip_bad(stmt: nodes.BadStmt, place: Place) -> Action | None:
    return None


# ---------------------------------------------------------------- control flow


def prepare_for(stmt: nodes.For, place: Place) -> Action | None:
    unit = place.unit
    iterable = prepare(stmt.iterable, unit, place.scope)
    loop = inner(place)._replace(repeated=True)
    frame = loop.scope.frame
    slot = frame.slot()
    define(stmt.variable, Binding("loop", stmt.variable.span, frame, slot), loop)
    body = prepare_block(stmt.body.statements, inner(loop), stmt.body.span)
    session, span, actions, weight = unit.session, stmt.iterable.span, body.actions, body.weight + 1

    def items(value: Any) -> Any:
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

    check = guarded(unit, items, span, (), item_steps=0)
    get = iterable.run

    def action(env: Env, out: Builder) -> None:
        values = check(get(env))
        if values is POISON:
            return
        for value in values:
            env[slot] = value
            if session.watch is not None:
                session.watch(stmt.variable.span, value)
            session.tick(weight, span)
            for act in actions:
                act(env, out)

    return action


def prepare_if(stmt: nodes.If, place: Place) -> Action | None:
    unit = place.unit
    arms: list[tuple[Callable[[Env], Any], Body]] = []
    at: nodes.If | nodes.Block | None = stmt
    while isinstance(at, nodes.If):
        test = condition(at.condition, unit, place.scope).run
        arms.append((test, prepare_block(at.then.statements, inner(place), at.then.span)))
        at = at.otherwise
    last = prepare_block(at.statements, inner(place), at.span) if at is not None else None
    session, span = unit.session, stmt.condition.span

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
            session.tick(chosen.weight, span)
            for act in chosen.actions:
                act(env, out)

    return action
