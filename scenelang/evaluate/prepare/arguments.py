"""Which argument goes to which parameter."""

from __future__ import annotations

from collections.abc import Sequence

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.evaluate.report.bad_calls import report_misfit
from scenelang.evaluate.report.mismatch import Misfit
from scenelang.evaluate.report.undefined import told_at_definition
from scenelang.evaluate.session import Session
from scenelang.syntax import nodes

Bound = list[nodes.Argument | None]


def signature(name: str, params: Sequence[str], optional: Sequence[bool]) -> str:
    """How a call looks, for help texts: ``translate(x, y[, z])``."""
    text = ""
    for param, is_optional in zip(params, optional, strict=True):
        word = f", {param}" if text else param
        text += f"[{word}]" if is_optional else word
    return f"{name}({text})"


def bind(
    session: Session,
    name: str,
    params: Sequence[str],
    optional: Sequence[bool],
    args: Sequence[nodes.Argument],
    span: Span,
    *,
    spread: bool = False,
    help: str | None = None,
    definition: nodes.Fn | nodes.Module | None = None,
    places: Sequence[Span] = (),
) -> Bound | None:
    """The argument of each parameter, None where it is left out.

    Args:
        session: where mistakes are reported.
        name: what is called.
        params: parameter names in order.
        optional: whether each may be left out.
        args: arguments as written; positional ones fill the parameters in order.
        span: the call's name, for what is missing.
        spread: one positional argument may be a vector of all.
        help: advice for a wrong number of arguments; by default the signature.
        definition: what is called, unless the language has it.
        places: where its parameters were.

    Returns:
        One entry a parameter, or None if a mistake was reported.
    """
    bound: Bound = [None] * len(params)
    indices = {param: at for at, param in enumerate(params)}
    shown = help or f"it is called {signature(name, params, optional)}"
    labels: tuple[Label, ...] = (Label(definition.name.span, "defined here"),) if definition else ()
    good, position = True, 0
    for arg in args:
        if arg.name is None:
            if position >= len(params):
                takes = "1 argument" if len(params) == 1 else f"{len(params) or 'no'} arguments"
                surplus = Misfit(
                    "E0308",
                    ("surplus",),
                    f"`{name}` takes {takes}",
                    span,
                    arg.span,
                    everywhere="but all its calls give more",
                    here="surplus",
                    help=shown if params else help,
                    labels=labels,
                )
                report_misfit(session.report, surplus, definition)
                return None
            index = position
            position += 1
        elif arg.name.text in indices:
            index = indices[arg.name.text]
        elif told_at_definition(
            session.report,
            arg.name.text,
            arg.name.span.source,
            [(param, place, "argument") for param, place in zip(params, places, strict=False)],
        ):
            good = False
            continue
        else:
            hint, fix = did_you_mean(arg.name.text, params, arg.name.span, effort=session.report.effort)
            hint = hint or (f"its arguments are {listing(params)}" if params else "it takes no arguments")
            foreign = Misfit(
                "E0206",
                ("foreign", arg.name.text),
                f"`{name}` has no argument `{arg.name.text}`",
                span,
                arg.name.span,
                everywhere="but all its calls give it",
                here=f"no argument `{arg.name.text}`",
                help=hint,
                fix=fix,
                labels=labels,
            )
            report_misfit(session.report, foreign, definition)
            good = False
            continue
        earlier = bound[index]
        if earlier is not None:
            twice = Misfit(
                "E0308",
                ("twice", params[index]),
                f"argument `{params[index]}` of `{name}` is given twice",
                span,
                arg.span,
                everywhere="in all its calls",
                here="given twice",
                labels=(Label(earlier.span, "first given here"), *labels),
            )
            report_misfit(session.report, twice, definition)
            good = False
            continue
        bound[index] = arg
    if not good:
        return None
    if spread and len(args) == 1 and args[0].name is None:
        return bound
    missing = [p for p, may, arg in zip(params, optional, bound, strict=True) if not may and arg is None]
    if missing:
        names = " and ".join(f"`{p}`" for p in missing)
        needy = [places[indices[p]] for p in missing] if places else []
        if needy:
            labels = tuple([Label(place, "needs a value") for place in needy])
        lacking = Misfit(
            "E0308",
            ("missing", *missing),
            f"`{name}` needs {names}",
            span,
            span,
            everywhere=f"but no call gives {'them' if missing[1:] else 'it'}",
            here=f"{names} not given",
            help=shown,
            labels=labels,
            blamed=needy[0] if needy else None,
        )
        report_misfit(session.report, lacking, definition)
        return None
    return bound
