"""Which argument goes to which parameter."""

from __future__ import annotations

from collections.abc import Sequence

from scenelang.diagnostics.diagnostic import Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.evaluate.prepare.expressions import Given
from scenelang.evaluate.report.reporter import Reporter
from scenelang.evaluate.report.undefined import advise_parameter, reported_at_definition
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
    """The argument of each parameter, None where it is left out.

    Calls of one definition that fail in the same way are places of one report.

    Args:
        report: where mistakes are reported.
        name: what is called.
        params: parameter names in order.
        required: how many of them, from the left, have to be given.
        args: arguments as written; positional ones fill the parameters in order.
        definition: what is called, unless the language has it.
        spread: one positional argument may be a vector of all.
        help: advice for a wrong number of arguments; by default the signature.

    Returns:
        One entry a parameter, or None if a mistake was reported.
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
        key = code, way, outer.source, outer
        known = report.shared.get(key)
        if known is not None and known.code != code:
            advise_parameter(report, known, outer)
            return
        report.error_once(key, code, message, span, help=help, fix=fix, labels=labels)

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
            formal = [(param.text, param.span, "argument") for param in places]
            if not reported_at_definition(report, word.text, word.span.source, formal):
                hint, fix = did_you_mean(word.text, params, word.span, effort=report.effort)
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
