"""Transforms and texture operations: their arguments, and the nodes they make."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from scenelang.evaluate.builder import make
from scenelang.evaluate.values.functions import angle, number
from scenelang.evaluate.values.value import Problem, Vec, describe, unexpected
from scenelang.scene.modifiers import (
    Bend,
    Color,
    Displace,
    Flip,
    Grayscale,
    Hue,
    Matrix,
    Rotate,
    Scale,
    Shear,
    Translate,
    Twirl,
    Twist,
    singular,
)

AXES: Final = ("xy", "xz", "yx", "yz", "zx", "zy")


@dataclass(frozen=True, slots=True)
class Spec:
    """One transform or operation.

    Args:
        params: names of its arguments.
        required: how many of them, from the left, have to be given.
        build: the node from one value an argument, None where left out; raises Problem.
        spread: whether one vector may stand for all arguments.
        help: advice for a wrong number of arguments; None prints the signature.
    """

    params: tuple[str, ...]
    required: int
    build: Callable[..., Any]
    spread: bool = False
    help: str | None = None


def vector(value: Any, length: int, operand: int = 0, what: str = "a vector") -> tuple[float, ...]:
    """``length`` numbers; raises Problem for anything else."""
    if value.__class__ is not Vec or len(value.items) != length:
        raise unexpected(f"{what} of {length} numbers", value, operand=operand)
    return tuple([number(item, operand) for item in value.items])


def color(value: Any, operand: int = 0) -> tuple[float, float, float]:
    """A colour's three numbers."""
    if value.__class__ is not Vec:
        help = "write #d33, [r, g, b], rgb(r, g, b) or hsv(h, s, v)"
        raise unexpected("a colour", value, help, operand, fix="colour")
    r, g, b = vector(value, 3, operand, "a colour")
    return r, g, b


def _translate(x: Any, y: Any, z: Any) -> Translate:
    third = 0.0 if z is None else number(z, 2)
    return make(Translate, {"kind": "translate", "x": number(x, 0), "y": number(y, 1), "z": third})


def _rotate(turn: Any, axis: Any) -> Rotate:
    if turn.__class__ is Vec:
        help = "it turns by one angle about one axis: rotate(45deg), or rotate(45deg, axis = X)"
        raise unexpected("an angle", turn, help, 0, fix="turns")
    rad = angle(turn, 0)
    direction = (0.0, 0.0, 1.0) if axis is None else vector(axis, 3, 1, "an axis")
    if not any(direction):
        raise Problem("E0312", "an axis of length 0", operand=1)
    return make(Rotate, {"kind": "rotate", "angle": rad, "axis": direction})


def _scale(x: Any, y: Any, z: Any) -> Scale:
    factors = [number(x, 0), number(y, 1), 1.0 if z is None else number(z, 2)]
    for index, factor in enumerate(factors):
        if factor == 0.0:
            raise Problem("E0312", "a scale by 0 flattens what it moves", operand=index)
    return make(Scale, {"kind": "scale", "x": factors[0], "y": factors[1], "z": factors[2]})


def _scale_of_one(s: Any) -> Scale:
    """``scale(s)``, or ``scale([sx, sy])`` with its components in a vector."""
    return _scale(*spread([s, None, None], _COMMON["scale"])) if s.__class__ is Vec else _scale(s, s, s)


def _shear(*terms: Any) -> Shear:
    given = [i for i, term in enumerate(terms) if term is not None]
    if len(given) != 1:
        help = "write one term a call, as in shear(xy = 0.5); several calls apply in order"
        raise Problem("E0308", f"shear takes one term, found {len(given)}", help)
    return make(Shear, {"kind": "shear", "axes": AXES[given[0]], "k": number(terms[given[0]], given[0])})


