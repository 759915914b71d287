"""Expressions: each is prepared once into a closure over its slots, then run as often as needed."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, Final, NamedTuple

from scenelang.language import foreign, limits, tree, values, words
from scenelang.language.advice import member_advice, report_problem, unknown, unknown_member
from scenelang.language.builder import FileContext, Site
from scenelang.language.diagnostics import Label, Span, did_you_mean, instead, listing
from scenelang.language.library import Calls
from scenelang.language.limits import (
    GENERAL_STEPS,
    HALF_STEPS,
    ITEM_STEPS,
    LETTERS_AS_ITEM,
    MAX_DEPTH,
    MAX_NESTING,
)
from scenelang.language.reporter import Reporter
from scenelang.language.scopes import VALUES
from scenelang.language.session import UNBOUND, Binding, Definition, Env, Needs
from scenelang.language.values import POISON, Problem, RangeValue, Vec, number
from scenelang.language.words import ANIMATED

Run = Callable[[Env], Any]

VARIES: Final = object()
"""Marks an expression whose value is known only when it runs."""
_FOLDED: Final = 64  # numbers or letters


class Code(NamedTuple):
    """A prepared expression: how to run it, and its value where that never changes."""

    run: Run
    value: Any = VARIES


class Given(NamedTuple):
    """An argument of a call, and its prepared value."""

    arg: tree.Argument
    code: Code


def constant(value: Any) -> Code:
    """An expression that always has ``value``."""
    return Code(lambda env: value, value)


POISONED: Final = constant(POISON)


def prepare(expr: tree.Expr, place: Site) -> Code:
    """Resolve the names of ``expr`` and make it runnable; reports what is wrong in any case."""
    file = place.file
    file.weight += HALF_STEPS.get(expr.__class__, 1)
    file.nesting += 1
    try:
        if file.nesting > MAX_NESTING:
            raise file.session.halt("E0324", f"a tree of more than {MAX_NESTING} levels", expr.span)
        code: Code = file.session.expressions[expr.__class__](expr, place)
        return code
    finally:
        file.nesting -= 1


def prepare_arguments(args: Iterable[tree.Argument] | None, place: Site, name: str = "") -> list[Given]:
    """Prepare the arguments of a call; ``name`` is that of one of the language's own words."""
    word, given = words.word_for_call(name, False), []
    angle = word.params[0] if word and word.kinds[:1] in (("angle",), ("hue",)) else None
    for index, arg in enumerate(args or ()):
        is_angle = angle and (arg.name.text == angle if arg.name else index == 0)
        given.append(Given(arg, (_prepare_angle if is_angle else prepare)(arg.value, place)))
    return given


def _prepare_angle(expr: tree.Expr, place: Site) -> Code:
    """`prepare`, noting a 0 without a unit that may be another number in another frame."""
    session = place.session
    around, session.needs = session.needs, Needs()
    try:
        code = prepare(expr, place)
    finally:
        own, session.needs = session.needs, around
        around.on.append(own)
    if code.value is not VARIES or not session.replays:
        return code
    get = code.run

    def run(env: Env) -> Any:
        value = get(env)
        if value.__class__ is float and value == 0.0 and own.varies():
            session.zeros[expr.span.source, expr.span] = expr.span
        return value

    return Code(run)


def folded(codes: Iterable[Code], function: Callable[..., Any], run: Run) -> Code:
    """``run``, or its value where all inputs are constant and nothing is wrong with it."""
    values = [code.value for code in codes]
    if VARIES in values or POISON in values:
        return Code(run)
    if any(_size(value) > _FOLDED for value in values):
        return Code(run)  # work that counts as evaluation steps
    try:
        return constant(function(*values))
    except Problem:
        return Code(run)  # reported when and if it runs


def _size(value: Any) -> int:
    """Count the numbers of a vector, or those that a string counts as; 0 for any other value."""
    if value.__class__ is Vec:
        return int(value.count)
    return len(value) // LETTERS_AS_ITEM if value.__class__ is str else 0


