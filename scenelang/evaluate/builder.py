"""Nodes of a Scene made from values that the evaluator has checked itself."""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import BaseModel

from scenelang.diagnostics.span import Span
from scenelang.scene.schema import Link, Material
from scenelang.words import Combine

M = TypeVar("M", bound=BaseModel)

_set = object.__setattr__
_fields_set: dict[type[BaseModel], set[str]] = {}


def make(cls: type[M], fields: dict[str, Any]) -> M:
    """A frozen model from all its fields, in their order, unvalidated.

    `BaseModel.model_construct` does the same six times slower; scenes have tens of thousands of nodes.
    """
    node = cls.__new__(cls)
    _set(node, "__dict__", fields)
    given = _fields_set.get(cls)
    if given is None:
        given = _fields_set[cls] = set(fields)
    _set(node, "__pydantic_fields_set__", given)  # shared: frozen models never change it
    _set(node, "__pydantic_extra__", None)
    _set(node, "__pydantic_private__", None)
    return node


class Builder:
    """What the statements of one block put into their node.

    Attributes:
        children: nodes, or the links of a chain.
        transforms: transforms, or the operations of a material.
        material: the block's material.
        material_span: where it was given.
        moved: where the first transform stands.
    """

    __slots__ = ("children", "material", "material_span", "moved", "transforms")

    def __init__(
        self, material: Material | None = None, material_span: Span | None = None, moved: Span | None = None
    ) -> None:
        self.children: list[Any] = []
        self.transforms: list[Any] = []
        self.material, self.material_span, self.moved = material, material_span, moved

    def add(self, node: Any) -> None:
        """Append a child."""
        self.children.append(node)

    def extend(self, other: Builder) -> None:
        """Add all that another builder of the same block holds."""
        self.children += other.children
        self.transforms += other.transforms
        if other.material is not None:
            self.material, self.material_span = other.material, other.material_span
        self.moved = self.moved or other.moved


class ChainBuilder(Builder):
    """The block of a chain: each child is joined by the word before it."""

    __slots__ = ("k", "op")

    def __init__(self) -> None:
        super().__init__()
        self.op: Combine = "union"
        self.k: float | None = None

    def add(self, node: Any) -> None:
        self.children.append(make(Link, {"op": self.op, "node": node, "k": self.k}))
