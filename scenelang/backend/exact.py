"""Scenes drawn by the exact definition; imports no torch."""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.graph.lower import Spans, lower
from scenelang.image import Image
from scenelang.program.compile import find_model
from scenelang.reference.image import reference_image
from scenelang.scene.schema import Scene


def draw_exact(
    scene: Scene,
    *,
    spans: Spans | None = None,
    diagnostics: Diagnostics | None = None,
    model: str | None = None,
) -> Image:
    """Draw a scene from its graph as written, before any pass.

    Args:
        model: take names from this model instead of the one the scene names.

    Raises:
        SceneError: the scene uses what its model does not have.
    """
    found = diagnostics if diagnostics is not None else Diagnostics()
    before = len(found.errors)
    manifest = find_model(scene, found, model=model, spans=spans)
    graph = lower(scene, manifest, spans, found) if manifest is not None else None
    if graph is None or len(found.errors) > before:
        raise SceneError(found)
    return reference_image(graph)
