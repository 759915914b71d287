"""Nodes of a Scene: frozen, validated, with their units; transforms, materials and the stage.

The descriptions and the `json_schema_extra` parts go into the JSON Schema, which says what it can of what
the validators check.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from math import atan, degrees, nextafter, pi
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self, dataclass_transform, overload

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    Tag,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)

from scenelang.assets.element import POINTS, material_fault, points_fault
from scenelang.language.diagnostics import plural
from scenelang.language.refusals import refusal
from scenelang.language.words import BLEND, OUTLINES, RESERVED, Combine

Triple = tuple[float, float, float]
MOST: Final = 1e12
"""The largest number of a stage: float32 holds what is computed of it."""
LAMPS: Final = 8
"""The most lights of a scene."""
DENSEST: Final = 1e6
"""The most extinction of a medium, per world unit."""


def camera_fault(eye: Triple, target: Triple, fov_rad: float) -> tuple[str, str] | None:
    """The argument that leaves a camera without a picture, and why, if one does."""
    if eye == target:
        return "eye", "the eye is the target"
    if not 0.0 < fov_rad < pi:
        return "fov", f"a field of view of {degrees(fov_rad):g}° is not between 0° and 180°"
    if fov_rad < 1.0 / MOST:
        return "fov", f"a field of view of {degrees(fov_rad):g}° is too narrow"
    return None


def light_fault(power: float) -> str | None:
    return f"a power of {power:g} is negative" if power < 0.0 else None


OWN_RANGES: Final = {"grow": (-0.5, 1.0), "shell": (0.0, 1.0)}
"""Ranges of what changes a leaf's own distance; of polygons and splines it may be any number."""

_NOT_0: dict[str, Any] = {"not": {"const": 0}}
_NOT_000: dict[str, Any] = {"not": {"const": [0, 0, 0]}}


def _checked(value: Any, wrong: bool, why: str) -> Any:
    if wrong:
        raise ValueError(why)
    return value


# Strict: text such as "0.5" is not a number. Integers are.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Length = Annotated[Finite, Field(description="world units; the shorter side of the canvas spans 2")]
Radians = Annotated[Finite, Field(description="radians, counter-clockwise")]
Rate = Annotated[Finite, Field(description="radians per world unit")]
Factor = Annotated[
    Finite,
    Field(description="not 0", json_schema_extra=_NOT_0),
    AfterValidator(lambda factor: _checked(factor, factor == 0.0, "a scale by 0")),
]
Axis = Annotated[
    tuple[Finite, Finite, Finite],
    Field(description="of any length but 0", json_schema_extra=_NOT_000),
    AfterValidator(lambda axis: _checked(axis, not any(axis), "an axis of length 0")),
]
Rgb = Annotated[
    tuple[Finite, Finite, Finite],
    Field(description="red, green, blue as written (sRGB-encoded); 0 is none, 1 is full"),
]
Row = tuple[Finite, Finite, Finite, Finite]
Share = Annotated[Finite, Field(ge=0, le=1)]
Opaque = Annotated[
    tuple[Share, Share, Share], Field(description="red, green, blue as written (sRGB-encoded), in 0 to 1")
]

_NOT_RESERVED: Final = AfterValidator(
    lambda word: _checked(word, word in RESERVED, f"`{word}` is a word of the language")
)
_WORD: Final = "[A-Za-z_][A-Za-z0-9_]*"
_SPELT: Final[dict[str, Any]] = {"json_schema_extra": {"not": {"enum": list(RESERVED)}}}
Word = Annotated[str, Field(pattern=f"^{_WORD}$", **_SPELT), _NOT_RESERVED]
"""A name that text can spell."""
Dotted = Annotated[str, Field(pattern=rf"^{_WORD}(\.{_WORD})?$", **_SPELT), _NOT_RESERVED]
"""The same, or that of an element behind the name of its file."""


def _whole(value: Any) -> Any:
    """256.0 is an integer and true is none, as in JSON Schema."""
    if isinstance(value, bool):
        raise ValueError("true and false are not numbers")
    return int(value) if isinstance(value, float) and value.is_integer() else value