def guarded(
    place: Site,
    function: Callable[..., Any],
    span: Span,
    operands: tuple[tree.Expr | None, ...],
    item_steps: int = ITEM_STEPS,
) -> Callable[..., Any]:
    """``function`` on values: silent on poison, problems reported, its work counted."""
    session = place.session

    def run(*values: Any) -> Any:
        session.steps += GENERAL_STEPS  # the next call or pass looks at the limit
        for value in values:
            if value is POISON:
                return POISON
            if value.__class__ is Vec or value.__class__ is str:
                session.tick(item_steps * _size(value), span)
        try:
            return function(*values)
        except Problem as problem:
            session.steps += 2 * GENERAL_STEPS
            report_problem(session.report, problem, span, operands)
            return POISON

    return run


def computed(
    place: Site,
    function: Callable[..., Any],
    span: Span,
    exprs: Sequence[tree.Expr],
    codes: Sequence[Code] | None = None,
    item_steps: int = ITEM_STEPS,
) -> Code:
    """``function`` of expressions, guarded and folded; they are prepared unless they come as ``codes``."""
    codes = [prepare(expr, place) for expr in exprs] if codes is None else codes
    getters = tuple([code.run for code in codes])
    slow = guarded(place, function, span, tuple(exprs), item_steps)
    if len(getters) == 1:
        get = getters[0]
        return folded(codes, function, lambda env: slow(get(env)))
    return folded(codes, function, lambda env: slow(*[get(env) for get in getters]))


_LITERALS: Final[dict[str, Callable[[float], Any]]] = {
    "deg": lambda value: values.Angle(math.radians(value)),
    "rad": values.Angle,
    "turn": lambda value: values.Angle(value * math.tau),
    "s": values.Time,
    "ms": lambda value: values.Time(value / 1000.0),
}


def prepare_number(expr: tree.NumberLiteral, place: Site) -> Code:
    value = float(expr.value)
    if not math.isfinite(value * math.tau if expr.unit == "turn" else value):
        place.report.error("E0306", "the number is too large", expr.span)
        return POISONED
    return constant(_LITERALS[expr.unit](value) if expr.unit else value)


def prepare_range(expr: tree.Range, place: Site) -> Code:
    def make(start: Any, stop: Any, step: Any = 1.0) -> RangeValue:
        for index, value in enumerate((start, stop, step)):
            if value.__class__ not in values.UNITS:
                raise values.unexpected("a number", value, operand=index)
        (a, ua), (b, ub), (s, us) = values.unpack(start), values.unpack(stop), values.unpack(step)
        kind = values.same_unit(a, ua, b, ub)
        if expr.step is None:
            return RangeValue(a, b, expr.exclusive, None, kind)
        if kind == "angle" and us != "angle":
            raise Problem("E0302", "a bare number as the step of angles", operand=2, fix="angle")
        kind = values.same_unit(b, kind, s, us) if us != kind else kind
        if s == 0.0:
            raise Problem("E0311", "a step of 0", operand=2)
        return RangeValue(a, b, expr.exclusive, s, kind)

    parts = [part for part in (expr.start, expr.stop, expr.step) if part is not None]
    return computed(place, make, expr.span, parts)


def _component(code: Code, name: tree.Name, place: Site, of: tree.Expr) -> Code:
    """``code.name``, a component of a vector."""
    if (index := values.COMPONENTS.get(name.text)) is None:
        help, fix = member_advice(name), None
        if help is None:
            help, fix = did_you_mean(name.text, values.COMPONENTS, name.span)
        help = help or "vectors have .x .y .z, or .r .g .b, or [i]"
        place.report.error("E0212", f"no value has a member `{name.text}`", name.span, help=help, fix=fix)
        return POISONED
    at = index

    def pick(value: Any) -> Any:
        if value.__class__ is not Vec:
            kind = values.describe(value)
            message = f"`.{name.text}` of {kind}, which is not a vector"
            raise Problem("E0301", message, found=kind)
        if at >= len(value.items):
            raise Problem("E0307", f"`.{name.text}` of {values.describe(value)}")
        return value.items[at]

    def run(env: Env) -> Any:
        value = get(env)
        return value.items[at] if value.__class__ is Vec and len(value.items) > at else slow(value)

    get = code.run
    slow = guarded(place, pick, name.span, (of,), item_steps=0)
    return folded([code], pick, run)


