"""The Scene: concrete, validated, frozen. What text evaluates to and what Python or JSON callers build.

Angles are radians, lengths world units, colours numbers in [0, 1] as written (sRGB in 2D). Spans do not
live here: the evaluator returns a `SpanMap` beside the Scene, keyed by `id()` of the node.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from scenelang.scene.fields import (
    Affine,
    Axis,
    Factor,
    Finite,
    Length,
    Opaque,
    Pixels,
    Radians,
    Rate,
    Rgb,
    Row,
    Version,
    Word,
    first_joins_by_union,
)
from scenelang.scene.fields import (
    Combine as Combine,
)

MAX_FRAMES = 1_000_000


def _kind_is_required(schema: dict[str, Any]) -> None:
    """In data the kind tells nodes apart, while Python's constructors know it."""
    if "kind" in schema["properties"]:
        schema["required"] = ["kind", *schema.get("required", ())]


class _Node(BaseModel):
    # Validators are built when first used: a scene evaluated from text needs none.
    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        defer_build=True,
        json_schema_extra=_kind_is_required,
    )

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """What differs from the defaults: the code that makes it."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if field.is_required() or value != field.default:
                yield name, value

    def __repr__(self) -> str:
        try:
            return super().__repr__()
        except RecursionError:  # nested deeper than Python likes to recurse
            return f"{type(self).__name__}(…)"


def singular(rows: Sequence[Sequence[float]]) -> bool:
    """Whether the 3 x 3 linear block of an affine has no inverse.

    A determinant below 1e-14 of the product of the rows' lengths counts as 0: float64 cannot tell.
    """
    lengths = [math.hypot(*row[:3]) for row in rows[:3]]
    if not all(lengths) or not all(map(math.isfinite, lengths)):
        return True
    unit = [[x / n for x in row[:3]] for row, n in zip(rows, lengths, strict=False)]
    (a, b, c), (d, e, f), (g, h, i) = unit
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return abs(determinant) < 1e-14


# ---------------------------------------------------------------- transforms


class Translate(_Node):
    """A move; z is for 3D models."""

    kind: Literal["translate"] = "translate"
    x: Length
    y: Length
    z: Length = 0.0


class Rotate(_Node):
    """A turn by ``angle`` radians, counter-clockwise, about ``axis`` (any length but 0)."""

    kind: Literal["rotate"] = "rotate"
    angle: Radians
    axis: Axis = (0.0, 0.0, 1.0)

    @classmethod
    def degrees(cls, angle_deg: float, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Rotate:
        """A turn by ``angle_deg`` degrees."""
        return cls(angle=math.radians(angle_deg), axis=axis)

    @field_validator("axis")
    @classmethod
    def _has_direction(cls, axis: tuple[float, float, float]) -> tuple[float, float, float]:
        if not any(axis):
            raise ValueError("an axis of length 0")
        return axis


class Scale(_Node):
    """Factors along the axes; z is 1 in a 2D scene unless the scale is uniform."""

    kind: Literal["scale"] = "scale"
    x: Factor
    y: Factor
    z: Factor

    @field_validator("x", "y", "z")
    @classmethod
    def _is_regular(cls, factor: float) -> float:
        if factor == 0.0:
            raise ValueError("a scale by 0")
        return factor

    @classmethod
    def uniform(cls, s: float) -> Scale:
        """``scale(s)``: the same factor along each axis."""
        return cls(x=s, y=s, z=s)


class Shear(_Node):
    """``xy``: x += k y, and so on."""

    kind: Literal["shear"] = "shear"
    axes: Literal["xy", "xz", "yx", "yz", "zx", "zy"]
    k: Finite


class Matrix(_Node):
    """A 4 x 4 affine, rows, for column vectors; the last row is 0 0 0 1."""

    kind: Literal["matrix"] = "matrix"
    rows: Affine

    @field_validator("rows")
    @classmethod
    def _is_affine(cls, rows: tuple[Row, Row, Row, Row]) -> tuple[Row, Row, Row, Row]:
        if rows[3] != (0.0, 0.0, 0.0, 1.0):
            raise ValueError("the last row of a matrix is not 0, 0, 0, 1")
        if singular(rows):
            raise ValueError("a singular matrix")
        return rows


class Twirl(_Node):
    """A turn that grows with the distance from the origin."""

    kind: Literal["twirl"] = "twirl"
    k: Rate


class Bend(_Node):
    """A turn that grows along x."""

    kind: Literal["bend"] = "bend"
    k: Rate


class Twist(_Node):
    """A turn of (x, z) that grows along y; for 3D models."""

    kind: Literal["twist"] = "twist"
    k: Rate


class Displace(_Node):
    """Adds ``amount`` sin(f x) sin(f y) sin(f z) to the distance, f being ``frequency``; for 3D models."""

    kind: Literal["displace"] = "displace"
    amount: Length
    frequency: Annotated[Finite, Field(description="radians per world unit")]


Transform = Annotated[
    Translate | Rotate | Scale | Shear | Matrix | Twirl | Bend | Twist | Displace,
    Field(discriminator="kind"),
]
Transforms = Annotated[tuple[Transform, ...], Field(description="in order, nearest the leaf first")]

# ---------------------------------------------------------------- materials


class Flip(_Node):
    """x to -x."""

    kind: Literal["flip"] = "flip"


class Color(_Node):
    """Multiplies by ``rgb``."""

    kind: Literal["color"] = "color"
    rgb: Rgb

    @classmethod
    def hex(cls, text: str) -> Color:
        """A colour as text writes it: ``#d33`` or ``#dd3333``."""
        if not re.fullmatch(r"#([0-9a-fA-F]{3}){1,2}", text):
            raise ValueError(f"{text!r} is no colour such as '#d33' or '#dd3333'")
        digits = text[1:] if len(text) == 7 else "".join(digit * 2 for digit in text[1:])
        red, green, blue = (int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4))
        return cls(rgb=(red, green, blue))


