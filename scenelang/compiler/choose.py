"""The model for a scene: the one that is asked for, the one it names, or the usual one of its dimension."""

from __future__ import annotations

from scenelang.language.scene import Brought, Chain, Object, Scene, SceneNode
from scenelang.language.words import STAGE, dimension_of


def scene_dimension(scene: Scene) -> int:
    """The dimension of a scene, 2 or 3: by its first geometry, else 3 where it has a stage."""
    brought = Brought.of(scene.elements).geometries
    stack: list[SceneNode] = list(reversed(scene.nodes))
    while stack:
        node = stack.pop()
        if isinstance(node, Object):
            element = brought.get(node.geometry)
            dimension = dimension_of(node.geometry) if element is None else element.dimension
            if dimension is not None:
                return dimension
        else:
            links = [link.node for link in node.children] if isinstance(node, Chain) else list(node.children)
            stack += links[::-1]
    return 3 if any(getattr(scene, word) != "default" for word in STAGE) else 2


def why_chosen(scene: Scene | None, asked: bool) -> str:
    """Reason for the model that draws a scene; ``asked`` says whether the command line named it."""
    if asked:
        return "by --model"
    named = scene is not None and scene.model is not None
    return "named by the scene" if named else "the usual one of its dimension"