def _matrix(rows: Any) -> Matrix:
    if rows.__class__ is not Vec or len(rows.items) != 4:
        raise unexpected("4 rows of 4 numbers", rows, operand=0)
    values = tuple([vector(row, 4, 0, "a row") for row in rows.items])
    if values[3] != (0.0, 0.0, 0.0, 1.0):
        raise Problem("E0311", "the last row of a matrix is not 0, 0, 0, 1", operand=0)
    if singular(values):
        raise Problem("E0312", "a singular matrix flattens what it moves", operand=0)
    return make(Matrix, {"kind": "matrix", "rows": values})


def _warp(cls: type[Twirl] | type[Bend] | type[Twist], kind: str) -> Callable[[Any], Any]:
    def build(k: Any) -> Any:
        if describe(k) == "an angle":
            help = "k is radians per unit length, a bare number: divide by 1rad"
            raise unexpected("a number", k, help, 0)
        return make(cls, {"kind": kind, "k": number(k, 0)})

    return build


def _displace(amount: Any, frequency: Any) -> Displace:
    return make(
        Displace, {"kind": "displace", "amount": number(amount, 0), "frequency": number(frequency, 1)}
    )


_COMMON: Final = {
    "translate": Spec(("x", "y", "z"), 2, _translate, spread=True),
    "rotate": Spec(("angle", "axis"), 1, _rotate),
    "scale": Spec(("sx", "sy", "sz"), 2, _scale, True, "it is called scale(s) or scale(sx, sy[, sz])"),
    "shear": Spec(AXES, 0, _shear, help="name the term, as in shear(xy = 0.5)"),
}
GEOMETRY: Final[dict[str, Spec]] = {
    **_COMMON,
    "matrix": Spec(("rows",), 1, _matrix, help="it is called matrix([[…4], […4], […4], […4]])"),
    "twirl": Spec(("k",), 1, _warp(Twirl, "twirl")),
    "bend": Spec(("k",), 1, _warp(Bend, "bend")),
    "twist": Spec(("k",), 1, _warp(Twist, "twist")),
    "displace": Spec(("amount", "frequency"), 2, _displace),
}
TEXTURE: Final[dict[str, Spec]] = {
    **_COMMON,
    "flip": Spec((), 0, lambda: make(Flip, {"kind": "flip"})),
    "color": Spec(
        ("c",),
        1,
        lambda c: make(Color, {"kind": "color", "rgb": color(c)}),
        help="it is called color(c), with c as #d33, [r, g, b], rgb(r, g, b) or hsv(h, s, v)",
    ),
    "grayscale": Spec(("a",), 1, lambda a: make(Grayscale, {"kind": "grayscale", "amount": number(a)})),
    "hue": Spec(("angle",), 1, lambda h: make(Hue, {"kind": "hue", "angle": angle(h, fix="hue")})),
}
EVEN_SCALE: Final = Spec(("s",), 1, _scale_of_one)


def spread(values: Sequence[Any], spec: Spec) -> list[Any]:
    """Arguments in full: the items of one vector, or the values as they are.

    Raises:
        Problem: a vector of a length that does not fit, or one number alone.
    """
    first = values[0]
    if any(v is not None for v in values[1:]):
        return list(values)
    if first.__class__ is float:
        missing = " and ".join(f"`{name}`" for name in spec.params[1 : spec.required])
        raise Problem("E0308", f"{missing} is missing, or a vector of all components")
    if first.__class__ is not Vec:
        raise unexpected("a vector or its components", first, operand=0)
    count = len(first.items)
    if not spec.required <= count <= len(spec.params):
        numbers = f"{spec.required} or {len(spec.params)} numbers"
        raise unexpected(f"a vector of {numbers}", first, operand=0)
    return [*first.items, *[None] * (len(spec.params) - count)]


def outside_unit(node: Any) -> float | None:
    """A component of a colour or an amount of grey that lies outside 0 to 1."""
    cls = node.__class__
    if cls is not Color and cls is not Grayscale:
        return None
    for component in node.rgb if cls is Color else (node.amount,):
        if not 0.0 <= component <= 1.0:
            return float(component)
    return None
