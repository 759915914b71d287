"""What comes from outside: values for params, and all else that an evaluation takes besides its text."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, TypedDict

from scenelang.diagnostics.diagnostic import Diagnostics, Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import listing, nearest
from scenelang.evaluate.session import Watch
from scenelang.models.manifest import Manifest
from scenelang.records import Record


class Defines(Record, frozen=False):
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


class Inputs(TypedDict, total=False):
    """What an evaluation takes besides a text; all of it may be left out.

    Args:
        defines: values for params: text as after ``-D NAME=``, or Python values. `Defines` may be shared by
            several evaluations; the caller then reports what none of them used.
        models: manifests that names are taken from; by default those of all shipped models.
        model: name of the model to use, instead of the one that the file names.
        root: folder that imports cannot leave; by default that of ``path``.
        path: file that the text was read from.
        frame: frame of the animation, from 0; the first that is run where there are several.
        texts: what imported files hold, by their resolved paths, instead of what is on the disk.
        watch: is shown every name's value and every node; see `Session`.
        fps: frames a second, instead of those that ``animate`` names.
        replays: run what no frame changes once.
    """

    defines: Mapping[str, Any] | Defines | None
    models: Iterable[Manifest] | None
    model: str | None
    root: str | os.PathLike[str] | None
    path: Path | None
    frame: int
    texts: Mapping[Path, str] | None
    watch: Watch | None
    fps: float | None
    replays: bool
