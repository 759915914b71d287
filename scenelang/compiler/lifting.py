"""Lifting: the vector of an object and its parts, and transformations that act on it, exact or learned.

A vector of the exact lifting begins with the way from the world back to the leaf:

    code | the constant 1 | frame of the last affine map | outer warps | middle frame | inner warps

A frame is the rows of the inverse of an affine map, d of d + 1 numbers. A warp is its strengths: the turn by
the length of a point, then by its coordinates x and y (in space the turn by y is one about the y axis, after
the other); the outermost of a group comes first. Behind them lie, in the order of each dimension, the amount
and frequency of a displacement (in space), the width of a blend (0 where it is the usual one, or none), the
frame of the texture, the colour and the code of the material. The colour is the diagonal of a 3 x 4 matrix,
row by row, whose other nine places, `OTHERS`, hold what is rarely written: how far the leaf grows, how thick
its shell is, 1 - opacity, the order of growing and shell (`Skin`), density, roughness and glow.

Every part is a function of the scene alone, and each transformation acts on the vector linearly: an affine
map multiplies its frame by its inverse; a warp shifts the warps of its group by one place and writes itself
in front, times the constant. A product of such matrices is exact for chains of any length.

A vector of a learned lifting has none of these parts: a network gives each transformation's matrix.

Source: the paper's supplement lifts every transformation by a learned MLP; here the part that is known is
not learned (docs/architecture.md says why).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.records import Record
from scenelang.compiler.chain import Levels, slots
from scenelang.compiler.steps import IDENTITY, Affine, Rows, Step, Turn, Warp, inverted

WIDTH: Final = 64  # numbers of an object
STRENGTHS: Final = 3  # of a warp
OTHERS: Final = 1, 2, 3, 4, 6, 7, 8, 9, 11
"""Places of the colour's matrix off its diagonal, each of one part: 0 means not written."""

Array = Any  # numpy array or torch tensor


class Parts(NamedTuple):
    """Parts of vectors (…, 64), each (…, size), but ``width``, ``clear`` and all behind ``material`` (…,)."""

    code: Array
    one: Array
    frame: Array
    outer: Array
    middle: Array
    inner: Array
    bulge: Array  # amount and frequency of a displacement; (…, 0) in the plane
    width: Array  # of the blend by which it joins
    texture: Array
    rgb: Array
    material: Array
    clear: Array = 0.0  # (…,) 1 - opacity
    grow: Array = 0.0  # this and what follows as in `Skin`
    shell: Array = 0.0
    order: Array = 0.0
    density: Array = 0.0  # (…,) extinction of a medium per world unit; 0: the usual one
    roughness: Array = 0.0  # (…,) of what is glossy, minus it of metal; 0: neither
    glow: Array = 0.0  # (…, 3) linear


class Layout:
    """The places of the parts in vectors of a dimension d, from the sizes of all, in order.

    ``colour`` counts its whole matrix, ``free`` is no part. ``geometry`` counts the numbers of the way to the
    leaf and the displacement; ``outer`` and ``inner`` are the most warps of the two groups.
    """

    def __init__(self, dimension: int, **sizes: int) -> None:
        ends = [*accumulate(sizes.values())]
        at = {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}
        assert ends[-1] == WIDTH
        colour = at.pop("colour").start
        at.pop("free", None)
        one, width = at.pop("one").start, at.pop("width").start
        self.others = [colour + place for place in OTHERS]
        grow, shell, clear, order, density, *_, roughness = self.others
        # of colours the diagonal
        own = {"rgb": slice(colour, colour + 12, 5), "clear": clear, "grow": grow, "shell": shell}
        light = {"density": density, "roughness": roughness, "glow": slice(colour + 7, colour + 10)}
        self.places = Parts(**at, **own, **light, one=one, width=width, order=order)
        self.dimension, self.geometry = dimension, int(self.places.bulge.stop)
        self.outer, self.inner = sizes["outer"] // STRENGTHS, sizes["inner"] // STRENGTHS
        rows = range(dimension)
        self.identity = tuple([float(i == j) for i in rows for j in range(dimension + 1)])

    def unpack(self, vectors: Array) -> Parts:
        """The parts of vectors (…, 64), as views."""
        return Parts(*[vectors[..., at] for at in self.places])

    def pack(self, count: int, **parts: Any) -> np.ndarray:
        """Vectors (count, 64) in float64 of the parts that are given, 0 elsewhere."""
        out = np.zeros((count, WIDTH))
        for name, values in parts.items():
            out[:, getattr(self.places, name)] = values
        return out

    @property
    def ways(self) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
        """Places of a frame and of the warps behind it, on the way from the world to the leaf."""
        at = self.places
        return (at.frame, at.outer), (at.middle, at.inner)