Version = Annotated[Literal[1], Field(description="of the language"), BeforeValidator(_whole)]
Pixels = Annotated[int, Field(strict=True, ge=1, le=8192), BeforeValidator(_whole)]


def singular(rows: Sequence[Sequence[float]]) -> bool:
    """Test whether the 3 x 3 block of an affine has no inverse: float64 cannot tell below 1e-14."""
    lengths = [math.hypot(*row[:3]) for row in rows[:3]]
    if not all(lengths) or not all(map(math.isfinite, lengths)):
        return True
    unit = [[x / n for x in row[:3]] for row, n in zip(rows, lengths, strict=False)]
    (a, b, c), (d, e, f), (g, h, i) = unit
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return abs(determinant) < 1e-14


def _is_affine(rows: Any) -> Any:
    _checked(rows, rows[3] != (0.0, 0.0, 0.0, 1.0), "the last row of a matrix is not 0, 0, 0, 1")
    return _checked(rows, singular(rows), "a singular matrix")


def _last_row(schema: dict[str, Any]) -> None:
    schema["prefixItems"][3] = {"const": [0, 0, 0, 1]}


def first_joins_by_union(schema: dict[str, Any]) -> None:
    """Say of a chain's children what `Chain` checks."""
    first = {"properties": {"op": {"const": "union"}}}
    schema["prefixItems"] = [{"allOf": [schema["items"], first]}]


Affine = Annotated[
    tuple[Row, Row, Row, Row],
    Field(description="four rows; the last is 0, 0, 0, 1", json_schema_extra=_last_row),
    AfterValidator(_is_affine),
]


def _kind_needed(schema: dict[str, Any]) -> None:
    """In data the kind tells nodes apart, while Python's constructors know it."""
    if "kind" in schema["properties"]:
        schema["required"] = ["kind", *schema.get("required", ())]


_SEVERAL = frozenset(("children", "elements", "nodes", "ops", "transforms"))
_COLOURS = frozenset(("background", "color", "horizon", "rgb", "zenith"))


def _decoded(name: str, text: str) -> tuple[float, float, float]:
    """The colour that ``#d33`` or ``#dd3333`` is, for a class of that name."""
    if not re.fullmatch(r"#([0-9a-fA-F]{3}){1,2}", text):
        raise ValueError(f"{name}: `{text}` is not a colour such as `#d33` or `#dd3333`")
    digits = text[1:] if len(text) == 7 else "".join(digit * 2 for digit in text[1:])
    red, green, blue = (int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4))
    return red, green, blue


def _kind(word: str, *, init: Literal[False] = False) -> Any:
    """The field that tells nodes apart in data, while Python's constructors know it."""
    return Field(default=word)


@dataclass_transform(field_specifiers=(Field, PrivateAttr, _kind))  # fields may go without their names
class Frozen(BaseModel):
    """Base of all nodes of a Scene."""

    # Validators are built when first used: a scene evaluated from text needs none.
    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True, json_schema_extra=_kind_needed
    )

    def __init__(self, *args: Any, **data: Any) -> None:
        """A node; its fields may go without their names, in order, and one thing may stand for a sequence.

        Raises:
            ValueError: a value that does not fit, or no field of that name.
            TypeError: arguments that stand for no field.
        """
        given = self._arranged(args, data)
        try:
            super().__init__(**given)
        except ValidationError as error:
            raise refusal(type(self).__name__, error, self._names()) from None

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # data is validated without it

    @classmethod
    def _names(cls) -> list[str]:
        return [name for name in cls.model_fields if name != "kind"]

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        names = cls._names()
        if len(args) > len(names):
            takes = f"at most {len(names)}: {', '.join(names)}" if names else "none"
            raise TypeError(f"{cls.__name__}: {plural(len(args), 'argument')}, where it takes {takes}")
        for name in names[: len(args)]:
            if name in data:
                raise TypeError(f"{cls.__name__}: `{name}` is given twice")
        given = {**dict(zip(names, args, strict=False)), **data}
        for name in _SEVERAL & given.keys():
            if isinstance(given[name], Frozen):
                given[name] = (given[name],)
        for name in _COLOURS & given.keys():
            if isinstance(given[name], str) and given[name] != "default":
                given[name] = _decoded(cls.__name__, given[name])
        return given

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Arguments that differ from the defaults: the code that makes the node."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if field.is_required() or value != field.default:
                yield name, value

    def __repr__(self) -> str:
        try:
            return super().__repr__()
        except RecursionError:  # nested deeper than Python likes to recurse
            return f"{type(self).__name__}(…)"