class Grayscale(_Node):
    """Mixes with the luma."""

    kind: Literal["grayscale"] = "grayscale"
    amount: Annotated[Finite, Field(description="0 keeps the colour, 1 is grey")]


class Hue(_Node):
    """An HSV hue shift by ``angle`` radians."""

    kind: Literal["hue"] = "hue"
    angle: Radians


MaterialOp = Annotated[
    Translate | Rotate | Scale | Shear | Flip | Color | Grayscale | Hue,
    Field(discriminator="kind"),
]


class Material(_Node):
    """A material of the model, with its texture and colour operations in order."""

    name: Annotated[Word, Field(description="a material of the model")]
    ops: Annotated[tuple[MaterialOp, ...], Field(description="in order, nearest the leaf first")] = ()

    def __init__(self, name: str | None = None, /, **data: Any) -> None:
        """A material; its name may be given alone: ``Material("flat", ops=…)``."""
        super().__init__(**(data if name is None else {"name": name, **data}))


# ---------------------------------------------------------------- nodes


class Object(_Node):
    """A leaf geometry, its transforms nearest the leaf first, and its material."""

    kind: Literal["object"] = "object"
    geometry: Annotated[Word, Field(description="a leaf geometry of the model")]
    transforms: Transforms = ()
    material: Material | None = None

    def __init__(self, geometry: str | None = None, /, **data: Any) -> None:
        """An object; its geometry may be given without its name: ``Object("star")``."""
        super().__init__(**(data if geometry is None else {"geometry": geometry, **data}))


class Group(_Node):
    """Children as a union in order, then transforms that apply to all of them."""

    kind: Literal["group"] = "group"
    children: tuple[SceneNode, ...] = ()
    transforms: Transforms = ()
    material: Material | None = None


class Boolean(_Node):
    """A boolean node over its children, folded left."""

    kind: Literal["boolean"] = "boolean"
    op: Combine
    children: tuple[SceneNode, ...] = ()
    transforms: Transforms = ()
    material: Material | None = None


class Link(_Node):
    """One child of a chain with the word that joins it to what came before (first: union)."""

    op: Combine = "union"
    node: SceneNode


class Chain(_Node):
    """The streamed form: children in order, each with its boolean word."""

    kind: Literal["chain"] = "chain"
    children: Annotated[tuple[Link, ...], Field(json_schema_extra=first_joins_by_union)] = ()
    transforms: Transforms = ()
    material: Material | None = None

    @field_validator("children")
    @classmethod
    def _starts_with_union(cls, children: tuple[Link, ...]) -> tuple[Link, ...]:
        if children and children[0].op != "union":
            raise ValueError(f"the first child of a chain is joined by union, not {children[0].op}")
        return children


SceneNode = Annotated[Object | Group | Boolean | Chain, Field(discriminator="kind")]


class Animation(_Node):
    """``animate(seconds, fps, loop)``."""

    seconds: Annotated[Finite, Field(gt=0)]
    fps: Annotated[Finite, Field(gt=0, description="frames per second")]
    loop: Annotated[bool, Field(strict=True, description="the last frame is followed by the first")] = True

    @model_validator(mode="after")
    def _is_bounded(self) -> Animation:
        if self.seconds * self.fps > MAX_FRAMES:
            raise ValueError(f"an animation of more than {MAX_FRAMES:,} frames")
        return self

    @property
    def frames(self) -> int:
        """Number of frames, at least 1."""
        return max(1, round(self.seconds * self.fps))


class Scene(_Node):
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

    def to_nsg(self) -> str:
        """Canonical text that evaluates back to an equal Scene."""
        from scenelang.scene.to_nsg import to_nsg

        return to_nsg(self)

    def to_python(self) -> str:
        """Python code that makes an equal Scene and calls it ``scene``."""
        from scenelang.scene.to_python import to_python

        return to_python(self)

    def to_json(self) -> str:
        """JSON that `from_json` reads back; like `model_dump_json`, and for scenes of any depth."""
        from scenelang.scene.data import to_json

        return to_json(self)

    @classmethod
    def from_json(cls, text: str | bytes) -> Scene:
        """Read JSON; like `model_validate_json`, and for scenes of any depth.

        Raises:
            SceneError: text that is no JSON, or no Scene; it names each place.
        """
        from scenelang.scene.data import from_json

        return from_json(text)
