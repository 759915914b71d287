"""Checks of several scenes together, and their texts after all fixes."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from pathlib import Path

from scenelang.assets.records import Record
from scenelang.cli.inputs import STDIN, Request, merged, read_input, read_text, unused_defines
from scenelang.compiler.check import Frames, check_evaluated
from scenelang.language.diagnostics import Diagnostic, Diagnostics, Settled, SourceFile, settle
from scenelang.language.session import Defines


class Selection(Record):
    """A choice of warnings by code; errors always count."""

    # codes, or beginnings of codes, of the warnings that are wanted; empty for all
    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()  # of the warnings that are not

    def keeps(self, diagnostic: Diagnostic) -> bool:
        code = diagnostic.code
        if diagnostic.severity == "error":
            return True
        return code.startswith(self.select or ("W",)) and not (self.ignore and code.startswith(self.ignore))


class Scenes(Record, frozen=False):
    """The scenes of a command line."""

    request: Request  # what holds for all of them
    selection: Selection = field(default_factory=Selection)
    frames: Frames = "some"  # those that are checked
    # their texts, by the names that the user wrote
    sources: dict[str, SourceFile] = field(default_factory=dict)
    # diagnostics of files that are not text
    unread: Diagnostics = field(default_factory=Diagnostics)
    names: dict[str, str] = field(default_factory=dict)
    """The names by the files' places on the disk."""
    unseen: int = 0
    """The number of frames that were left out, as they exceed the limits of one scene."""

    def read(self, name: str) -> None:
        """Read a scene, once under any name; raises `OSError` where it cannot be opened."""
        place = _place(name)
        if place in self.names:
            return
        source = read_text(name, self.unread)
        if source is not None:
            self.sources[name] = source
            self.names[place] = name

    def check(self) -> Diagnostics:
        """All diagnostics of the scenes."""
        return self._check(self.sources, {})

    def _check(self, sources: Mapping[str, SourceFile], texts: Mapping[Path, str]) -> Diagnostics:
        # `Defines` record the params that they were used for, so each round needs its own.
        given = self.request.source
        own = replace(given, params=Defines(given.values), texts=texts)
        request = replace(self.request, source=own)
        parts, self.unseen = [self.unread.items], 0
        for name, source in sources.items():
            result = read_input(name, request, text=source)
            facts = result.tree, result.evaluation, result.scene, result.spans, result.diagnostics
            self.unseen += check_evaluated(*facts, frames=self.frames)
            parts.append(result.diagnostics.items)
        parts.append(unused_defines(request))
        every = merged(parts)
        every.items[:] = [d for d in every.items if self.selection.keeps(d)]
        return every

    def owner(self, diagnostic: Diagnostic) -> str | None:
        """The name of the scene that a diagnostic is in; None for an import that was not named."""
        if diagnostic.span is None:
            return None
        name = diagnostic.span.source.name
        return self.names.get(STDIN if name == "<stdin>" else _place(name))

    def fix(self) -> Settled[str]:
        """The texts after all fixes, by the names that the user wrote, and the diagnostics that are left.

        Of imported files only those change that were named too.
        """

        def check(texts: Mapping[str, str]) -> Iterable[tuple[str | None, Diagnostic]]:
            sources = {name: SourceFile(self.sources[name].name, text) for name, text in texts.items()}
            inside = {Path(_place(name)): text for name, text in texts.items() if name != STDIN}
            return [(self.owner(d), d) for d in self._check(sources, inside)]

        return settle({name: source.text for name, source in self.sources.items()}, check)


def _place(name: str) -> str:
    return name if name == STDIN else os.path.realpath(name)
