"""How a call does not fit what it calls."""

from __future__ import annotations

from dataclasses import dataclass

from scenelang.diagnostics.diagnostic import Fix, Label
from scenelang.diagnostics.span import Span


@dataclass(frozen=True, slots=True)
class Misfit:
    """How a call fails.

    Args:
        code: code of the diagnostic.
        way: what tells it from other ways to fail: calls that share it are told together.
        message: the fact about one call.
        call: the call's name.
        span: where the call shows it.
        everywhere: what is added to the message where all calls fail so.
        here: words for the place of a call where several are told together.
        help: advice.
        fix: a safe change of this call.
        labels: further places.
        blamed: the place in the definition that the call disagrees with; by default its name.
    """

    code: str
    way: tuple[str, ...]
    message: str
    call: Span
    span: Span
    everywhere: str
    here: str
    help: str | None = None
    fix: Fix | None = None
    labels: tuple[Label, ...] = ()
    blamed: Span | None = None
