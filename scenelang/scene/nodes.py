"""The nodes of a Scene, frozen and validated, and what a Scene holds beside them."""

from __future__ import annotations

from collections.abc import Iterable
from math import nextafter
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, overload

from pydantic import Field, ValidationInfo, field_validator, model_validator

from scenelang.scene.fields import (
    Dotted,
    Finite,
    Frozen,
    Word,
    first_joins_by_union,
)
from scenelang.scene.modifiers import Color, MaterialOp, Transform, Transforms
from scenelang.words import BLEND, Combine

MAX_FRAMES = 1_000_000
MAX_NODE_DEPTH = 400  # nodes within nodes
Blend = Annotated[
    Finite, Field(gt=0, description="width of the blend; null: 0.15 of `smooth`, a sharp edge of a cut")
]


class Material(Frozen):
    """A material, with its texture and colour operations in order.

    One of the model that is a texture, or an element's, is lit as its ``shading`` says.
    """

    name: Annotated[Dotted, Field(description="a material of the model, or an element's")]
    ops: Annotated[tuple[MaterialOp, ...], Field(description="in order, nearest the leaf first")] = ()
    shading: Annotated[
        Word | None, Field(description="of a texture: flat, diffuse or volumetric; null: as usual")
    ] = None

    if TYPE_CHECKING:

        def __init__(
            self, name: str, ops: Iterable[MaterialOp] | MaterialOp | str = (), shading: str | None = None
        ) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        """A text such as ``#d33`` alone is the colour."""
        given = super()._arranged(args, data)
        if isinstance(given.get("ops"), str):
            given["ops"] = (Color(given["ops"]),)
        return given


class Object(Frozen):
    """A leaf geometry, its transforms nearest the leaf first, and its material."""

    kind: Literal["object"] = "object"
    geometry: Annotated[Dotted, Field(description="a leaf geometry of the model, or an element's")]
    transforms: Transforms = ()
    material: Material | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            geometry: str,
            transforms: Iterable[Transform] | Transform = (),
            material: Material | None = None,
        ) -> None: ...


class Group(Frozen):
    """Children as a union in order, then transforms that apply to all of them."""

    kind: Literal["group"] = "group"
    children: tuple[SceneNode, ...] = ()
    transforms: Transforms = ()
    material: Material | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            children: Iterable[SceneNode] | SceneNode = (),
            transforms: Iterable[Transform] | Transform = (),
            material: Material | None = None,
        ) -> None: ...


def blend_width(op: str, k: float) -> float | None:
    """The k of a Scene for a width that is written, None for the usual one.

    JSON from before cuts had widths says 0.15 in every node, so that one of 0.15 is the next number above.
    """
    if k != BLEND:
        return k
    return nextafter(BLEND, 1.0) if op in ("subtract", "intersect") else None


class _Joining(Frozen):
    """What joins by an operator."""

    @model_validator(mode="after")
    def _unions_have_no_width(self, info: ValidationInfo) -> Self:
        op, k = self.__dict__["op"], self.__dict__["k"]
        if k == BLEND:
            self.__dict__["k"] = None if info.mode == "json" else blend_width(op, k)
        elif op == "union" and k is not None:
            raise ValueError("`union` has no k: `smooth` blends")
        return self


class Boolean(_Joining):
    """A boolean node over its children, folded left; ``k`` is the width of its blend."""

    kind: Literal["boolean"] = "boolean"
    op: Combine
    children: tuple[SceneNode, ...] = ()
    transforms: Transforms = ()
    material: Material | None = None
    k: Blend | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            op: Combine,
            children: Iterable[SceneNode] | SceneNode = (),
            transforms: Iterable[Transform] | Transform = (),
            material: Material | None = None,
            k: float | None = None,
        ) -> None: ...


class Link(_Joining):
    """One child of a chain with the word that joins it to what came before (first: union)."""

    op: Combine = "union"
    node: SceneNode
    k: Blend | None = None

    if TYPE_CHECKING:

        @overload
        def __init__(self, op: Combine, node: SceneNode, k: float | None = None) -> None: ...
        @overload
        def __init__(self, *, op: Combine = "union", node: SceneNode, k: float | None = None) -> None: ...
        def __init__(self, *args: Any, **data: Any) -> None: ...


class Chain(Frozen):
    """The streamed form: children in order, each with its boolean word."""

    kind: Literal["chain"] = "chain"
    children: Annotated[tuple[Link, ...], Field(json_schema_extra=first_joins_by_union)] = ()
    transforms: Transforms = ()
    material: Material | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            children: Iterable[Link | SceneNode] | SceneNode = (),
            transforms: Iterable[Transform] | Transform = (),
            material: Material | None = None,
        ) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        """A child without a word is joined by union."""
        given = super()._arranged(args, data)
        if isinstance(given.get("children"), list | tuple):
            nodes = (Object, Group, Boolean, Chain)
            given["children"] = tuple(
                Link("union", child) if isinstance(child, nodes) else child for child in given["children"]
            )
        return given

    @field_validator("children")
    @classmethod
    def _starts_with_union(cls, children: tuple[Link, ...]) -> tuple[Link, ...]:
        if children and children[0].op != "union":
            raise ValueError(f"the first child of a chain is joined by union, not {children[0].op}")
        return children


SceneNode = Annotated[Object | Group | Boolean | Chain, Field(discriminator="kind")]


class Animation(Frozen):
    """``animate(seconds, fps, loop)``."""

    seconds: Annotated[Finite, Field(gt=0)]
    fps: Annotated[Finite, Field(gt=0, description="frames per second")]
    loop: Annotated[bool, Field(strict=True, description="the last frame is followed by the first")] = True

    if TYPE_CHECKING:

        def __init__(self, seconds: float, fps: float, loop: bool = True) -> None: ...

    @model_validator(mode="after")
    def _is_bounded(self) -> Animation:
        if self.seconds * self.fps > MAX_FRAMES:
            raise ValueError(f"an animation of more than {MAX_FRAMES:,} frames")
        return self

    @property
    def frames(self) -> int:
        """Number of frames, at least 1."""
        return max(1, round(self.seconds * self.fps))
