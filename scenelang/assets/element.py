"""Elements: shapes and materials that users bring, and ready groups of them; gradients. Needs no numpy."""

from __future__ import annotations

import bz2
import hashlib
import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from math import hypot, isfinite
from typing import Any, ClassVar, Final, NamedTuple

from scenelang.assets.records import Record
from scenelang.assets.tensors import TensorError, check_fields

MOST_SIDE: Final = {2: 1025, 3: 193}  # nodes along an axis, by dimension
MOST_PIXELS: Final = 2048  # along a side of a picture
MOST_CURVES: Final = 5000  # of an outline
GRAIN: Final = 32767  # steps in a radius of an outline
POINTS: Final = range(3, 1001)  # how many a polygon or a spline may have
ROOM: Final = 12  # bytes of a curve
TEXELS: Final = 256  # along the longer side of one that is learned, where nothing else is asked

Facts = dict[str, str | float]
"""Facts of an element from its maker: text and numbers by name."""


BY_POINTS: Final = "polygon", "spline"
"""Forms of what a scene draws by points; a Program's file has their index here."""


class Encoding(NamedTuple):
    """Form of elements."""

    sizes: dict[str, range]  # its numbers in headers, by name
    codings: tuple[str, ...]  # of its bytes; the first is the default of a header without one
    kinds: dict[int, str]  # its names in manifests, by dimension


FORMS: Final = {
    # a geometry: grids of distances over [-1, 1]^d (`scenelang.assets.pyramid`)
    "pyramid": Encoding(
        {"dimension": range(2, 4), "cells": range(2, 9), "levels": range(1, 10)},
        ("deflate", "bzip2"),
        {2: "element of the plane", 3: "element of space"},
    ),
    # a geometry: closed outlines of quadratic curves in the unit disc, which have the inside on their left:
    # 16-bit numbers of a start, a control point and an end, in 1 / `GRAIN`
    "outline": Encoding({"curves": range(1, MOST_CURVES + 1)}, ("plain",), {2: "element of the plane"}),
    # geometries: closed, by points in the unit disc, two float64 numbers each, a spline `splined`. No
    # file of elements has them
    "polygon": Encoding({"points": POINTS}, ("plain",), {2: "element of the plane"}),
    "spline": Encoding({"points": POINTS}, ("plain",), {2: "element of the plane"}),
    # a material: colours over [-1, 1]^2, repeated with period 2 (`scenelang.assets.picture`)
    "picture": Encoding(
        dict.fromkeys(("height", "width"), range(1, MOST_PIXELS + 1)), ("webp", "av1"), {2: "texture"}
    ),
    # a material: colours over [-1, 1]^3, at nodes on its faces too (`scenelang.assets.pyramid`)
    "colours": Encoding(
        {"side": range(2, MOST_SIDE[3] + 1), "steps": range(4, 256)}, ("bzip2",), {3: "colouring of space"}
    ),
}