LATER: Final = {
    **{"opacity": 1.0, "glow": None, "density": None, "roughness": None},
    **{"radius": 0.0, "sky": "default", "samples": 4, "points": ()},
}
"""Fields that came later, and their usual values."""


class Brief(Frozen):
    """Base of nodes with such fields, which data leave out where they have these values."""

    @model_serializer(mode="wrap")
    def _in_short(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {
            name: v
            for name, v in plain(self).items()
            if name not in LATER or LATER[name] != getattr(self, name)
        }


class _Turn(Frozen):
    """A turn, whose angle does not go without a word on its unit."""

    kind: str = _kind("")
    angle: Radians = Field(kw_only=True)

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        if args:
            name = cls.__name__
            ways = f"write {name}.degrees({args[0]!r}), or {name}(angle={args[0]!r}) for radians"
            raise TypeError(f"{name}: an angle without its unit: {ways}")
        return data


class Translate(Frozen):
    """A move; z is for 3D models."""

    kind: Literal["translate"] = _kind("translate")
    x: Length
    y: Length
    z: Length = 0.0


class Rotate(_Turn):
    """A turn by ``angle`` radians, counter-clockwise, about ``axis`` (any length but 0)."""

    kind: Literal["rotate"] = _kind("rotate")
    axis: Axis = Field(default=(0.0, 0.0, 1.0), kw_only=True)

    @classmethod
    def degrees(cls, angle_deg: float, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Rotate:
        """A turn by ``angle_deg`` degrees."""
        return cls(angle=math.radians(angle_deg), axis=axis)


class Scale(Frozen):
    """Factors along the axes, as in text: one alone is for all three, and z is 1 where two are given."""

    kind: Literal["scale"] = _kind("scale")
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

    kind: Literal["shear"] = _kind("shear")
    axes: Literal["xy", "xz", "yx", "yz", "zx", "zy"]
    k: Finite


class Matrix(Frozen):
    """A 4 x 4 affine, rows, for column vectors; the last row is 0 0 0 1."""

    kind: Literal["matrix"] = _kind("matrix")
    rows: Affine

    if TYPE_CHECKING:

        def __init__(self, rows: Sequence[Sequence[float]]) -> None: ...


class _Warp(Frozen):
    """A turn whose angle grows along something."""

    kind: str = _kind("")
    k: Rate


class Twirl(_Warp):
    """A turn that grows with the distance from the origin."""

    kind: Literal["twirl"] = _kind("twirl")


class Bend(_Warp):
    """A turn that grows along x."""

    kind: Literal["bend"] = _kind("bend")


class Twist(_Warp):
    """A turn of (x, z) that grows along y; for 3D models."""

    kind: Literal["twist"] = _kind("twist")


class Displace(Frozen):
    """Adds ``amount`` sin(f x) sin(f y) sin(f z) to the distance, f being ``frequency``; for 3D models."""

    kind: Literal["displace"] = _kind("displace")
    amount: Length
    frequency: Annotated[Finite, Field(description="radians per world unit")]


class Grow(Frozen):
    """Takes ``r`` off the leaf's own distance, so that its edge moves out by it; first, before any move."""

    kind: Literal["grow"] = _kind("grow")
    r: Annotated[Finite, Field(description="leaf units, -0.5..1 unless by points; below 0 it shrinks")]


class Shell(Frozen):
    """Keeps what is within ``w`` / 2 of the leaf's edge; first, before any move."""

    kind: Literal["shell"] = _kind("shell")
    w: Annotated[Finite, Field(gt=0, description="leaf units, up to 1 unless by points; half on either side")]


Transform = Annotated[
    Translate | Rotate | Scale | Shear | Matrix | Twirl | Bend | Twist | Displace | Grow | Shell,
    Field(discriminator="kind"),
]
Moves = Iterable[Transform] | Transform
Transforms = Annotated[tuple[Transform, ...], Field(description="in order, nearest the leaf first")]


class Flip(Frozen):
    """x to -x."""

    kind: Literal["flip"] = _kind("flip")


class Color(Frozen):
    """Multiplies by ``rgb``."""

    kind: Literal["color"] = _kind("color")
    rgb: Rgb

    if TYPE_CHECKING:

        def __init__(self, rgb: str | tuple[float, float, float]) -> None: ...

    @classmethod
    def hex(cls, text: str) -> Color:
        """A colour as text writes it: ``#d33`` or ``#dd3333``."""
        return cls(text)


class Grayscale(Frozen):
    """Mixes with the luma."""

    kind: Literal["grayscale"] = _kind("grayscale")
    amount: Annotated[Finite, Field(description="0 keeps the colour, 1 is grey")]


class Hue(_Turn):
    """An HSV hue shift by ``angle`` radians."""

    kind: Literal["hue"] = _kind("hue")

    @classmethod
    def degrees(cls, angle_deg: float) -> Hue:
        """A shift by ``angle_deg`` degrees."""
        return cls(angle=math.radians(angle_deg))


class Stop(Frozen):
    """A stop of a gradient: the colour ``rgb`` at ``offset``."""

    kind: Literal["stop"] = _kind("stop")
    offset: Share
    rgb: Rgb

    if TYPE_CHECKING:

        def __init__(self, offset: float, rgb: str | tuple[float, float, float]) -> None: ...


MaterialOp = Annotated[
    Translate | Rotate | Scale | Shear | Flip | Color | Grayscale | Hue | Stop,
    Field(discriminator="kind"),
]
Inks = Iterable[MaterialOp] | MaterialOp | str

Place = Annotated[Length, Field(ge=-MOST, le=MOST)]
Point = Annotated[tuple[Place, Place, Place], Field(description="x, y, z in the world")]
Unsaid = Annotated[Literal["default"], Tag("unsaid")]
"""Value of what the scene does not state: the language's default."""
STATED = Tag("stated")
EITHER = Discriminator(lambda value: "unsaid" if isinstance(value, str) else "stated")


class Camera(Frozen):
    """Viewpoint of a 3D scene; ``fov`` is the angle of view in radians across the shorter side, ``exposure``
    what all light is multiplied by before it is clamped and encoded.
    """

    eye: Point = (0.0, 1.2, 6.0)
    target: Point = (0.0, 0.0, 0.0)
    fov: Annotated[Radians, Field(gt=0, lt=pi)] = Field(default=2.0 * atan(1.0 / 3.0), kw_only=True)
    exposure: Annotated[Finite, Field(gt=0, le=MOST)] = Field(default=1.0, kw_only=True)

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        if len(args) > 2:
            raise TypeError("Camera: an angle without its unit: write fov=… for radians")
        return super()._arranged(args, data)

    @model_validator(mode="after")
    def _sees(self) -> Self:
        if (fault := camera_fault(self.eye, self.target, self.fov)) is not None:
            raise ValueError(fault[1])
        return self


Power = Annotated[Finite, Field(ge=0, le=MOST)]


class Light(Brief):
    """A light, a point or a sphere of a ``radius``; ``color`` is as written."""

    position: Point = (2.5, 4.0, 3.0)
    power: Annotated[Power, Field(description="what a white surface at distance 1 receives")] = 28.0
    color: Opaque = (1.0, 1.0, 1.0)
    radius: Annotated[Finite, Field(ge=0, le=MOST, description="0: a point")] = 0.0

    if TYPE_CHECKING:

        def __init__(
            self, position: Triple = ..., power: float = ..., color: Triple | str = ..., radius: float = ...
        ) -> None: ...


Lights = Annotated[
    Annotated[Light | None, STATED]
    | Annotated[tuple[Light, ...], Field(max_length=LAMPS), Tag("several")]
    | Unsaid,
    Discriminator(
        lambda given: {str: "unsaid", list: "several", tuple: "several"}.get(type(given), "stated")
    ),
    Field(description="3D; null: without one"),
]


class Ground(Frozen):
    """A diffuse plane at height ``y``; ``color`` is as written, or the default's. It fades into the horizon
    by exp(-(x² + z²) / fade²).
    """

    y: Place = -1.0
    color: Annotated[Annotated[Opaque, STATED] | Unsaid, EITHER] = "default"
    fade: Annotated[Finite, Field(gt=0, le=MOST)] = 8.0

    if TYPE_CHECKING:

        def __init__(self, y: float = ..., color: Triple | str = ..., fade: float = ...) -> None: ...


class Sky(Frozen):
    """The sky as a light: its colours, as written or the background's, times ``power``."""

    power: Power = 1.0
    horizon: Annotated[Annotated[Opaque, STATED] | Unsaid, EITHER] = "default"
    zenith: Annotated[Annotated[Opaque, STATED] | Unsaid, EITHER] = "default"

    if TYPE_CHECKING:

        def __init__(
            self, power: float = ..., horizon: Triple | str = ..., zenith: Triple | str = ...
        ) -> None: ...


class Glow(Frozen):
    """Light that a material sends out: ``power`` times ``color``, which is as written."""

    color: Opaque
    power: Power = 1.0

    if TYPE_CHECKING:

        def __init__(self, color: Triple | str, power: float = ...) -> None: ...


MAX_FRAMES = 1_000_000
MAX_NODE_DEPTH = 400  # nodes within nodes
Blend = Annotated[
    Finite, Field(gt=0, description="width of the blend; null: 0.15 of `smooth`, a sharp edge of a cut")
]

SAMPLES: Final = 4, 16
"""Numbers of samples that a pixel may be the mean of, on regular grids."""
SampleCount = Annotated[Literal[4, 16], Field(description="samples of a pixel"), BeforeValidator(_whole)]


class Material(Brief):
    """A material, with its texture and colour operations in order.

    One of the model that is a texture, a gradient, or an element's, is lit as its ``shading`` says.
    ``opacity`` is of flat scenes, what follows it of solid ones.
    """

    name: Annotated[Dotted, Field(description="a material of the model, or an element's")]
    ops: Annotated[tuple[MaterialOp, ...], Field(description="in order, nearest the leaf first")] = ()
    shading: Annotated[
        Word | None, Field(description="of a texture: flat, diffuse, volumetric, …; null: as usual")
    ] = None
    opacity: Annotated[Share, Field(description="2D; 0 shows all that lies behind, 1 hides it")] = 1.0
    glow: Annotated[Glow | None, Field(description="light that it sends out")] = None
    density: Annotated[
        Finite | None, Field(gt=0, le=DENSEST, description="of volumetric, per world unit; null: 3")
    ] = None
    roughness: Annotated[
        Finite | None, Field(ge=0.05, le=1, description="of glossy and metal; null: 0.3")
    ] = None

    if TYPE_CHECKING:

        def __init__(
            self,
            name: str,
            ops: Inks = (),
            shading: str | None = None,
            opacity: float = 1.0,
            glow: Glow | str | Triple | None = None,
            density: float | None = None,
            roughness: float | None = None,
        ) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        given = super()._arranged(args, data)
        if isinstance(given.get("ops"), str):
            given["ops"] = (Color(given["ops"]),)
        if isinstance(given.get("glow"), str | tuple):
            given["glow"] = Glow(given["glow"])
        return given

    @model_validator(mode="after")
    def _has_stops(self) -> Self:
        fault = material_fault(self.name, self.ops)
        return _checked(self, fault is not None, fault[1] if fault else "")  # type: ignore[no-any-return]


class Object(Brief):
    """A leaf geometry, its transforms nearest the leaf first, and its material; a polygon's ``points``."""

    kind: Literal["object"] = _kind("object")
    geometry: Annotated[Dotted, Field(description="a leaf geometry of the model, or an element's")]
    transforms: Transforms = ()
    material: Material | None = None
    points: Annotated[
        tuple[tuple[Length, Length], ...],
        Field(max_length=POINTS[-1], description=f"of a polygon or a spline, at least {POINTS[0]}"),
    ] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            geometry: str,
            transforms: Moves = (),
            material: Material | None = None,
            points: Iterable[Sequence[float]] = (),
        ) -> None: ...

    @model_validator(mode="after")
    def _fits(self) -> Self:
        by_points = self.geometry in OUTLINES
        fault = points_fault(self.points) if by_points else "it has no points" if self.points else None
        for own in () if by_points else self.transforms:
            value = own.r if isinstance(own, Grow) else own.w if isinstance(own, Shell) else 0.0
            low, high = OWN_RANGES.get(own.kind, (0.0, 0.0))
            if not low <= value <= high:
                fault = f"`{own.kind}` by {value:g} is outside {low:g}..{high:g}"
        return _checked(self, fault is not None, f"`{self.geometry}`: {fault}")  # type: ignore[no-any-return]


def polygon(
    points: Iterable[Sequence[float]], transforms: Moves = (), material: Material | None = None
) -> Object:
    """A polygon by its points, closed; what its edges go around, by the winding number, is inside."""
    return Object("polygon", transforms, material, points)


def spline(
    points: Iterable[Sequence[float]], transforms: Moves = (), material: Material | None = None
) -> Object:
    """A smooth closed curve through points, a uniform Catmull-Rom spline."""
    return Object("spline", transforms, material, points)


class Group(Frozen):
    """Children as a union in order, then transforms that apply to all of them."""

    kind: Literal["group"] = _kind("group")
    children: tuple[SceneNode, ...] = ()
    transforms: Transforms = ()
    material: Material | None = None

    if TYPE_CHECKING:

        def __init__(
            self, children: Nodes = (), transforms: Moves = (), material: Material | None = None
        ) -> None: ...


def blend_width(op: str, k: float) -> float | None:
    """The k of a Scene for a width that is written, None for the usual one.

    JSON from before cuts had widths says 0.15 in every node, so that one of 0.15 is the next number above.
    """
    if k != BLEND:
        return k
    return nextafter(BLEND, 1.0) if op in ("subtract", "intersect") else None


def _unions_without_width(schema: dict[str, Any]) -> None:
    _kind_needed(schema)
    schema["if"] = {"properties": {"op": {"const": "union"}}}
    schema["then"] = {"properties": {"k": {"enum": [None, BLEND]}}}


class _Joining(Frozen):
    """Base of nodes that join by an operator."""

    model_config = ConfigDict(json_schema_extra=_unions_without_width)

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

    kind: Literal["boolean"] = _kind("boolean")
    op: Combine
    children: tuple[SceneNode, ...] = ()
    transforms: Transforms = ()
    material: Material | None = None
    k: Blend | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            op: Combine,
            children: Nodes = (),
            transforms: Moves = (),
            material: Material | None = None,
            k: float | None = None,
        ) -> None: ...


class Link(_Joining):
    """One child of a chain with the word that joins it to what came before (first: union)."""

    op: Combine = Field(default="union", kw_only=True)
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

    kind: Literal["chain"] = _kind("chain")
    children: Annotated[tuple[Link, ...], Field(json_schema_extra=first_joins_by_union)] = ()
    transforms: Transforms = ()
    material: Material | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            children: Iterable[Link | SceneNode] | Nodes = (),
            transforms: Moves = (),
            material: Material | None = None,
        ) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        given = super()._arranged(args, data)
        if isinstance(given.get("children"), list | tuple):
            nodes = (Object, Group, Boolean, Chain)
            links = (Link("union", at) if isinstance(at, nodes) else at for at in given["children"])
            given["children"] = tuple(links)
        return given

    @field_validator("children")
    @classmethod
    def _starts_with_union(cls, children: tuple[Link, ...]) -> tuple[Link, ...]:
        if children and children[0].op != "union":
            raise ValueError(f"the first child of a chain is joined by union, not {children[0].op}")
        return children


SceneNode = Annotated[Object | Group | Boolean | Chain, Field(discriminator="kind")]
Nodes = Iterable[SceneNode] | SceneNode


class Animation(Frozen):
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
