"""The stage of a 3D `Scene`: camera, light and ground."""

from __future__ import annotations

from math import atan, pi
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from scenelang.scene.faults import MOST, Triple, camera_fault
from scenelang.scene.fields import Finite, Frozen, Length, Opaque, Radians

Place = Annotated[Length, Field(ge=-MOST, le=MOST)]
Point = Annotated[tuple[Place, Place, Place], Field(description="x, y, z in the world")]
Unsaid = Annotated[Literal["default"], Tag("unsaid")]
"""What the scene does not state: the language's default."""
STATED = Tag("stated")
EITHER = Discriminator(lambda value: "unsaid" if isinstance(value, str) else "stated")


class Camera(Frozen):
    """Where a 3D scene is seen from; ``fov`` is the angle of view in radians across the shorter side."""

    eye: Point = (0.0, 1.2, 6.0)
    target: Point = (0.0, 0.0, 0.0)
    fov: Annotated[Radians, Field(gt=0, lt=pi)] = 2.0 * atan(1.0 / 3.0)

    if TYPE_CHECKING:

        def __init__(self, eye: Triple = ..., target: Triple = ..., *, fov: float = ...) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        if len(args) > 2:
            raise TypeError("Camera: an angle without its unit: write fov=… for radians")
        return super()._arranged(args, data)

    @model_validator(mode="after")
    def _sees(self) -> Self:
        fault = camera_fault(self.eye, self.target, self.fov)
        if fault is not None:
            raise ValueError(fault[1])
        return self


class Light(Frozen):
    """A point light; ``color`` is as written."""

    position: Point = (2.5, 4.0, 3.0)
    power: Annotated[
        Finite, Field(ge=0, le=MOST, description="what a white surface at distance 1 receives")
    ] = 28.0
    color: Opaque = (1.0, 1.0, 1.0)

    if TYPE_CHECKING:

        def __init__(self, position: Triple = ..., power: float = ..., color: Triple | str = ...) -> None: ...


class Ground(Frozen):
    """A diffuse plane at height ``y``; ``color`` is as written, or the default's."""

    y: Place = -1.0
    color: Annotated[Annotated[Opaque, STATED] | Unsaid, EITHER] = "default"

    if TYPE_CHECKING:

        def __init__(self, y: float = ..., color: Triple | str = ...) -> None: ...
