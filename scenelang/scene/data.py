"""What a Scene holds: settings, files of elements, and nodes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field

from scenelang.scene.elements import Elements
from scenelang.scene.fields import Frozen, Opaque, Pixels, Version
from scenelang.scene.nodes import Animation, SceneNode
from scenelang.scene.stage import EITHER, STATED, Camera, Ground, Light, Unsaid


class SceneData(Frozen):
    """What a `Scene` holds."""

    version: Version = 1
    model: Annotated[
        str | None,
        Field(
            pattern=r'^[^"\\\x00-\x1f]+$',
            description="the model to draw with; null: the usual one",
        ),
    ] = None
    canvas: Annotated[tuple[Pixels, Pixels], Field(description="width and height in pixels")] = (256, 256)
    background: Annotated[
        Annotated[Opaque | None, STATED] | Unsaid,
        EITHER,
        Field(description="default: white in 2D, the sky in 3D; null: an image with alpha"),
    ] = "default"
    camera: Annotated[Annotated[Camera, STATED] | Unsaid, EITHER, Field(description="3D")] = "default"
    light: Annotated[Annotated[Light, STATED] | Unsaid, EITHER, Field(description="3D")] = "default"
    ground: Annotated[
        Annotated[Ground | None, STATED] | Unsaid, EITHER, Field(description="3D; null: without one")
    ] = "default"
    animation: Annotated[
        Animation | None, Field(description="the animation that this Scene is one frame of")
    ] = None
    elements: Annotated[tuple[Elements, ...], Field(description="files of elements")] = ()
    nodes: Annotated[tuple[SceneNode, ...], Field(description="a union, the last on top")] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            version: Literal[1] = 1,
            model: str | None = None,
            canvas: tuple[int, int] = (256, 256),
            background: tuple[float, float, float] | str | None = "default",
            camera: Camera | Unsaid = "default",
            light: Light | Unsaid = "default",
            ground: Ground | Unsaid | None = "default",
            animation: Animation | None = None,
            elements: Iterable[Elements] | Elements = (),
            nodes: Iterable[SceneNode] | SceneNode = (),
        ) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        if args:
            raise TypeError(f"Scene takes its arguments by name: {', '.join(cls._names())}")
        return super()._arranged(args, data)

    def sized(self, size: tuple[int, int]) -> Self:
        """The same scene on a canvas of that width and height in pixels.

        Raises:
            ValueError: not two numbers from 1 to 8192.
        """
        canvas = type(self)(canvas=size).canvas
        return self.model_copy(update={"canvas": canvas})

    def of_model(self, model: str | None) -> Self:
        """The same scene for a model of that name; itself where there is none."""
        return self if model in (None, self.model) else self.model_copy(update={"model": model})
