"""Names that models offer: geometries, materials, transforms and texture operations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from scenelang.models.manifest import Manifest, available, load_manifest


def _offered(kind: str) -> cached_property[set[str]]:
    """All names of a kind that the models in use have."""
    return cached_property(lambda words: {name for m in words.in_use for name in getattr(m, kind)})


@dataclass(frozen=True)
class Vocabulary:
    """What a scene may name: the chosen model's words, or those of all models.

    Args:
        chosen: the scene's model; None where the compiler picks one later.
        blind: the scene names a model that is not at hand, so nothing is known about its words.
    """

    models: tuple[Manifest, ...]
    chosen: Manifest | None = None
    blind: bool = False

    @cached_property
    def in_use(self) -> tuple[Manifest, ...]:
        """The models whose names are accepted."""
        return (self.chosen,) if self.chosen else self.models

    def choose(self, name: str) -> Vocabulary | None:
        """The same with model ``name`` chosen; None if there is no such model."""
        return next((Vocabulary(self.models, m) for m in self.models if m.name == name), None)

    geometries = _offered("geometries")
    materials = _offered("materials")
    textures = _offered("textures")
    transforms = _offered("transforms")
    material_ops = _offered("material_ops")

    def owner(self, name: str) -> str | None:
        """The first model at hand but the chosen one that has a geometry, material or operation ``name``."""
        for m in self.models:
            known = (*m.geometries, *m.materials, *m.textures, *m.transforms, *m.material_ops)
            if m is not self.chosen and name in known:
                return m.name
        return None

    @cached_property
    def dimension(self) -> int | None:
        """2 or 3 where the model is chosen or all agree."""
        dimensions = {m.dimension for m in self.in_use}
        return dimensions.pop() if len(dimensions) == 1 else None


def shipped() -> tuple[Manifest, ...]:
    """Manifests of all shipped models."""
    return tuple(load_manifest(name) for name in available())


def vocabulary(models: Iterable[Manifest] | None = None) -> Vocabulary:
    """The words of ``models``, by default of all shipped ones."""
    return Vocabulary(tuple(shipped() if models is None else models))
