"""The model for a scene that names none: the most exact of the smallest that fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from scenelang.models.manifest import Manifest
from scenelang.scene.elements import Brought
from scenelang.scene.schema import Boolean, Chain, Object, Scene, SceneNode
from scenelang.words import BLEND, STAGE

WHITE = (1.0, 1.0, 1.0)


def choose_model(scene: Scene, models: Iterable[Manifest], *, lenient: bool = False) -> Manifest | None:
    """The smallest of ``models`` that has every name the scene uses and draws its canvas; None if none fits.

    It has the fewest dimensions, then the fewest geometries, then the fewest other words, then the least
    measured error, then the first name. Of a scene that names a model, only that one fits. ``lenient`` leaves
    its settings out, and names that none of them has.
    """
    models, used = list(models), list(uses(scene))
    if lenient:
        used = [use for use in used if use[1] != "settings" and any(not lacking(m, [use]) for m in models)]
    fitting = [
        m for m in models if scene.model in (None, m.name) and not lacking(m, used) and paints(m, scene)
    ]
    return min(fitting, key=_size, default=None)


def why_chosen(scene: Scene | None, asked: bool) -> str:
    """Why a scene is drawn with its model: ``asked`` says whether the command line named it."""
    if asked:
        return "by --model"
    named = scene is not None and scene.model is not None
    return "named by the scene" if named else "the smallest that has all it uses"


def best_of_sets(models: Iterable[Manifest]) -> list[Manifest]:
    """Of models that share a set, the one of the least error; they know the same names."""
    best: dict[str, Manifest] = {}
    for model in sorted(models, key=_size):
        best.setdefault(model.set or model.name, model)
    return list(best.values())


def paints(model: Manifest, scene: Scene) -> bool:
    """Whether a model draws a scene's canvas and background."""
    sized = not model.sizes or scene.canvas in model.sizes
    return sized and not (model.white and scene.background not in (WHITE, "default"))


def _size(model: Manifest) -> tuple[int, int, int, float, str]:
    others = len(model.looks) + len(model.transforms) + len(model.material_ops)
    return model.dimension, len(model.geometries), others, model.flip(), model.name


def lacking(model: Manifest, used: Iterable[Use]) -> list[str]:
    """Names that a scene uses and a model does not know, once each, in the order of the scene."""
    return list(dict.fromkeys(shown(use) for use in used if use[0] not in getattr(model, use[1])))


def apart(scene: Scene, models: Sequence[Manifest]) -> tuple[Use, Use] | None:
    """Two names of a scene that no model has both of, the earlier one first; None where three are needed."""
    used = list(uses(scene))
    owners = [{m.name for m in models if not lacking(m, [use])} for use in used]
    for later in range(len(used)):
        for earlier in range(later):
            if not owners[earlier] & owners[later]:
                return used[earlier], used[later]
    return None


Use = tuple[str, str, object]
"""A name, the field of manifests that lists such names, and the node that uses it first."""


def shown(use: Use) -> str:
    """A name as the scene has it: of an element its own."""
    name, field, node = use
    own = getattr(node, "geometry", None) or getattr(node, "name", None)
    return own if field == "elements" and own else name


def uses(scene: Scene) -> Iterator[Use]:
    """Each name that a scene uses, once, in its order."""
    for word in (*STAGE, "background"):
        if getattr(scene, word) != "default":
            yield word, "settings", getattr(scene, word)
    brought = Brought.of(scene.elements)
    seen: set[tuple[str, str]] = set()
    stack: list[SceneNode] = list(reversed(scene.nodes))
    while stack:
        node = stack.pop()
        found: list[Use] = [(t.kind, "transforms", t) for t in node.transforms]
        if (worn := node.material) is not None:
            element = brought.materials.get(worn.name)
            if element is not None:
                found.append((element.kind, "elements", worn))
            elif "." not in worn.name:
                found.append((worn.name, "looks", worn))
            if worn.shading is not None:
                found.append((worn.shading, "materials", worn))
            found += [(op.kind, "material_ops", op) for op in worn.ops]
        if isinstance(node, Object):
            element = brought.geometries.get(node.geometry)
            if element is not None:
                found.insert(0, (element.kind, "elements", node))
            elif "." not in node.geometry:
                found.insert(0, (node.geometry, "geometries", node))
        elif isinstance(node, Chain):
            stack.extend(link.node for link in reversed(node.children))
            wide = (link.node for link in node.children if link.k not in (None, BLEND))
            found += [("smooth(k)", "settings", child) for child in wide]
        else:
            stack.extend(reversed(node.children))
            if isinstance(node, Boolean) and node.k not in (None, BLEND):
                found.append(("smooth(k)", "settings", node))
        for use in found:
            if use[:2] not in seen:
                seen.add(use[:2])
                yield use