def item(value: Any, index: Any) -> Any:
    """``value[index]``."""
    at = number(index, 1)
    if value.__class__ is Vec:
        length = len(value.items)
    elif value.__class__ is RangeValue:
        length = value.count()
    else:
        raise values.unexpected("a vector or a range", value, operand=0)
    if not at.is_integer():
        raise Problem("E0307", f"index {at:.6g} is not a whole number", "round it with floor(…)", 1)
    if not 0 <= at < length:
        where = f"outside 0..{length - 1}" if length else "into an empty vector"
        help = "items are counted from 0; the last is v[len(v) - 1]" if at < 0 else None
        raise Problem("E0307", f"index {at:.0f} is {where}", help, operand=1)
    return value.items[int(at)] if value.__class__ is Vec else value.item(int(at))


_FAST: Final[dict[str, Callable[[Any, Any], Any]]] = {
    **(values.ARITHMETIC | {"/": operator.truediv, "%": operator.mod, "^": math.pow}),
    **(values.COMPARE | {"==": operator.eq, "!=": operator.ne}),
}
"""Operators on two numbers, unless the result is an error or not finite."""
_MEANINGS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    **{op: partial(values.binary, op) for op in values.ARITHMETIC},
    "+": values.add,
    **{op: partial(values.compare, op) for op in values.COMPARE},
    "==": values.equal,
    "!=": lambda a, b: not values.equal(a, b),
}


def prepare_binary(expr: tree.Binary, place: Site) -> Code:
    op = expr.op
    if op in ("&&", "||"):
        return _logic(expr, place)
    codes = [prepare(expr.left, place), prepare(expr.right, place)]
    if op not in _FAST:
        return POISONED  # recovery kept what was written, and reported it
    fast, meaning = _FAST[op], _MEANINGS[op]
    slow = guarded(place, meaning, expr.op_span, (expr.left, expr.right))
    left, right = codes[0].run, codes[1].run

    def arithmetic(env: Env) -> Any:
        a, b = left(env), right(env)
        if a.__class__ is float and b.__class__ is float:
            try:
                result = fast(a, b)
                if result - result == 0.0:
                    return result
            except (ArithmeticError, ValueError):
                pass
        return slow(a, b)

    def compare(env: Env) -> Any:
        a, b = left(env), right(env)
        return fast(a, b) if a.__class__ is float and b.__class__ is float else slow(a, b)

    return folded(codes, meaning, arithmetic if op in values.ARITHMETIC else compare)


def _truth(value: Any, operand: int = 0) -> bool:
    if value.__class__ is bool:
        return value
    help = "compare it with something, as in n != 0" if value.__class__ is float else None
    raise values.unexpected("a boolean", value, help, operand)


def condition(expr: tree.Expr, place: Site) -> Code:
    """A prepared expression that is true, false or poison."""
    code = prepare(expr, place)
    if code.value is True or code.value is False:
        return code
    get = code.run
    slow = guarded(place, _truth, expr.span, (expr,))

    def run(env: Env) -> Any:
        value = get(env)
        return value if value is True or value is False else slow(value)

    return Code(run)


def _logic(expr: tree.Binary, place: Site) -> Code:
    left, right = condition(expr.left, place).run, condition(expr.right, place).run
    decides = expr.op == "||"

    def run(env: Env) -> Any:
        value = left(env)
        return value if value is decides or value is POISON else right(env)

    return Code(run)


