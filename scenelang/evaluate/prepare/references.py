"""Names in expressions: variables, functions, what imported files bring."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate import costs
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.limits import MAX_DEPTH
from scenelang.evaluate.names import UNBOUND, Binding, Definition, Env, Scope
from scenelang.evaluate.prepare.arguments import Bound, bind
from scenelang.evaluate.prepare.expressions import (
    POISONED,
    Code,
    Run,
    constant,
    folded,
    guarded,
    prepare,
    prepare_arguments,
)
from scenelang.evaluate.prepare.literals import member
from scenelang.evaluate.report.undefined import VALUES, unknown, unknown_member
from scenelang.evaluate.values.functions import CONSTANTS, FUNCTIONS, Builtin
from scenelang.evaluate.values.value import POISON
from scenelang.scene.spans import Calls
from scenelang.syntax import nodes
from scenelang.words import ANIMATED


def value_of(name: nodes.Name, binding: Binding, unit: Unit, scope: Scope) -> Code:
    """The value of a variable."""
    frame, slot = binding.frame, binding.slot
    if binding.needs is not None:
        unit.session.needs.on.append(binding.needs)
    if binding.kind == "poison" or frame is None:
        return POISONED
    session, span = unit.session, name.span
    if binding.span is not None:
        session.report.defined[id(span.source), span.start] = binding.span
    if frame is scope.frame and frame is not unit.frame:
        return constant(binding.value) if binding.known else Code(lambda env: env[slot])
    if frame is scope.frame and binding.known:
        return constant(binding.value)

    def check(value: Any) -> Any:
        if value is UNBOUND:
            label = (Label(binding.span, "defined here"),) if binding.span else ()
            session.report.error(
                "E0203", f"`{name.text}` is used before its line has run", span, labels=label
            )
            return POISON
        return value

    if frame.root is not None:
        root = frame.root

        def from_root(env: Env) -> Any:
            value = root[slot]
            return check(value) if value is UNBOUND else value

        return Code(from_root)
    hops = scope.hops(frame)

    def from_outside(env: Env) -> Any:
        for _ in range(hops):
            env = env[0]
        return check(env[slot])

    return Code(from_outside)


def lookup(name: nodes.Name, unit: Unit, scope: Scope) -> Binding | None:
    """The binding of a plain or qualified name; None where it is unknown, unreported."""
    text = name.text
    if "." not in text:
        return scope.find(text)
    alias, _, rest = text.partition(".")
    binding = scope.find(alias)
    if binding is None or binding.kind != "import":
        return None
    if binding.value is None:
        return Binding("poison")
    exported: Unit = binding.value
    found = exported.scope.names.get(rest)
    return None if found is None or found.kind == "import" else found


def wrong_kind(name: nodes.Name, binding: Binding, unit: Unit, wanted: str, help: str | None = None) -> None:
    """Report a name that stands for something else than is wanted here."""
    kinds = {"fn": "a function", "module": "a module", "import": "an imported file"}
    kind = kinds.get(binding.kind, "a value")
    labels = (Label(binding.span, "defined here"),) if binding.span else ()
    message = f"`{name.text}` is {kind}, not {wanted}"
    where = id(unit.source), binding.span.start if binding.span else -1
    unit.session.report.error_once(
        ("E0213", message, *where), "E0213", message, name.span, help=help, labels=labels
    )


def prepare_name(expr: nodes.NameRef, unit: Unit, scope: Scope) -> Code:
    name = expr.name
    alias, _, rest = name.text.partition(".")
    if rest:
        head = Span(name.span.source, name.span.start, name.span.start + len(alias))
        tail = Span(name.span.source, name.span.end - len(rest), name.span.end)
        base = nodes.NameRef(nodes.Name(alias, head), head)
        return prepare_member(nodes.Member(base, nodes.Name(rest, tail), expr.span), unit, scope)
    binding = scope.find(name.text)
    if binding is None:
        return _own_name(name, unit, scope)
    if binding.kind in VALUES or binding.kind == "poison":
        return value_of(name, binding, unit, scope)
    help = f"call it: {name.text}(…)" if binding.kind == "fn" else None
    wrong_kind(name, binding, unit, "a value", help)
    return POISONED


def _own_name(name: nodes.Name, unit: Unit, scope: Scope) -> Code:
    """A constant of the language or a variable of the animation."""
    text, session = name.text, unit.session
    if text in CONSTANTS:
        return constant(CONSTANTS[text])
    if text not in ANIMATED:
        if text in FUNCTIONS:
            message = f"`{text}` is a function, not a value"
            session.report.error("E0213", message, name.span, help=f"call it: {text}(…)")
        else:
            unknown(name, unit, scope)
        return POISONED
    if unit.damage and unit.damage.loses("animate"):
        return POISONED
    index = [*ANIMATED].index(text)
    session.needs.frame |= text != "frames"
    if session.animated[index] is not UNBOUND:
        return constant(session.animated[index])

    def run(env: Env) -> Any:
        value = session.animated[index]
        if value is UNBOUND:
            help = "move the line that needs it below animate(…)"
            session.report.error("E0203", f"`{text}` is used before animate(…)", name.span, help=help)
            return POISON
        return value

    return Code(run)


def prepare_member(expr: nodes.Member, unit: Unit, scope: Scope) -> Code:
    value = expr.value
    if isinstance(value, nodes.NameRef):
        binding = scope.find(value.name.text)
        if binding is not None and binding.kind == "import":
            name = nodes.Name(f"{value.name.text}.{expr.name.text}", expr.span)
            return _imported(name, binding, unit, scope)
    if isinstance(value, nodes.Member) and isinstance(value.value, nodes.NameRef):
        # lib.v.x: the inner member is the qualified name
        return member(prepare_member(value, unit, scope), expr.name, unit)
    code = prepare(value, unit, scope)
    return POISONED if code.value is POISON else member(code, expr.name, unit, value)


def _imported(name: nodes.Name, binding: Binding, unit: Unit, scope: Scope) -> Code:
    """``lib.name`` as a value; ``lib.name.x`` arrives as a member of it."""
    first, _, rest = name.text.partition(".")
    part, _, more = rest.partition(".")
    if more:
        tail = Span(name.span.source, name.span.end - len(more), name.span.end)
        head = Span(name.span.source, name.span.start, tail.start - 1)
        code = _imported(nodes.Name(f"{first}.{part}", head), binding, unit, scope)
        return POISONED if code.value is POISON else member(code, nodes.Name(more, tail), unit)
    if binding.value is None:
        return POISONED
    found = lookup(name, unit, scope)
    if found is None:
        unknown_member(name, unit, binding.value)
        return POISONED
    if found.kind in VALUES or found.kind == "poison":
        return value_of(name, found, unit, scope)
    wrong_kind(name, found, unit, "a value", f"call it: {name.text}(…)" if found.kind == "fn" else None)
    return POISONED


# ---------------------------------------------------------------- calls


def prepare_call(expr: nodes.CallExpr, unit: Unit, scope: Scope) -> Code:
    name = expr.name
    binding = lookup(name, unit, scope)
    codes = prepare_arguments(name.text if binding is None else "", expr.args, unit, scope)
    if binding is not None:
        if binding.kind == "poison":
            return POISONED
        if binding.kind != "fn":
            help = "a module makes objects and is called as a statement" if binding.kind == "module" else None
            wrong_kind(name, binding, unit, "a function", help)
            return POISONED
        return _call_fn(expr, binding.value, codes, unit, scope)
    if "." in name.text:
        alias = scope.find(name.text.partition(".")[0])
        if alias is not None and alias.kind == "import" and alias.value is not None:
            unknown_member(name, unit, alias.value)
        elif alias is None:
            unknown(name, unit, scope, expr)
        elif alias.kind != "import":
            _method(expr, unit)
        return POISONED
    builtin = FUNCTIONS.get(name.text)
    if builtin is None:
        unknown(name, unit, scope, expr)
        return POISONED
    if builtin.variadic:
        if not expr.args or any(arg.name for arg in expr.args):
            message = f"`{name.text}` takes one or more arguments without names"
            unit.session.report.error("E0308", message, name.span)
            return POISONED
        ordered: Bound = list(expr.args)
    else:
        required = [False] * len(builtin.params)
        found = bind(unit.session, name.text, builtin.params, required, expr.args, name.span)
        if found is None:
            return POISONED
        ordered = found
    args = [arg for arg in ordered if arg is not None]
    inputs = [codes[id(arg)] for arg in args]
    meaning = builtin.run if builtin.doubt is None else _doubted(builtin, args, unit)
    unit.weight += costs.FUNCTIONS.get(name.text, 4 * len(args) if builtin.variadic else 0)
    per_item = 0 if name.text == "len" else costs.FUNCTION_ITEM_STEPS
    slow = guarded(unit, meaning, expr.span, tuple([arg.value for arg in args]), per_item)
    if len(inputs) == 1:
        get = inputs[0].run
        return folded(unit, inputs, meaning, lambda env: slow(get(env)))
    getters = tuple([code.run for code in inputs])
    return folded(unit, inputs, meaning, lambda env: slow(*[get(env) for get in getters]))


def _method(expr: nodes.CallExpr, unit: Unit) -> None:
    """Report `v.length()`: a value has no functions."""
    alias, _, rest = expr.name.text.partition(".")
    start = expr.name.span.start
    value = nodes.Name(alias, Span(unit.source, start, start + len(alias)))
    last = nodes.Name(rest, Span(unit.source, expr.name.span.end - len(rest), expr.span.end))
    from scenelang.evaluate.report.habits import member_advice  # only mistakes need it

    help, fix = member_advice(nodes.NameRef(value, value.span), last)
    help = help or f"write {rest}(…) with the value as an argument"
    unit.session.report.error("E0128", "only a name can be called", expr.name.span, help=help, fix=fix)


def _doubted(builtin: Builtin, args: Sequence[nodes.Argument], unit: Unit) -> Callable[..., Any]:
    """A function that warns of doubtful values."""
    session = unit.session

    def run(*values: Any) -> Any:
        result = builtin.run(*values)
        doubt = builtin.doubt(*values) if builtin.doubt else None
        if doubt is not None and doubt.operand is not None:
            span = args[doubt.operand].value.span
            if not session.report.follows(doubt.code, span):
                session.report.diagnostics.add(doubt.code, doubt.message, span, help=doubt.help)
        return result

    return run


def _call_fn(
    expr: nodes.CallExpr, definition: Definition, codes: dict[int, Code], unit: Unit, scope: Scope
) -> Code:
    enter = entering(expr.name, expr.args, definition, codes, unit, scope)
    if enter is None:
        return POISONED
    session = unit.session
    session.report.defined[id(expr.name.span.source), expr.name.span.start] = definition.node.name.span

    def run(env: Env) -> Any:
        before = session.report.calls
        frame = enter(env)
        value = definition.run(frame)
        session.report.calls = before
        session.depth -= 1
        return value

    return Code(run)


def entering(
    name: nodes.Name,
    args: tuple[nodes.Argument, ...],
    definition: Definition,
    codes: dict[int, Code],
    unit: Unit,
    scope: Scope,
) -> Run | None:
    """How to make the slots of one call, which also counts it; None if the arguments do not fit.

    When the call is over, the caller takes 1 from the session's depth and puts its calls back.
    """
    params = definition.node.params
    session, span = unit.session, name.span
    session.needs.on.append(definition.needs)
    bound = bind(
        session,
        name.text,
        [p.name.text for p in params],
        [p.default is not None for p in params],
        args,
        span,
        definition=definition.node,
        places=[p.name.span for p in params],
    )
    if bound is None:
        return None
    session.report.given.setdefault(id(definition.node), []).append(bound)
    given = [codes[id(arg)].run if arg is not None else None for arg in bound]
    link = _link(definition, scope)

    def enter(env: Env) -> Env:
        session.depth += 1
        if session.depth > MAX_DEPTH:
            raise session.halt("E0321", f"calls nested deeper than {MAX_DEPTH}", span)
        session.tick(definition.weight, span)
        frame: Env = [UNBOUND] * definition.slots
        frame[0] = link(env)
        before, slot = session.report.calls, 1
        inside = Calls(span, before)
        for get in given:
            session.report.calls = before if get is not None else inside  # defaults are the callee's
            frame[slot] = get(env) if get is not None else definition.defaults[slot - 1](frame)
            if session.watch is not None:
                session.watch(params[slot - 1].name.span, frame[slot])
            slot += 1
        session.report.calls = inside
        return frame

    return enter


def _link(definition: Definition, scope: Scope) -> Run:
    """How to get the slots that enclose a definition from where it is called."""
    root = definition.frame.root
    if root is not None:
        return lambda env: root
    hops = scope.hops(definition.frame)

    def run(env: Env) -> Env:
        for _ in range(hops):
            env = env[0]
        return env

    return run
