"""The Scene: concrete, validated, frozen. What text evaluates to and what Python or JSON callers build.

Angles are radians, lengths world units, colours numbers in [0, 1] as written (sRGB in 2D). Spans do not
live here: the evaluator returns a `SpanMap` beside the Scene, keyed by `id()` of the node.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

Finite = Annotated[float, Field(allow_inf_nan=False)]
Rgb = tuple[Finite, Finite, Finite]
Row = tuple[Finite, Finite, Finite, Finite]
Word = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
"""A name that text can spell."""
Combine = Literal["union", "smooth", "subtract", "intersect"]


class _Node(BaseModel):
    # Validators are built when first used: a scene evaluated from text needs none.
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


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
    kind: Literal["translate"] = "translate"
    x: float
    y: float
    z: float = 0.0


class Rotate(_Node):
    """A turn by ``angle`` radians, counter-clockwise, about ``axis`` (any length but 0)."""

    kind: Literal["rotate"] = "rotate"
    angle: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

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
    kind: Literal["scale"] = "scale"
    x: float
    y: float
    z: float

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
    k: float


class Matrix(_Node):
    """A 4 x 4 affine, rows, for column vectors; the last row is 0 0 0 1."""

    kind: Literal["matrix"] = "matrix"
    rows: tuple[Row, Row, Row, Row]

    @field_validator("rows")
    @classmethod
    def _is_affine(cls, rows: tuple[Row, Row, Row, Row]) -> tuple[Row, Row, Row, Row]:
        if rows[3] != (0.0, 0.0, 0.0, 1.0):
            raise ValueError("the last row of a matrix is not 0, 0, 0, 1")
        if singular(rows):
            raise ValueError("a singular matrix")
        return rows


class Twirl(_Node):
    kind: Literal["twirl"] = "twirl"
    k: float


class Bend(_Node):
    kind: Literal["bend"] = "bend"
    k: float


class Twist(_Node):
    kind: Literal["twist"] = "twist"
    k: float


class Displace(_Node):
    kind: Literal["displace"] = "displace"
    amount: float
    frequency: float


Transform = Annotated[
    Translate | Rotate | Scale | Shear | Matrix | Twirl | Bend | Twist | Displace,
    Field(discriminator="kind"),
]

# ---------------------------------------------------------------- materials


class Flip(_Node):
    kind: Literal["flip"] = "flip"


class Color(_Node):
    """Multiplies by ``rgb``."""

    kind: Literal["color"] = "color"
    rgb: Rgb


class Grayscale(_Node):
    kind: Literal["grayscale"] = "grayscale"
    amount: float


class Hue(_Node):
    """An HSV hue shift by ``angle`` radians."""

    kind: Literal["hue"] = "hue"
    angle: float


MaterialOp = Annotated[
    Translate | Rotate | Scale | Shear | Flip | Color | Grayscale | Hue,
    Field(discriminator="kind"),
]


class Material(_Node):
    """A material of the model, with its texture and colour operations in order."""

    name: Word
    ops: tuple[MaterialOp, ...] = ()


# ---------------------------------------------------------------- nodes


class Object(_Node):
    """A leaf geometry, its transforms nearest the leaf first, and its material."""

    kind: Literal["object"] = "object"
    geometry: Word
    transforms: tuple[Transform, ...] = ()
    material: Material | None = None

    def __init__(self, geometry: str | None = None, /, **data: Any) -> None:
        """An object; its geometry may be given without its name: ``Object("star")``."""
        super().__init__(**(data if geometry is None else {"geometry": geometry, **data}))


class Group(_Node):
    """Children as a union in order, then transforms that apply to all of them."""

    kind: Literal["group"] = "group"
    children: tuple[SceneNode, ...] = ()
    transforms: tuple[Transform, ...] = ()
    material: Material | None = None


class Boolean(_Node):
    """A boolean node over its children, folded left."""

    kind: Literal["boolean"] = "boolean"
    op: Combine
    children: tuple[SceneNode, ...] = ()
    transforms: tuple[Transform, ...] = ()
    material: Material | None = None


class Link(_Node):
    """One child of a chain with the word that joins it to what came before (first: union)."""

    op: Combine = "union"
    node: SceneNode


class Chain(_Node):
    """The streamed form: children in order, each with its boolean word."""

    kind: Literal["chain"] = "chain"
    children: tuple[Link, ...] = ()
    transforms: tuple[Transform, ...] = ()
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

    seconds: Annotated[float, Field(gt=0)]
    fps: Annotated[float, Field(gt=0)]
    loop: bool = True

    @property
    def frames(self) -> int:
        """Number of frames, at least 1."""
        return max(1, round(self.seconds * self.fps))


class Scene(_Node):
    """A whole scene: settings and top-level nodes, which form a union in file order."""

    version: Literal[1] = 1
    model: Annotated[str, Field(pattern=r'^[^"\\\x00-\x1f]+$')] | None = None
    canvas: tuple[Annotated[int, Field(ge=1, le=8192)], Annotated[int, Field(ge=1, le=8192)]] = (256, 256)
    background: Rgb | None = (1.0, 1.0, 1.0)
    animation: Animation | None = None
    nodes: tuple[SceneNode, ...] = ()

    def to_nsg(self) -> str:
        """Canonical text that evaluates back to an equal Scene."""
        from scenelang.scene.to_nsg import to_nsg

        return to_nsg(self)

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
