"""A way to run text, which the tests of evaluation share."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.library import SpanMap
from scenelang.language.scene import Scene


@dataclass
class Outcome:
    """A run's scene and what was found."""

    scene: Scene | None
    spans: SpanMap
    diagnostics: Diagnostics

    @property
    def codes(self) -> list[str]:
        return [d.code for d in self.diagnostics]

    def good(self) -> Scene:
        assert self.scene is not None, [(d.code, d.message, d.span and d.span.text) for d in self.diagnostics]
        return self.scene

    def only(self) -> Diagnostic:
        assert len(self.diagnostics) == 1, [(d.code, d.message) for d in self.diagnostics]
        return self.diagnostics.items[0]


def run_text(text: str, *, name: str = "test.nsg", **options: Any) -> Outcome:
    """Evaluate text."""
    found = Diagnostics()
    frame = options.pop("frame", 0)
    scene, spans = Source(text=SourceFile(name, text), **options).scene(found, frame)
    return Outcome(scene, spans, found)


def value(expression: str) -> float:
    """The number that an expression has, from the x of a translation."""
    scene = run_text(f"square {{ translate({expression}, 0); }}").good()
    return transform(scene).x  # type: ignore[no-any-return]


def transform(scene: Scene, node: int = 0, index: int = 0) -> Any:
    """A transform of a top-level node."""
    return scene.nodes[node].transforms[index]


_MARK = re.compile(r"//! (.*)$")
_ONE = re.compile(r"([EW]\d{4})(?: `([^`]*)`)?")


def expected(text: str) -> list[tuple[int, str, str | None]]:
    """Line, code and underlined text of each ``//! E0201 `name` `` comment."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        mark = _MARK.search(line)
        if mark:
            found += [(number, code, words or None) for code, words in _ONE.findall(mark.group(1))]
    return found


def mismatch(text: str, diagnostics: Diagnostics) -> str:
    """How what was found differs from the marks in ``text``; empty if it does not."""
    wanted = expected(text)
    problems = []
    for d in diagnostics:
        line = d.span.locate()[0][0] if d.span else 0
        words = d.span.text if d.span else ""
        match = next((w for w in wanted if w[:2] == (line, d.code) and w[2] in (None, words)), None)
        if match is None:
            problems.append(f"unexpected at line {line}: {d.code} `{words}` {d.message}")
        else:
            wanted.remove(match)
    problems += [f"missing at line {line}: {code} `{words}`" for line, code, words in wanted]
    return "\n".join(problems)


HERE = Path(__file__).parent
