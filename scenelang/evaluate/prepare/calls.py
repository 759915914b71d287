"""Calls of functions, the language's own and those that a scene defines, and which argument goes where."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from scenelang import words
from scenelang.diagnostics.diagnostic import Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, instead, listing
from scenelang.evaluate import costs
from scenelang.evaluate.file_context import Place
from scenelang.evaluate.limits import MAX_DEPTH
from scenelang.evaluate.names import UNBOUND, Definition, Env
from scenelang.evaluate.prepare.expressions import POISONED, Code, Given, Run, computed, prepare_arguments
from scenelang.evaluate.prepare.references import lookup, wrong_kind
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Reporter
from scenelang.evaluate.report.undefined import (
    unknown,
    unknown_member,
)
from scenelang.evaluate.values.functions import FUNCTIONS, doubt_hue
from scenelang.scene.spans import Calls
from scenelang.syntax import nodes


def signature(name: str, params: Sequence[str], required: int) -> str:
    """How a call looks, for help texts: ``translate(x, y[, z])``."""
    text = ", ".join(params[:required])
    for param in params[required:]:
        text += f"[, {param}]" if text else f"[{param}]"
    return f"{name}({text})"


def bind(
    report: Reporter,
    name: nodes.Name,
    params: Sequence[str],
    required: int,
    args: Sequence[Given],
    definition: nodes.Fn | nodes.Module | None = None,
    *,
    spread: bool = False,
    help: str | None = None,
) -> list[Given | None] | None:
    """The argument of each parameter, None where it is left out; or None if a mistake was reported.

    Calls of one definition that fail in the same way are places of one report.

    Args:
        required: how many of ``params``, from the left, have to be given.
        args: arguments as written; positional ones fill the parameters in order.
        definition: what is called, unless the language has it.
        spread: one positional argument may be a vector of all.
        help: advice for a wrong number of arguments; by default the signature.
    """
    bound: list[Given | None] = [None] * len(params)
    called, places = name.text, [param.name for param in definition.params] if definition else []
    shown = help or f"it is called {signature(called, params, required)}"
    here = (Label(definition.name.span, "defined here"),) if definition else ()

    def fail(
        way: str,
        message: str,
        span: Span,
        help: str | None = None,
        fix: Fix | None = None,
        code: str = "E0308",
        labels: tuple[Label, ...] = here,
    ) -> None:
        outer = definition.name.span if definition else span
        report.error_once(
            (code, way, outer.source, outer), code, message, span, help=help, fix=fix, labels=labels
        )

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
            if hint is None and called in foreign_words.ARGUMENTS:
                hint, fix = instead(word.text, foreign_words.ARGUMENTS[called], params, word.span)
            if hint is None and word.text in foreign_words.LOOKS and isinstance(definition, nodes.Module):
                hint = f"its block has the colour: {called}(…) {{ material flat {{ color(#d33); }} }}"
            hint = hint or (f"its arguments are {listing(params)}" if params else "it takes no arguments")
            message = f"`{called}` has no argument `{word.text}`"
            fail(word.text, message, word.span, hint, fix, "E0206")
            continue
        earlier = bound[index]
        if earlier is None:
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


def prepare_call(expr: nodes.CallExpr, place: Place) -> Code:
    name = expr.name
    binding = lookup(name, place)
    given = prepare_arguments(expr.args, place, name.text if binding is None else "")
    if binding is None:
        return _call_builtin(expr, given, place)
    if binding.kind == "poison":
        return POISONED
    if binding.kind != "fn":
        help = "a module makes objects and is called as a statement" if binding.kind == "module" else None
        wrong_kind(name, binding, place, "a function", help)
        return POISONED
    definition: Definition = binding.value
    enter = entering(name, given, definition, place)
    if enter is None:
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


def _call_builtin(expr: nodes.CallExpr, given: list[Given], place: Place) -> Code:
    """A call of a function of the language; reports a name that stands for nothing."""
    name = expr.name
    word = words.FUNCTIONS.get(name.text)
    if word is None:
        alias, dot, _ = name.text.partition(".")
        outer = place.scope.find(alias) if dot else None
        if outer is None:
            unknown(name, place, expr)
        elif outer.kind == "import":
            unknown_member(name, place, outer.value)
        else:
            _method(expr, place)
        return POISONED
    if word.variadic:
        if not given or any(arg.name for arg, _ in given):
            message = f"`{name.text}` takes one or more arguments without names"
            place.report.error("E0308", message, name.span)
            return POISONED
    else:
        bound = bind(place.report, name, word.params, word.required, given)
        if bound is None:
            return POISONED
        given = [one for one in bound if one is not None]
    exprs = [arg.value for arg, _ in given]
    meaning = _doubted_hsv(exprs, place) if name.text == "hsv" else FUNCTIONS[name.text]
    place.file.weight += costs.FUNCTIONS.get(name.text, 4 * len(given) if word.variadic else 0)
    per_item = 0 if name.text == "len" else costs.FUNCTION_ITEM_STEPS
    return computed(place, meaning, expr.span, exprs, [code for _, code in given], per_item)


def _method(expr: nodes.CallExpr, place: Place) -> None:
    """Report `v.length()`: a value has no functions."""
    rest, source = expr.name.text.partition(".")[2], expr.name.span.source
    from scenelang.evaluate.report.advice import member_advice  # only mistakes need it

    last = nodes.Name(Span(source, expr.name.span.end - len(rest), expr.span.end), rest)
    help = member_advice(last) or f"write {rest}(…) with the value as an argument"
    place.report.error("E0128", "only a name can be called", expr.name.span, help=help)


def _doubted_hsv(exprs: Sequence[nodes.Expr], place: Place) -> Callable[..., Any]:
    """``hsv``, which warns of doubtful values."""

    def run(*values: Any) -> Any:
        result, doubt = FUNCTIONS["hsv"](*values), doubt_hue(*values)
        if doubt is not None:
            place.report.warn(doubt.code, doubt.message, exprs[0].span, doubt.help)
        return result

    return run


def entering(name: nodes.Name, args: Sequence[Given], definition: Definition, place: Place) -> Run | None:
    """How to make the slots of one call, which also counts it; None if the arguments do not fit.

    When the call is over, the caller takes 1 from the session's depth and puts its calls back.
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