_PLANE: Final = {"code": 4, "one": 1, "frame": 6, "outer": 9, "middle": 6, "inner": 6, "bulge": 0}
_SOLID: Final = {"code": 4, "one": 1, "frame": 12, "outer": 6, "middle": 12, "inner": 6, "bulge": 2}
PLANE_LAYOUT: Final = Layout(2, **_PLANE, texture=6, width=1, free=1, colour=12, material=12)
SOLID_LAYOUT: Final = Layout(3, **_SOLID, width=1, texture=6, colour=12, material=2)
LAYOUTS: Final = {2: PLANE_LAYOUT, 3: SOLID_LAYOUT}


def inverse_frame(rows: Rows, dimension: int) -> list[float]:
    """The inverse of an affine map, d rows of d + 1 numbers; raises ZeroDivisionError if singular."""
    if dimension == 2:  # in closed form, as chains of the plane are lifted by the ten thousand
        a, b, _, c, d, e, _, f = rows[:8]
        inverse_det = 1.0 / (a * e - b * d)
        p, q, r, s = e * inverse_det, -b * inverse_det, -d * inverse_det, a * inverse_det
        return [p, q, -(p * c + q * f), r, s, -(r * c + s * f)]
    matrix = np.array([*rows, 0.0, 0.0, 0.0, 1.0]).reshape(4, 4)
    try:
        return list(np.linalg.inv(matrix)[:3].ravel().tolist())
    except np.linalg.LinAlgError:
        raise ZeroDivisionError("a singular map") from None


def texture_frame(rows: Rows) -> tuple[list[float], tuple[float, float]]:
    """The frame (6,) of a texture that a map moves, from x and y to (u, v), and their rates along z."""
    if not (rows[2] or rows[6]):
        return inverse_frame(rows, 2), (0.0, 0.0)
    a, b, p, x, c, d, q, y, *_ = inverted(rows)
    return [a, b, x, c, d, y], (p, q)


def lift_many(
    levels: Sequence[Levels], codes: Sequence[Sequence[float]], layout: Layout = PLANE_LAYOUT
) -> np.ndarray:
    """Vectors (N, 64) in float64 of ways to leaves; raises ZeroDivisionError for a singular map."""
    out, d = np.zeros((len(levels), WIDTH)), layout.dimension
    for row, level, code in zip(out, levels, codes, strict=True):
        numbers = [*code, 1.0, *inverse_frame(level.affine, d)]
        numbers += _slots(level.outer, layout.outer, d)
        numbers += inverse_frame(level.middle, d)
        numbers += _slots(level.inner, layout.inner, d)
        skin, at = level.skin, layout.places
        if d == 3:
            numbers += [skin.amount, skin.frequency]
        row[: len(numbers)] = numbers
        if skin.grow or skin.shell:
            row[at.grow], row[at.shell], row[at.order] = skin.grow, skin.shell, skin.order
    return out


def _slots(turns: tuple[Turn, ...], count: int, dimension: int) -> list[float]:
    numbers = [x for slot in reversed(slots(turns, dimension)) for x in slot]
    return numbers + [0.0] * (STRENGTHS * count - len(numbers))


def lift_colours(
    colours: Sequence[Sequence[float]],
    codes: Sequence[Sequence[float]],
    layout: Layout = PLANE_LAYOUT,
    moved: Sequence[Rows] = (),
    opacities: Sequence[float] = (),
    **lights: Sequence[Any],
) -> np.ndarray:
    """Vectors (N, 64) in float64 of materials: colours (r, g, b) in [0, 1], maps that move textures, and
    opacities in [0, 1]; densities and the like by the names of `Parts`.
    """
    count = len(colours)
    texture = [PLANE_LAYOUT.identity] * count  # textures lie in a plane
    for at, map in enumerate(moved):
        if map is not IDENTITY:
            texture[at] = tuple(texture_frame(map)[0])
    rgb, material = (np.asarray(each, np.float64).reshape(count, -1) for each in (colours, codes))
    clear = 1.0 - np.asarray(opacities or [1.0] * count, np.float64)
    return layout.pack(count, texture=texture, rgb=rgb, clear=clear, material=material, **lights)


Doubles = npt.NDArray[np.float64]
MOST = 1e4  # largest entry: far outside all that was trained, and within the range of float32 networks

# Numbers of a transformation that its encoder takes.
GEOMETRY_INPUTS = {"affine": 16, "twirl": 1, "bend": 1}
MATERIAL_INPUTS = {"color": 3}


