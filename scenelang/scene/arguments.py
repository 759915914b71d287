"""Which argument goes to which parameter."""

from __future__ import annotations

from collections.abc import Sequence

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.scene.session import Session
from scenelang.scene.unknown import told_at_definition
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
    definition: Span | None = None,
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
        definition: where what is called was defined.
        places: where its parameters were.

    Returns:
        One entry a parameter, or None if a mistake was reported.
    """
    bound: Bound = [None] * len(params)
    shown = help or f"it is called {signature(name, params, optional)}"
    labels: tuple[Label, ...] = (Label(definition, "defined here"),) if definition else ()
    good, position = True, 0
    for arg in args:
        if arg.name is None:
            if position >= len(params):
                takes = "1 argument" if len(params) == 1 else f"{len(params) or 'no'} arguments"
                message = f"'{name}' takes {takes}"
                session.error("E0308", message, arg.span, help=shown if params else help, labels=labels)
                return None
            index = position
            position += 1
        elif arg.name.text in params:
            index = list(params).index(arg.name.text)
        elif told_at_definition(
            session,
            arg.name.text,
            arg.name.span.source,
            [(param, place, "argument") for param, place in zip(params, places, strict=False)],
        ):
            good = False
            continue
        else:
            hint, fix = did_you_mean(arg.name.text, params, arg.name.span)
            hint = hint or (f"its arguments are {listing(params)}" if params else "it takes no arguments")
            session.error(
                "E0206",
                f"'{name}' has no argument '{arg.name.text}'",
                arg.name.span,
                help=hint,
                fix=fix,
                labels=labels,
            )
            good = False
            continue
        earlier = bound[index]
        if earlier is not None:
            session.error(
                "E0308",
                f"argument '{params[index]}' of '{name}' is given twice",
                arg.span,
                labels=(Label(earlier.span, "first given here"), *labels),
            )
            good = False
            continue
        bound[index] = arg
    if not good:
        return None
    if spread and len(args) == 1 and args[0].name is None:
        return bound
    missing = [p for p, may, arg in zip(params, optional, bound, strict=True) if not may and arg is None]
    if missing:
        names = " and ".join(f"'{p}'" for p in missing)
        if places:
            labels = tuple([Label(places[list(params).index(p)], "needs a value") for p in missing])
        session.error("E0308", f"'{name}' needs {names}", span, help=shown, labels=labels)
        return None
    return bound
