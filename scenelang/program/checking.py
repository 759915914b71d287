"""Mistakes and fixes for callers in Python: `check`, `check_text` and `fix_text`; imports no numpy."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics
from scenelang.diagnostics.fixes import settle
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.evaluate.evaluation import Evaluation, in_file_order
from scenelang.evaluate.loader import Unreadable, read_source
from scenelang.program.check import Frames, check_evaluated
from scenelang.syntax import parse


def check(
    path: str | os.PathLike[str],
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    all_frames: bool = False,
) -> Diagnostics:
    """Everything there is to say of a scene file, as ``scenelang check`` says it.

    Args:
        path: the file.
        params: values for params, as for `scenelang.load`.
        model: check for this model instead of the one that the file names.
        root: folder that imports cannot leave; by default the file's.
        all_frames: look at all frames of an animation, not only at the first, second, middle and last one.

    Returns:
        Errors and warnings by their place; empty where there are none.

    Raises:
        OSError: the file cannot be opened.
    """
    name = os.fspath(path)
    try:
        source = read_source(Path(path), name)
    except Unreadable as error:
        found = Diagnostics()
        found.add(error.code, f"cannot read `{name}`: {error}", Span(SourceFile(name, ""), 0, 0))
        return found
    return _look(source, Path(path), params, model, root, all_frames)


def check_text(
    text: str,
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    all_frames: bool = False,
    name: str = "<text>",
) -> Diagnostics:
    """Everything there is to say of scene text; as `check`. Imports are found in ``root`` alone.

    Args:
        text: the scene.
        name: what diagnostics call it.
    """
    return _look(SourceFile(name, text), None, params, model, root, all_frames)


def fix_text(
    text: str,
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    name: str = "<text>",
) -> tuple[str, Diagnostics]:
    """Scene text after all safe fixes, and what is left, as ``scenelang check --fix`` has them.

    Args:
        text, params, model, root, name: as for `check_text`.
    """

    def look(texts: Mapping[str, str]) -> Iterable[tuple[str | None, Diagnostic]]:
        found = _look(SourceFile(name, texts[name]), None, params, model, root, False)
        return [(name if d.span is not None and d.span.source.name == name else None, d) for d in found]

    settled = settle({name: text}, look)
    left = Diagnostics()
    left.items.extend(d for _, d in settled.left)
    return settled.texts[name], left


def _look(
    source: SourceFile,
    path: Path | None,
    params: Mapping[str, Any] | None,
    model: str | None,
    root: str | os.PathLike[str] | None,
    all_frames: bool,
) -> Diagnostics:
    found = Diagnostics()
    tree = parse(source, found)
    folder = None if root is None else Path(root)
    evaluation = Evaluation(
        tree, diagnostics=found, defines=params, model=model, root=folder, path=path, replays=True
    )
    scene, spans = evaluation.run(0)
    frames: Frames = "all" if all_frames else "some"
    check_evaluated(
        tree, evaluation, None if found.errors else scene, spans, found, model=model, frames=frames
    )
    found.items[:] = in_file_order(found.items)
    return found