@dataclass(frozen=True, slots=True)
class Element:
    """A geometry in the unit ball of its own space, or a material, that a user brought.

    Args:
        name: its name in scenes, after the name of the import.
        form: one of `FORMS`.
        sizes: its numbers, as the form has them. A pyramid has its dimension (2 or 3), the cells of its
            coarsest grid along an axis, and grids, each of twice as many cells as the one before; an outline
            its curves, a polygon or a spline its points; a picture height and width in texels; colours nodes
            along an axis, and steps from dark to light.
        coding: of its bytes, one of the form's.
        data: the bytes.
        about: facts from its maker: license, source, errors; text and numbers by name.
        digest: SHA-256, hex, of everything that determines its shape or its colours.
    """

    name: str
    form: str
    sizes: tuple[int, ...]
    coding: str
    data: bytes = field(repr=False)
    about: Facts = field(default_factory=dict, hash=False, compare=False)
    digest: str = field(init=False)

    def __post_init__(self) -> None:
        words = (self.form, *self.sizes, *((self.coding,) if self.names_coding else ()))
        said = "".join(f"{word} " for word in words).encode()
        object.__setattr__(self, "digest", hashlib.sha256(said + self.data).hexdigest())

    @property
    def material(self) -> bool:
        """True of a material, false of a geometry."""
        return self.form in ("picture", "colours")

    @property
    def curved(self) -> bool:
        """True of a geometry by its edges or curves, whose distances are computed."""
        return self.form == "outline" or self.form in BY_POINTS

    @property
    def called(self) -> str:
        """The word of a polygon or a spline, else its name."""
        return self.form if self.form in BY_POINTS else self.name

    @property
    def points(self) -> Points:
        """The points of a polygon or a spline."""
        return tuple(struct.iter_unpack("<2d", self.inflated()))

    @property
    def credited(self) -> str:
        """What a license is said to be of: of letters their font."""
        return str(self.about.get("original", "letters")) if self.form == "outline" else self.name

    @property
    def names_coding(self) -> bool:
        """True where a header names the coding; early files have none, as all grids were deflated."""
        return self.material or self.coding != FORMS[self.form].codings[0]

    @property
    def dimension(self) -> int:
        """Dimension of the space that it fills."""
        return self.sizes[0] if self.form == "pyramid" else 3 if self.form == "colours" else 2

    @property
    def size(self) -> float | None:
        """Radius of its unit ball in units of the file that it was made of, None where it does not say."""
        size = self.about.get("size")
        return None if self.material or not isinstance(size, int | float) or not size > 0 else float(size)

    @property
    def centre(self) -> tuple[float, ...] | None:
        """Middle of its unit ball in the file that it was made of, y up, None where it does not say."""
        found = [self.about.get(axis) for axis in "xyz"[: self.dimension]]
        numbers = [float(x) for x in found if isinstance(x, int | float)]
        return tuple(numbers) if len(numbers) == len(found) and not self.material else None

    @property
    def values(self) -> dict[str, float | tuple[float, ...]]:
        """Values of scenes that it brings, by name."""
        said = {f"{self.name}_size": self.size, f"{self.name}_centre": self.centre}
        return {name: value for name, value in said.items() if value is not None}

    @property
    def kind(self) -> str:
        """Its kind, as manifests name it."""
        return FORMS[self.form].kinds[self.dimension]

    def told(self) -> str:
        """Kind, sizes and facts of the element, a line each."""
        what = "colours" if self.material else "distances"
        what = next(iter(FORMS[self.form].sizes)) if self.curved else what
        plain = self.curved or self.form == "picture"
        sides = self.sizes[::-1] if plain else (self.sides[-1],) * self.dimension
        first = f"{self.kind}: {' × '.join(map(str, sides))} {what}, {len(self.data):,} bytes"
        return "\n".join([first, *(f"{key}: {value}" for key, value in self.about.items())])

    @property
    def sides(self) -> tuple[int, ...]:
        """Nodes along an axis of each grid."""
        if self.form == "pyramid":
            _, cells, levels = self.sizes
            return tuple(cells * 2**level + 1 for level in range(levels))
        if self.form == "picture":
            return self.sizes
        result = [self.sizes[0]]
        while result[0] % 2 and result[0] >= 9:  # halved as far as that leaves 4 cells
            result.insert(0, result[0] // 2 + 1)
        return tuple(result)

    @property
    def held(self) -> int:
        """Bytes that it takes unpacked, one a distance or a channel."""
        if self.curved:
            return (ROOM if self.form == "outline" else 16) * self.sizes[0]
        if self.form == "picture":
            return 3 * self.sizes[0] * self.sizes[1]
        nodes: int = sum(side**self.dimension for side in self.sides)
        return 3 * nodes if self.material else nodes

    def inflated(self) -> bytes:
        """The unpacked bytes of all nodes; raises `TensorError` where they are damaged, fewer or more."""
        if self.coding == "plain" and len(self.data) == self.held:
            return self.data
        inflate = bz2.BZ2Decompressor() if self.coding == "bzip2" else zlib.decompressobj()
        try:
            result = inflate.decompress(self.data, self.held + 1)
        except (zlib.error, OSError, EOFError) as error:
            raise TensorError(f"element `{self.name}` is damaged: {error}") from None
        if len(result) != self.held or not inflate.eof or inflate.unused_data:
            raise TensorError(f"element `{self.name}` does not hold {self.held:,} bytes")
        return result


Points = tuple[tuple[float, float], ...]


def settled(points: Points) -> Points:
    """Points of a closed polygon or spline without those that repeat the one before."""
    return tuple([p for at, p in enumerate(points) if p != points[at - 1]])


def points_fault(points: Points, count: int | None = None) -> str | None:
    """Say why points, ``count`` of them, make no polygon or spline, None where they do."""
    count = len(points) if count is None else count
    if not all(map(isfinite, (x for p in points for x in p))):
        return "a point that is not finite"
    if count not in POINTS:
        return f"{count:,} points, where {POINTS[0]} to {POINTS[-1]:,} are allowed"
    if len({*points}) < POINTS[0]:
        return (
            f"{len({*points})} different point{'s' * (len({*points}) > 1)}, at least {POINTS[0]} are needed"
        )
    x, y = points[0]
    u, v = max(((p - x, q - y) for p, q in points), key=lambda way: hypot(*way))
    far, most = hypot(u, v), max(abs(x) for p in points for x in p)
    thin = far * 1e-12 + most * 2.0**-50  # what rounding leaves of a line
    if all(abs(u / far * (q - y) - v / far * (p - x)) <= thin for p, q in points):
        return "points that all lie on a line"
    return None


def splined(points: Points) -> list[Points]:
    """Cubic curves, by four points each, of the closed uniform Catmull-Rom spline through points."""
    result: list[Points] = []
    for at, (x, y) in enumerate(points):
        (a, b), (p, q), (u, v) = points[at - 1], points[at + 1 - len(points)], points[at + 2 - len(points)]
        result.append(
            ((x, y), (x + (p - a) / 6, y + (q - b) / 6), (p - (u - x) / 6, q - (v - y) / 6), (p, q))
        )
    return result


def element_of(form: str, points: Iterable[Iterable[float]]) -> Element:
    """The element of a polygon or a spline by points of the unit disc."""
    numbers = [number for point in points for number in point]
    data = struct.pack(f"<{len(numbers)}d", *numbers)
    name = f"{form}_{hashlib.sha256(data).hexdigest()[:16]}"
    return Element(name, form, (len(numbers) // 2,), "plain", data)


@lru_cache(maxsize=1 << 12)
def drawn_element(form: str, points: Points) -> tuple[Element, tuple[float, float], float]:
    """The element of a polygon or a spline by points without `points_fault`, middle and radius of its disc.

    The middle is the origin where that costs little: deformations then trade places with the scale.
    """
    points = settled(points)
    around = points if form == "polygon" else [p for curve in splined(points) for p in curve]
    (left, right), (low, high) = ((min(axis), max(axis)) for axis in zip(*around, strict=True))
    x, y = left / 2 + right / 2, low / 2 + high / 2
    radius, about = (max(hypot(p - at, q - up) for p, q in around) for at, up in ((x, y), (0.0, 0.0)))
    if about <= 1.25 * radius:
        x, y, radius = 0.0, 0.0, about
    return element_of(form, [((p - x) / radius, (q - y) / radius) for p, q in points]), (x, y), radius


def credit_of(elements: Iterable[Element]) -> str:
    """Licenses and sources of elements, a line each; elements with neither are left out."""
    said = [
        (element.credited, [str(element.about[key]) for key in ("license", "source") if key in element.about])
        for element in elements
    ]
    return "\n".join(dict.fromkeys(f"{name}: {', '.join(what)}" for name, what in said if what))


MOST_PARTS: Final = 256
_MOST: Final = 1e4  # how far away or how large a part may be, and how small by its inverse
_Numbers = tuple[float, ...]
Painted = tuple[()] | tuple[float, float, float]  # a colour of sRGB, 0 to 1, or none


class Part(NamedTuple):
    """A geometry, where it lies in the unit ball or disc of the whole, and its look."""

    geometry: str  # its name in the file
    place: _Numbers  # of its middle
    size: float  # of its unit ball or disc
    turn: tuple[_Numbers, ...] = ()  # rows of a rotation or reflection that is applied first; empty for none
    color: Painted = ()
    material: str = ""  # the name of one in the file; empty for none


Group = tuple[Part, ...]  # in the order of painting
_NUMBER: Final = (-_MOST, _MOST)
_PART: Final = {
    "geometry": str, "place": [_NUMBER], "size": (1 / _MOST, _MOST), "turn?": [[_NUMBER]],
    "color?": [(0, 1)], "material?": str,
}  # fmt: skip
"""A part in a header, as `check_fields` takes it."""


def read_group(
    name: str, entry: Any, geometries: Mapping[str, Element], materials: Mapping[str, Element]
) -> Group:
    """Read a group from its entry in a header; raises `TensorError`."""
    if not (name.isascii() and name.isidentifier()):
        raise TensorError(f"a group has the name {name[:40]!r}")
    if not isinstance(entry, list) or not 1 <= len(entry) <= MOST_PARTS:
        raise TensorError(f"group `{name}` is not a list of 1 to {MOST_PARTS} parts")
    check_fields(entry, [_PART], f"group `{name}`")
    group: list[Part] = []
    for fields in entry:
        part = Part(**{key: _frozen(value) for key, value in fields.items()})
        shape = geometries.get(part.geometry)
        first = geometries[group[0].geometry] if group else shape
        if shape is None or first is None or shape.dimension != first.dimension:
            raise TensorError(f"group `{name}` has a part that is not a geometry of its dimension")
        worn = materials.get(part.material)
        if part.material and (worn is None or worn.dimension > shape.dimension):
            raise TensorError(f"group `{name}` has a material that the file does not hold")
        if not _lies(part, shape.dimension):
            raise TensorError(f"group `{name}` has a place, a turn or a colour that is none")
        group.append(part)
    return tuple(group)


def told(group: Group) -> str:
    """One line about a group."""
    counts = Counter(part.geometry for part in group)
    shown = ", ".join(name if count == 1 else f"{count} {name}" for name, count in counts.items())
    return f"group of {shown}"


def _frozen(value: Any) -> Any:
    if not isinstance(value, list):
        return value
    return tuple([tuple(item) if isinstance(item, list) else item for item in value])


def _lies(part: Part, d: int) -> bool:
    """Return whether the numbers of a part have the right counts, and its turn is one."""
    turned = not part.turn or ([len(row) for row in part.turn] == [d] * d and abs(_volume(part.turn)) > 1e-6)
    return turned and len(part.place) == d and len(part.color) in (0, 3)


def _volume(rows: tuple[_Numbers, ...]) -> float:
    """The determinant."""
    if not rows:
        return 1.0
    minors = [tuple(row[:k] + row[k + 1 :] for row in rows[1:]) for k in range(len(rows))]
    return float(sum((-1) ** k * rows[0][k] * _volume(minor) for k, minor in enumerate(minors)))


def entry_of(group: Group) -> list[dict[str, Any]]:
    """Entry of a group in a header."""
    return [{key: value for key, value in part._asdict().items() if value not in ((), "")} for part in group]


GRADIENTS: Final = "linear", "radial"
STOPS: Final = range(2, 9)  # how many a gradient may have
HARD: Final = 1e-6  # of an offset: stops that are no farther apart are a hard edge

Stops = tuple[tuple[float, float, float, float], ...]


class Gradient(Record):
    """A gradient over the (u, v) of textures.

    Args:
        name: ``linear``, over u from -1 to 1, or ``radial``, over the distance from the origin, 0 to 1.
        stops: offset, red, green and blue of each, in [0, 1], in the space that colours are averaged in;
            offsets rise, and equal neighbours are a hard edge.
    """

    kind: ClassVar = "texture"  # a model that draws textures draws gradients
    material: ClassVar = True
    dimension: ClassVar = 2

    name: str
    stops: Stops = ()

    @property
    def digest(self) -> str:
        """SHA-256, hex, of everything that determines its colours."""
        return hashlib.sha256(repr((self.name, self.stops)).encode()).hexdigest()

    @property
    def edges(self) -> tuple[float, ...]:
        """Offsets of its hard edges."""
        return tuple([b[0] for a, b in pairwise(self.stops) if b[0] - a[0] <= HARD and a[1:] != b[1:]])

    @property
    def slope(self) -> float:
        """The most that a channel changes over a unit of (u, v), apart from hard edges."""
        rates = [
            max(abs(p - q) for p, q in zip(a[1:], b[1:], strict=True)) / (b[0] - a[0])
            for a, b in pairwise(self.stops)
            if b[0] - a[0] > HARD
        ]
        return max(rates, default=0.0) / (2 if self.name == "linear" else 1)


def material_fault(name: str, ops: Iterable[Any]) -> tuple[Any, str] | None:
    """The stop that is wrong among the operations of a material, None where some lack, and why, if one is."""
    stops = [op for op in ops if op.kind == "stop"]
    if name not in GRADIENTS:
        return (stops[0], f"a stop in `{name}`, which is not a gradient") if stops else None
    fault = stops_fault([stop.offset for stop in stops])
    return fault and (stops[fault[0]] if fault[0] >= 0 else None, fault[1])


def stops_fault(offsets: list[float]) -> tuple[int, str] | None:
    """The first stop that is wrong by its offset or number, -1 where some are missing, and why, if one is."""
    for at, offset in enumerate(offsets):
        if not 0.0 <= offset <= 1.0:
            return at, f"a stop at {offset:g}, which is outside 0..1"
        if at and offset < offsets[at - 1]:
            return at, f"a stop at {offset:g} after one at {offsets[at - 1]:g}"
        if at >= STOPS[-1]:
            return at, f"more than {STOPS[-1]} stops in one gradient"
    if len(offsets) < STOPS[0]:
        found = "one stop" if offsets else "no stop"
        return -1 if not offsets else 0, f"a gradient with {found}, at least {STOPS[0]} are needed"
    return None