class Lifting(Record):
    """A model's codes of geometries (G, d_g) and materials (K, d_m), in the manifest's order, and encoders.

    All is float64. An encoder, of a kind of transformation, is three layers: weight (out, in), bias (out,).
    """

    codes: Doubles
    material_codes: Doubles
    encoders: Mapping[str, tuple[tuple[Doubles, Doubles], ...]]

    def matrices(self, kind: str, numbers: npt.ArrayLike) -> Doubles:
        """Matrices (M, d, d) of M transformations of a kind: (M, inputs)."""
        x = np.atleast_2d(np.asarray(numbers, np.float64))
        *hidden, (weight, bias) = self.encoders[kind]
        for w, b in hidden:
            x = np.maximum(x @ w.T + b, 0.0)
        size = round(len(bias) ** 0.5)
        return (x @ weight.T + bias).reshape(-1, size, size) + np.eye(size)


def read_lifting(tensors: Mapping[str, npt.NDArray[Any]], prefix: str = "lifting.") -> Lifting:
    """The lifting in a weights file; raises KeyError for what is missing, ValueError for what is wrong."""

    def array(name: str) -> Doubles:
        return np.asarray(tensors[prefix + name], np.float64)

    lifting = Lifting(array("codes"), array("material_codes"), {})
    encoders: dict[str, tuple[tuple[Doubles, Doubles], ...]] = {}
    for side, kinds, size in (
        ("geometry", GEOMETRY_INPUTS, lifting.codes.shape[1]),
        ("material", MATERIAL_INPUTS, lifting.material_codes.shape[1]),
    ):
        for kind, width in kinds.items():
            names = [f"{side}.{kind}.layers.{i}" for i in range(3)]
            encoders[kind] = tuple((array(f"{name}.weight"), array(f"{name}.bias")) for name in names)
            _check(kind, encoders[kind], width, size)
    if sum(name.startswith(prefix) for name in tensors) > 2 + 6 * len(encoders):
        raise ValueError("it holds tensors that no encoder has")
    return replace(lifting, encoders=encoders)


def _check(kind: str, layers: tuple[tuple[Doubles, Doubles], ...], width: int, size: int) -> None:
    """An encoder's layers must fit one another, take ``width`` numbers and end in a matrix (size, size)."""
    for weight, bias in layers:
        if weight.ndim != 2 or bias.shape != weight.shape[:1] or weight.shape[1] != width:
            raise ValueError(f"a layer of `{kind}` has the wrong shape")
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise ValueError(f"a layer of `{kind}` is not finite")
        width = len(bias)
    if width != size * size:
        raise ValueError(f"`{kind}` ends in {width} numbers, where {size} x {size} are needed")


def step_numbers(step: Step) -> tuple[str, list[float]]:
    if isinstance(step, Affine):
        a, b, c, d, e, f, g, h, i, j, k, l = step.rows  # noqa: E741
        return "affine", [a, b, c, d, e, f, g, h, i, j, k, l, 0.0, 0.0, 0.0, 1.0]
    if not isinstance(step, Warp):
        raise ValueError(f"a {type(step).__name__.lower()} has no encoder")
    if step.twirl and any(step.bend):
        raise ValueError("a merged warp has no encoder; it is split before it is lifted")
    return ("bend", [step.bend[0]]) if step.bend[0] else ("twirl", [step.twirl])


def lift_geometry(lifting: Lifting, chains: Sequence[Sequence[Step]], leaves: Sequence[int]) -> Doubles:
    """Geometry vectors (N, d_g): T_n … T_1 g of each chain, nearest the leaf first; leaves are rows."""
    out: Doubles = lifting.codes[np.asarray(leaves, int)].copy()
    for at in range(max(map(len, chains), default=0)):
        groups: dict[str, list[tuple[int, list[float]]]] = {}
        for row, chain in enumerate(chains):
            if at < len(chain):
                kind, numbers = step_numbers(chain[at])
                groups.setdefault(kind, []).append((row, numbers))
        for kind, members in groups.items():
            rows = [row for row, _ in members]
            given = np.clip([numbers for _, numbers in members], -MOST, MOST)
            matrices = lifting.matrices(kind, given)
            out[rows] = np.clip(np.einsum("mij,mj->mi", matrices, out[rows]), -MOST, MOST)
    return out


def lift_material(lifting: Lifting, colours: Sequence[Sequence[float]], materials: Sequence[int]) -> Doubles:
    """Material vectors (N, d_m) of objects whose material is one colour (r, g, b) in [0, 1]."""
    codes: Doubles = lifting.material_codes[np.asarray(materials, int)]
    if not len(codes):
        return codes
    lifted: Doubles = np.einsum("mij,mj->mi", lifting.matrices("color", colours), codes)
    return lifted
