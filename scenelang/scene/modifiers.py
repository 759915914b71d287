"""What is done to objects and to their materials: the transforms and texture operations of a `Scene`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from scenelang.scene.fields import Affine, Axis, Factor, Finite, Frozen, Length, Radians, Rate, Rgb


class _Turn(Frozen):
    """A turn, whose angle does not go without a word on its unit."""

    kind: str
    angle: Radians

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        if args:
            name = cls.__name__
            raise TypeError(
                f"{name}: an angle without its unit: write {name}.degrees({args[0]!r}), "
                f"or {name}(angle={args[0]!r}) for radians"
            )
        return data


class Translate(Frozen):
    """A move; z is for 3D models."""

    kind: Literal["translate"] = "translate"
    x: Length
    y: Length
    z: Length = 0.0

    if TYPE_CHECKING:

        def __init__(self, x: float, y: float, z: float = 0.0) -> None: ...


class Rotate(_Turn):
    """A turn by ``angle`` radians, counter-clockwise, about ``axis`` (any length but 0)."""

    kind: Literal["rotate"] = "rotate"
    axis: Axis = (0.0, 0.0, 1.0)

    if TYPE_CHECKING:

        def __init__(self, *, angle: float, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> None: ...

    @classmethod
    def degrees(cls, angle_deg: float, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Rotate:
        """A turn by ``angle_deg`` degrees."""
        return cls(angle=math.radians(angle_deg), axis=axis)


class Scale(Frozen):
    """Factors along the axes, as in text: one alone is for all three, and z is 1 where two are given."""

    kind: Literal["scale"] = "scale"
    x: Factor
    y: Factor
    z: Factor

    if TYPE_CHECKING:

        def __init__(self, x: float, y: float | None = None, z: float | None = None) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        given = {name: value for name, value in super()._arranged(args, data).items() if value is not None}
        if "x" in given and "z" not in given:
            given["z"] = 1.0 if "y" in given else given["x"]
            given.setdefault("y", given["x"])
        return given

    @classmethod
    def uniform(cls, s: float) -> Scale:
        """``scale(s)``: the same factor along each axis."""
        return cls(x=s, y=s, z=s)


class Shear(Frozen):
    """``xy``: x += k y, and so on."""

    kind: Literal["shear"] = "shear"
    axes: Literal["xy", "xz", "yx", "yz", "zx", "zy"]
    k: Finite

    if TYPE_CHECKING:

        def __init__(self, axes: Literal["xy", "xz", "yx", "yz", "zx", "zy"], k: float) -> None: ...


class Matrix(Frozen):
    """A 4 x 4 affine, rows, for column vectors; the last row is 0 0 0 1."""

    kind: Literal["matrix"] = "matrix"
    rows: Affine

    if TYPE_CHECKING:

        def __init__(self, rows: Sequence[Sequence[float]]) -> None: ...


class _Warp(Frozen):
    """A turn whose angle grows along something."""

    kind: str
    k: Rate

    if TYPE_CHECKING:

        def __init__(self, k: float) -> None: ...


class Twirl(_Warp):
    """A turn that grows with the distance from the origin."""

    kind: Literal["twirl"] = "twirl"


class Bend(_Warp):
    """A turn that grows along x."""

    kind: Literal["bend"] = "bend"


class Twist(_Warp):
    """A turn of (x, z) that grows along y; for 3D models."""

    kind: Literal["twist"] = "twist"


class Displace(Frozen):
    """Adds ``amount`` sin(f x) sin(f y) sin(f z) to the distance, f being ``frequency``; for 3D models."""

    kind: Literal["displace"] = "displace"
    amount: Length
    frequency: Annotated[Finite, Field(description="radians per world unit")]

    if TYPE_CHECKING:

        def __init__(self, amount: float, frequency: float) -> None: ...


Transform = Annotated[
    Translate | Rotate | Scale | Shear | Matrix | Twirl | Bend | Twist | Displace,
    Field(discriminator="kind"),
]
Transforms = Annotated[tuple[Transform, ...], Field(description="in order, nearest the leaf first")]


class Flip(Frozen):
    """x to -x."""

    kind: Literal["flip"] = "flip"


class Color(Frozen):
    """Multiplies by ``rgb``."""

    kind: Literal["color"] = "color"
    rgb: Rgb

    if TYPE_CHECKING:

        def __init__(self, rgb: str | tuple[float, float, float]) -> None: ...

    @classmethod
    def hex(cls, text: str) -> Color:
        """A colour as text writes it: ``#d33`` or ``#dd3333``."""
        return cls(text)


class Grayscale(Frozen):
    """Mixes with the luma."""

    kind: Literal["grayscale"] = "grayscale"
    amount: Annotated[Finite, Field(description="0 keeps the colour, 1 is grey")]

    if TYPE_CHECKING:

        def __init__(self, amount: float) -> None: ...


class Hue(_Turn):
    """An HSV hue shift by ``angle`` radians."""

    kind: Literal["hue"] = "hue"

    if TYPE_CHECKING:

        def __init__(self, *, angle: float) -> None: ...

    @classmethod
    def degrees(cls, angle_deg: float) -> Hue:
        """A shift by ``angle_deg`` degrees."""
        return cls(angle=math.radians(angle_deg))


MaterialOp = Annotated[
    Translate | Rotate | Scale | Shear | Flip | Color | Grayscale | Hue,
    Field(discriminator="kind"),
]