def prepare_unary(expr: tree.Unary, place: Site) -> Code:
    if expr.op != "!":
        meaning = values.negate if expr.op == "-" else values.plus
        return computed(place, meaning, expr.span, (expr.operand,))
    truth = condition(expr.operand, place).run

    def invert(env: Env) -> Any:
        value = truth(env)
        return POISON if value is POISON else not value

    return Code(invert)


def prepare_conditional(expr: tree.Conditional, place: Site) -> Code:
    test = condition(expr.condition, place).run
    then, otherwise = prepare(expr.then, place).run, prepare(expr.otherwise, place).run

    def run(env: Env) -> Any:
        value = test(env)
        if value is True:
            return then(env)
        return otherwise(env) if value is False else POISON

    return Code(run)


def value_of(name: tree.Name, binding: Binding, place: Site) -> Code:
    """The value of a variable."""
    slots, slot, report, span = binding.slots, binding.slot, place.report, name.span
    if binding.needs is not None:
        place.session.needs.on.append(binding.needs)
    if slots is None and binding.known:
        return constant(binding.value)
    if binding.kind == "poison" or slots is None:
        return POISONED
    if slots is place.scope.slots:
        if binding.known:
            return constant(binding.value)
        if slots.root is None:
            return Code(lambda env: env[slot])
    root, reach = slots.root, place.scope.reach(slots)

    def run(env: Env) -> Any:
        value = (reach(env) if root is None else root)[slot]
        if value is UNBOUND:
            message = f"`{name.text}` is used before its line has run"
            report.error("E0203", message, span, labels=binding.labels())
            return POISON
        return value

    return Code(run)


def lookup(name: tree.Name, place: Site) -> Binding | None:
    """The binding of a plain or qualified name; None where it is unknown, unreported."""
    alias, dot, rest = name.text.partition(".")
    binding = place.scope.find(alias)
    if not dot:
        return binding
    if binding is None or binding.kind != "import":
        return None
    if binding.value is None:
        return Binding("poison")
    exported: FileContext = binding.value
    result = exported.scope.names.get(rest)
    return None if result is None or result.kind == "import" else result


def wrong_kind(name: tree.Name, binding: Binding, place: Site, wanted: str, help: str | None = None) -> None:
    """Report a name that stands for something else than is wanted here."""
    kinds = {"fn": "a function", "module": "a module", "import": "an imported file", "element": "a geometry"}
    kinds |= {"text": "a module", "width": "a function"}
    message = f"`{name.text}` is {kinds.get(binding.kind, 'a value')}, not {wanted}"
    key = "E0213", message, place.file.source, binding.span
    place.report.error_once(key, "E0213", message, name.span, help=help, labels=binding.labels())


def _as_value(name: tree.Name, binding: Binding, place: Site) -> Code:
    if binding.kind in VALUES or binding.kind == "poison":
        return value_of(name, binding, place)
    called = binding.kind in ("fn", "width")
    wrong_kind(name, binding, place, "a value", f"call it: {name.text}(…)" if called else None)
    return POISONED


def prepare_name(expr: tree.NameRef, place: Site) -> Code:
    binding = place.scope.find(expr.name.text)
    return _own_name(expr.name, place) if binding is None else _as_value(expr.name, binding, place)


def _own_name(name: tree.Name, place: Site) -> Code:
    """A constant of the language or a variable of the animation."""
    text, session = name.text, place.session
    if text in values.CONSTANTS:
        return constant(values.CONSTANTS[text])
    if text not in ANIMATED:
        if text in values.FUNCTIONS:
            message = f"`{text}` is a function, not a value"
            place.report.error("E0213", message, name.span, help=f"call it: {text}(…)")
        else:
            unknown(name, place)
        return POISONED
    if "animate" in place.report.damage(place.file.source).words:
        return POISONED
    index = [*ANIMATED].index(text)
    session.needs.frame |= text != "frames"
    if session.animated[index] is not UNBOUND:
        if text != "frames" and not session.still and not place.file.prefix:
            session.still = True
            help = "make time run: animate(seconds = 2, fps = 24);"
            place.report.warn("W0304", f"`{text}` is 0 in a scene without animate(…)", name.span, help)
        return constant(session.animated[index])

    def run(env: Env) -> Any:
        value = session.animated[index]
        if value is UNBOUND:
            help = "move the line that needs it below animate(…)"
            session.report.error("E0203", f"`{text}` is used before animate(…)", name.span, help=help)
            return POISON
        return value

    return Code(run)


