"""Values that come from outside for params."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scenelang.diagnostics.diagnostic import Diagnostics, Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import listing, nearest


@dataclass(slots=True)
class Defines:
    """Values for params from outside, and the params that files have.

    Args:
        values: text as after ``-D NAME=``, or a Python value.
        known: where each param stands, by its name seen from the first file.
        lost: words that recovery skipped: a param may have been among them.
    """

    values: Mapping[str, Any]
    known: dict[str, Span] = field(default_factory=dict)
    lost: set[str] = field(default_factory=set)

    def report_unused(self, diagnostics: Diagnostics) -> None:
        """Report values that no param takes."""
        for name in self.values:
            if name in self.known or name in self.lost:
                continue
            found = nearest(name, self.known)
            if found:
                help, labels = f"did you mean `{found}`?", [Label(self.known[found], "this param")]
            else:
                names = listing(self.known)
                help, labels = f"its params are {names}" if names else "the scene has no params", []
            diagnostics.add("E0211", f"no param `{name}` to set", None, help=help, labels=labels)
