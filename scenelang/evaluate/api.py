"""Scenes from files and text, for callers in Python."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.evaluation import load_scene, load_source
from scenelang.scene.schema import Scene


def load(
    path: str | os.PathLike[str],
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    frame: int = 0,
    size: tuple[int, int] | None = None,
    diagnostics: Diagnostics | None = None,
    **values: Any,
) -> Scene:
    """Read a scene file: ``load("chain.nsg", k=0.9)``.

    Args:
        path: the file.
        params: values for params whose names are not Python identifiers (``lib.k``) or clash with an
            argument here.
        model: render with this model instead of the one that the file names.
        root: folder that imports cannot leave; by default the file's.
        frame: frame of the animation, from 0.
        size: canvas in pixels instead of the scene's.
        diagnostics: collects what is found, warnings too.
        **values: values for params: numbers, booleans, sequences, or text as after ``-D NAME=``, which
            is how angles (``"30deg"``) and colours (``"#d33"``) are written.

    Returns:
        The Scene.

    Raises:
        SceneError: the scene has errors; it carries all diagnostics.
        ValueError: ``size`` is not a canvas.
        OSError: the file cannot be opened.
    """
    found = diagnostics if diagnostics is not None else Diagnostics()
    scene, _ = load_scene(
        path, diagnostics=found, defines={**(params or {}), **values}, root=root, model=model, frame=frame
    )
    return _sound(scene, found, size)


def loads(
    text: str,
    *,
    params: Mapping[str, Any] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    frame: int = 0,
    size: tuple[int, int] | None = None,
    diagnostics: Diagnostics | None = None,
    name: str = "<text>",
    **values: Any,
) -> Scene:
    """Read scene text; as `load`. Imports are found in ``root`` and refused without it.

    Args:
        text: the scene.
        name: what diagnostics call it.
    """
    found = diagnostics if diagnostics is not None else Diagnostics()
    scene, _ = load_source(
        SourceFile(name, text),
        diagnostics=found,
        defines={**(params or {}), **values},
        root=root,
        model=model,
        frame=frame,
    )
    return _sound(scene, found, size)


def _sound(scene: Scene | None, found: Diagnostics, size: tuple[int, int] | None) -> Scene:
    if scene is None:
        raise SceneError(found)
    return scene if size is None else scene.sized(size)