def prepare_member(expr: tree.Member, place: Site) -> Code:
    value = expr.value
    binding = place.scope.find(value.name.text) if isinstance(value, tree.NameRef) else None
    if binding is None or binding.kind != "import":
        code = prepare(value, place)
        return POISONED if code.value is POISON else _component(code, expr.name, place, value)
    name = tree.Name(expr.span, f"{value.span.text}.{expr.name.text}")
    if (result := lookup(name, place)) is not None:
        return _as_value(name, result, place)
    unknown_member(name, place, binding.value)
    return POISONED


def bind(
    report: Reporter,
    name: tree.Name,
    params: Sequence[str],
    required: int,
    args: Sequence[Given],
    definition: tree.Fn | tree.Module | None = None,
    *,
    spread: bool = False,
    help: str | None = None,
) -> list[Given | None] | None:
    """The argument of each parameter, None where it is left out; or None if a mistake was reported.

    Calls of one definition that fail in the same way are places of one report.

    Args:
        required: how many of ``params``, from the left, have to be given.
        definition: what is called, unless the language has it.
        spread: one positional argument may be a vector of all.
        help: advice for a wrong number of arguments; by default the signature.
    """
    bound: list[Given | None] = [None] * len(params)
    called, places = name.text, [param.name for param in definition.params] if definition else []
    shown = help or f"it is called {words.signature(called, params, required)}"
    here = (Label(definition.name.span, "defined here"),) if definition else ()

    def fail(way: str, message: str, span: Span, help: str | None = None, **more: Any) -> None:
        outer, code = definition.name.span if definition else span, more.pop("code", "E0308")
        key = (code, way, outer.source, outer)
        report.error_once(key, code, message, span, help=help, **{"labels": here, **more})

    good, position = True, 0
    for given in args:
        arg, word = given.arg, given.arg.name
        if word is None:
            if position >= len(params):
                takes = "1 argument" if len(params) == 1 else f"{len(params) or 'no'} arguments"
                fail("surplus", f"`{called}` takes {takes}", arg.span, shown if params else help)
                return None
            index = position
            position += 1
        elif word.text in params:
            index = params.index(word.text)
        else:
            good = False
            hint, fix = did_you_mean(word.text, params, word.span, effort=report.effort)
            if hint is None and called in foreign.ARGUMENTS:
                hint, fix = instead(word.text, foreign.ARGUMENTS[called], params, word.span)
            if hint is None and word.text in foreign.LOOKS and isinstance(definition, tree.Module):
                hint = f"its block has the colour: {called}(…) {{ material flat {{ color(#d33); }} }}"
            hint = hint or (f"its arguments are {listing(params)}" if params else "it takes no arguments")
            message = f"`{called}` has no argument `{word.text}`"
            fail(word.text, message, word.span, hint, fix=fix, code="E0206")
            continue
        if (earlier := bound[index]) is None:
            bound[index] = given
            continue
        labels = (Label(earlier.arg.span, "first given here"), *here)
        message = f"argument `{params[index]}` of `{called}` is given twice"
        fail(f"twice {index}", message, arg.span, labels=labels)
        good = False
    if not good:
        return None
    missing = [at for at in range(required) if bound[at] is None]
    if missing and not (spread and len(args) == 1 and args[0].arg.name is None):
        names = " and ".join(f"`{params[at]}`" for at in missing)
        needy = tuple([Label(places[at].span, "needs a value") for at in missing]) if places else here
        fail(f"missing {names}", f"`{called}` needs {names}", name.span, shown, labels=needy)
        return None
    return bound


