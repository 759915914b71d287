"""The model for a scene that names none: the most exact of the smallest that fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from scenelang.models.manifest import Manifest
from scenelang.scene.schema import Chain, Object, Scene, SceneNode

WHITE = (1.0, 1.0, 1.0)


def choose_model(scene: Scene, models: Iterable[Manifest]) -> Manifest | None:
    """The smallest of ``models`` that has every name the scene uses and draws its canvas.

    Args:
        scene: a scene; if it names a model, only that one fits.
        models: manifests to choose from.

    Returns:
        The fitting manifest with the fewest geometries, then the fewest other words, then the least measured
        error, then the first by name; None if none fits.
    """
    geometries, materials, transforms, operations = names_used(scene)
    fitting = [
        m
        for m in models
        if scene.model in (None, m.name)
        and geometries.issubset(m.geometries)
        and materials.issubset(m.materials)
        and transforms.issubset(m.transforms)
        and operations.issubset(m.material_ops)
        and paints(m, scene)
    ]
    return min(fitting, key=_size, default=None)


def best_of_sets(models: Iterable[Manifest]) -> list[Manifest]:
    """Of models that share a set, the one of the least error; they know the same names."""
    best: dict[str, Manifest] = {}
    for model in sorted(models, key=_size):
        best.setdefault(model.set or model.name, model)
    return list(best.values())


def paints(model: Manifest, scene: Scene) -> bool:
    """Whether a model draws a scene's canvas and background."""
    return not (model.sizes and scene.canvas not in model.sizes) and not (
        model.white and scene.background != WHITE
    )


def _size(model: Manifest) -> tuple[int, int, float, str]:
    others = len(model.materials) + len(model.transforms) + len(model.material_ops)
    return len(model.geometries), others, model.flip(), model.name


def names_used(scene: Scene) -> tuple[set[str], set[str], set[str], set[str]]:
    """Names of geometries, materials, transforms and texture operations in a scene."""
    geometries: set[str] = set()
    materials: set[str] = set()
    transforms: set[str] = set()
    operations: set[str] = set()
    for node in walk(scene.nodes):
        if isinstance(node, Object):
            geometries.add(node.geometry)
        transforms.update(t.kind for t in node.transforms)
        if node.material is not None:
            materials.add(node.material.name)
            operations.update(op.kind for op in node.material.ops)
    return geometries, materials, transforms, operations


def apart(scene: Scene, models: Sequence[Manifest]) -> tuple[Use, Use] | None:
    """Two names of a scene that no model has both of, the earlier one first; None where three are needed."""
    uses = list(_uses(scene))
    owners = [{m.name for m in models if name in getattr(m, field)} for name, field, _ in uses]
    for later in range(len(uses)):
        for earlier in range(later):
            if not owners[earlier] & owners[later]:
                return uses[earlier], uses[later]
    return None


Use = tuple[str, str, object]
"""A name, the field of manifests that lists such names, and the node that uses it first."""


def _uses(scene: Scene) -> Iterator[Use]:
    """Each name once, in the order of the scene."""
    seen: set[tuple[str, str]] = set()
    stack: list[SceneNode] = list(reversed(scene.nodes))
    while stack:
        node = stack.pop()
        found: list[Use] = [(t.kind, "transforms", t) for t in node.transforms]
        if node.material is not None:
            found.append((node.material.name, "materials", node.material))
            found += [(op.kind, "material_ops", op) for op in node.material.ops]
        if isinstance(node, Object):
            found.insert(0, (node.geometry, "geometries", node))
        elif isinstance(node, Chain):
            stack.extend(link.node for link in reversed(node.children))
        else:
            stack.extend(reversed(node.children))
        for use in found:
            if use[:2] not in seen:
                seen.add(use[:2])
                yield use


def walk(nodes: Iterable[SceneNode]) -> Iterator[SceneNode]:
    """All nodes, without recursion, in no particular order."""
    stack = list(nodes)
    while stack:
        node = stack.pop()
        yield node
        if isinstance(node, Chain):
            stack.extend(link.node for link in node.children)
        elif not isinstance(node, Object):
            stack.extend(node.children)
