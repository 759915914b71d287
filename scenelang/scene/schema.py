"""The Scene: concrete, validated, frozen. What text evaluates to and what Python or JSON callers build.

Angles are radians, lengths world units, colours numbers in [0, 1] as written (sRGB in 2D). Spans do not
live here: the evaluator returns a `SpanMap` beside the Scene, keyed by `id()` of the node.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, Literal, overload

from pydantic import Field, field_validator, model_validator

from scenelang.notebook import bundle
from scenelang.scene.fields import Combine as Combine
from scenelang.scene.fields import Finite, Frozen, Opaque, Pixels, Version, Word, first_joins_by_union
from scenelang.scene.modifiers import Bend as Bend
from scenelang.scene.modifiers import Color as Color
from scenelang.scene.modifiers import Displace as Displace
from scenelang.scene.modifiers import Flip as Flip
from scenelang.scene.modifiers import Grayscale as Grayscale
from scenelang.scene.modifiers import Hue as Hue
from scenelang.scene.modifiers import MaterialOp as MaterialOp
from scenelang.scene.modifiers import Matrix as Matrix
from scenelang.scene.modifiers import Rotate as Rotate
from scenelang.scene.modifiers import Scale as Scale
from scenelang.scene.modifiers import Shear as Shear
from scenelang.scene.modifiers import Transform as Transform
from scenelang.scene.modifiers import Transforms
from scenelang.scene.modifiers import Translate as Translate
from scenelang.scene.modifiers import Twirl as Twirl
from scenelang.scene.modifiers import Twist as Twist

MAX_FRAMES = 1_000_000
MAX_NODE_DEPTH = 400  # nodes within nodes


class Material(Frozen):
    """A material of the model, with its texture and colour operations in order."""

    name: Annotated[Word, Field(description="a material of the model")]
    ops: Annotated[tuple[MaterialOp, ...], Field(description="in order, nearest the leaf first")] = ()

    if TYPE_CHECKING:

        def __init__(self, name: str, ops: Iterable[MaterialOp] | MaterialOp = ()) -> None: ...


class Object(Frozen):
    """A leaf geometry, its transforms nearest the leaf first, and its material."""

    kind: Literal["object"] = "object"
    geometry: Annotated[Word, Field(description="a leaf geometry of the model")]
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


class Boolean(Frozen):
    """A boolean node over its children, folded left."""

    kind: Literal["boolean"] = "boolean"
    op: Combine
    children: tuple[SceneNode, ...] = ()
    transforms: Transforms = ()
    material: Material | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            op: Combine,
            children: Iterable[SceneNode] | SceneNode = (),
            transforms: Iterable[Transform] | Transform = (),
            material: Material | None = None,
        ) -> None: ...


class Link(Frozen):
    """One child of a chain with the word that joins it to what came before (first: union)."""

    op: Combine = "union"
    node: SceneNode

    if TYPE_CHECKING:

        @overload
        def __init__(self, op: Combine, node: SceneNode) -> None: ...
        @overload
        def __init__(self, *, op: Combine = "union", node: SceneNode) -> None: ...
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


class Scene(Frozen):
    """A whole scene: settings and top-level nodes, which form a union in file order."""

    version: Version = 1
    model: Annotated[
        str | None,
        Field(
            pattern=r'^[^"\\\x00-\x1f]+$', description="the model to draw with; null: the smallest that fits"
        ),
    ] = None
    canvas: Annotated[tuple[Pixels, Pixels], Field(description="width and height in pixels")] = (256, 256)
    background: Annotated[
        Opaque | None, Field(description="as colours are written; null gives an image with alpha")
    ] = (1.0, 1.0, 1.0)
    animation: Annotated[
        Animation | None, Field(description="the animation that this Scene is one frame of")
    ] = None
    nodes: Annotated[tuple[SceneNode, ...], Field(description="a union, the last on top")] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            version: Literal[1] = 1,
            model: str | None = None,
            canvas: tuple[int, int] = (256, 256),
            background: tuple[float, float, float] | None = (1.0, 1.0, 1.0),
            animation: Animation | None = None,
            nodes: Iterable[SceneNode] | SceneNode = (),
        ) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        if args:
            raise TypeError(f"Scene takes its arguments by name: {', '.join(cls._names())}")
        return super()._arranged(args, data)

    def sized(self, size: tuple[int, int]) -> Scene:
        """The same scene on a canvas of that width and height in pixels.

        Raises:
            ValueError: not two numbers from 1 to 8192.
        """
        canvas = Scene(canvas=size).canvas
        return self.model_copy(update={"canvas": canvas})

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        count = len(self.nodes)
        return bundle(self, self.canvas, f"Scene of {count:,} node{'s' * (count != 1)}")

    def to_nsg(self) -> str:
        """Canonical text that evaluates back to an equal Scene."""
        from scenelang.scene.text import to_nsg

        return to_nsg(self)

    def to_python(self) -> str:
        """Python code that makes an equal Scene and calls it ``scene``."""
        from scenelang.scene.python import to_python

        return to_python(self)

    def to_json(self) -> str:
        """JSON that `from_json` reads back; like `model_dump_json`, and for scenes of any depth."""
        from scenelang.scene.json import to_json

        return to_json(self)

    @classmethod
    def from_json(cls, text: str | bytes) -> Scene:
        """Read JSON; like `model_validate_json`, and for scenes of any depth.

        Raises:
            SceneError: text that is not JSON, or not a Scene; it names each place.
        """
        from scenelang.scene.json import from_json

        return from_json(text)


def same_nodes(a: Scene, b: Scene) -> bool:
    """Whether two frames are made of the very same nodes."""
    return (
        len(a.nodes) == len(b.nodes)
        and a.canvas == b.canvas
        and a.background == b.background
        and all(x is y for x, y in zip(a.nodes, b.nodes, strict=True))
    )