def prepare_call(expr: tree.CallExpr, place: Site) -> Code:
    name = expr.name
    binding = lookup(name, place)
    given = prepare_arguments(expr.args, place, name.text if binding is None else "")
    if binding is None:
        return _call_builtin(expr, given, place)
    if binding.kind == "poison":
        return POISONED
    if binding.kind == "width":
        return binding.value(expr, given, place) or POISONED
    if binding.kind != "fn":
        help = "a module makes objects and is called as a statement" if binding.kind == "module" else None
        wrong_kind(name, binding, place, "a function", help)
        return POISONED
    definition: Definition = binding.value
    if (enter := entering(name, given, definition, place)) is None:
        return POISONED
    session = place.session

    def run(env: Env) -> Any:
        before = session.report.calls
        frame = enter(env)
        value = definition.run(frame)
        session.report.calls = before
        session.depth -= 1
        return value

    return Code(run)


def _call_builtin(expr: tree.CallExpr, given: list[Given], place: Site) -> Code:
    """A call of a function of the language; reports a name that stands for nothing."""
    name = expr.name
    if (word := words.FUNCTIONS.get(name.text)) is None:
        alias, dot, rest = name.text.partition(".")
        outer = place.scope.find(alias) if dot else None
        if outer is None:
            unknown(name, place, expr)
        elif outer.kind == "import":
            unknown_member(name, place, outer.value)
        else:  # `v.length()`: a value has no functions
            last = tree.Name(Span(name.span.source, name.span.end - len(rest), expr.span.end), rest)
            help = member_advice(last) or f"write {rest}(…) with the value as an argument"
            place.report.error("E0128", "only a name can be called", name.span, help=help)
        return POISONED
    if word.variadic:
        if not given or any(arg.name for arg, _ in given):
            message = f"`{name.text}` takes one or more arguments without names"
            place.report.error("E0308", message, name.span)
            return POISONED
    else:
        if (bound := bind(place.report, name, word.params, word.required, given)) is None:
            return POISONED
        given = [one for one in bound if one is not None]
    exprs = [arg.value for arg, _ in given]
    meaning = values.FUNCTIONS[name.text]
    if name.text == "hsv":
        meaning = _doubted(meaning, exprs[0].span, place)
    place.file.weight += limits.FUNCTIONS.get(name.text, 4 * len(given) if word.variadic else 0)
    per_item = 0 if name.text == "len" else limits.FUNCTION_ITEM_STEPS
    return computed(place, meaning, expr.span, exprs, [code for _, code in given], per_item)


def _doubted(hsv: Callable[..., Any], span: Span, place: Site) -> Callable[..., Any]:
    """``hsv``, which warns of a hue that looks like degrees."""

    def run(h: Any, s: Any, v: Any) -> Any:
        result = hsv(h, s, v)
        if h.__class__ is float and abs(h) > 2.0:
            turns = values.show(h)
            help = f"a bare hue is in turns: write {turns}deg, multiply what is computed by 1deg, or take % 1"
            place.report.warn("W0302", f"a hue of {turns} turns", span, help)
        return result

    return run


def entering(name: tree.Name, args: Sequence[Given], definition: Definition, place: Site) -> Run | None:
    """Function that counts a call and makes its slots; None if the arguments do not fit.

    The caller puts the session's depth and calls back.
    """
    params = definition.node.params
    session, span = place.session, name.span
    session.needs.on.append(definition.needs)
    required = sum(param.default is None for param in params)
    bound = bind(session.report, name, [p.name.text for p in params], required, args, definition.node)
    if bound is None:
        return None
    given = [None if one is None else one.code.run for one in bound]
    link = place.scope.reach(definition.outer)

    def enter(env: Env) -> Env:
        session.depth += 1
        if session.depth > MAX_DEPTH:
            raise session.halt("E0321", f"calls nested deeper than {MAX_DEPTH}", span)
        session.tick(definition.weight, span)
        frame: Env = [UNBOUND] * definition.size
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
