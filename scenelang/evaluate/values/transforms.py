"""Transforms and texture operations: their arguments, and the nodes they make."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from scenelang.evaluate.builder import make
from scenelang.evaluate.values.functions import angle, number
from scenelang.evaluate.values.value import Problem, Vec, describe, unexpected
from scenelang.records import Record
from scenelang.scene.fields import Frozen, singular
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
)
from scenelang.words import OPERATIONS, TRANSFORMS, Word


class Spec(Record):
    """One transform or operation.

    Args:
        build: the node from one value an argument, None where left out; raises Problem.
        spread: whether one vector may stand for all arguments.
        help: advice for a wrong number of arguments; None prints the signature.
    """

    word: Word
    build: Callable[..., Any]
    spread: bool = False
    help: str | None = None


def vector(value: Any, length: int, operand: int = 0, what: str = "a vector") -> tuple[float, ...]:
    """``length`` numbers; raises Problem for anything else."""
    if value.__class__ is not Vec or len(value.items) != length:
        help = "write [x, y, z], or X, Y or Z" if what in ("a point", "an axis") else None
        raise unexpected(f"{what} of {length} numbers", value, help, operand)
    return tuple([number(item, operand) for item in value.items])


def color(value: Any, operand: int = 0) -> tuple[float, float, float]:
    """A colour's three numbers."""
    if value.__class__ is not Vec:
        help = "write #d33, [r, g, b], rgb(r, g, b) or hsv(h, s, v)"
        raise unexpected("a colour", value, help, operand, fix="colour")
    if len(value.items) == 4:
        raise unexpected(
            "a colour of 3 numbers", value, "colours have no alpha: leave the fourth out", operand
        )
    r, g, b = vector(value, 3, operand, "a colour")
    return r, g, b


_ONE_AXIS: Final = "it turns by one angle about one axis: rotate(45deg), or rotate(45deg, axis = X)"


def _translate(x: Any, y: Any, z: Any) -> Translate:
    third = 0.0 if z is None else number(z, 2)
    return make(Translate, {"kind": "translate", "x": number(x, 0), "y": number(y, 1), "z": third})


def _rotate(turn: Any, axis: Any) -> Rotate:
    if turn.__class__ is Vec:
        raise unexpected("an angle", turn, _ONE_AXIS, 0, fix="turns")
    rad = angle(turn, 0)
    direction = (0.0, 0.0, 1.0) if axis is None else vector(axis, 3, 1, "an axis")
    if not any(direction):
        raise Problem("E0312", "an axis of length 0", operand=1)
    return make(Rotate, {"kind": "rotate", "angle": rad, "axis": direction})


def _scale(x: Any, y: Any, z: Any) -> Scale:
    factors = [number(x, 0), number(y, 1), 1.0 if z is None else number(z, 2)]
    for index, factor in enumerate(factors):
        if factor == 0.0:
            help = "decimals stand behind a point, as in 0.5"
            raise Problem("E0312", "a scale by 0 flattens what it moves", help, operand=index)
    return make(Scale, {"kind": "scale", "x": factors[0], "y": factors[1], "z": factors[2]})


def _scale_of_one(s: Any) -> Scale:
    """``scale(s)``, or ``scale([sx, sy])`` with its components in a vector."""
    return _scale(*spread([s, None, None], GEOMETRY["scale"])) if s.__class__ is Vec else _scale(s, s, s)


def _shear(*terms: Any) -> Shear:
    given = [i for i, term in enumerate(terms) if term is not None]
    if len(given) != 1:
        help = "write one term a call, as in shear(xy = 0.5); several calls apply in order"
        raise Problem("E0308", f"shear takes one term, found {len(given)}", help)
    at = given[0]
    return make(Shear, {"kind": "shear", "axes": TRANSFORMS["shear"].params[at], "k": number(terms[at], at)})


def _matrix(rows: Any) -> Matrix:
    if rows.__class__ is not Vec or len(rows.items) != 4:
        raise unexpected("4 rows of 4 numbers", rows, operand=0)
    values = tuple([vector(row, 4, 0, "a row") for row in rows.items])
    if values[3] != (0.0, 0.0, 0.0, 1.0):
        raise Problem("E0311", "the last row of a matrix is not 0, 0, 0, 1", operand=0)
    if singular(values):
        raise Problem("E0312", "a singular matrix flattens what it moves", operand=0)
    return make(Matrix, {"kind": "matrix", "rows": values})


def _numbers(cls: type[Frozen], refused: str = "") -> Callable[..., Any]:
    """A node whose fields are all numbers; ``refused`` says why an angle is not one of them."""
    kind, *names = [cls.model_fields["kind"].default, *(name for name in cls.model_fields if name != "kind")]

    def build(*values: Any) -> Any:
        for operand, value in enumerate(values):
            if refused and describe(value) == "an angle":
                raise unexpected("a number", value, refused, operand)
        found = {name: number(value, at) for at, (name, value) in enumerate(zip(names, values, strict=True))}
        return make(cls, {"kind": kind, **found})

    return build


_RATE: Final = "k is radians per unit length, a bare number: divide by 1rad"
_BUILDS: Final[dict[str, Callable[..., Any]]] = {
    "translate": _translate,
    "rotate": _rotate,
    "scale": _scale,
    "shear": _shear,
    "matrix": _matrix,
    "twirl": _numbers(Twirl, _RATE),
    "bend": _numbers(Bend, _RATE),
    "twist": _numbers(Twist, _RATE),
    "displace": _numbers(Displace),
    "flip": _numbers(Flip),
    "color": lambda c: make(Color, {"kind": "color", "rgb": color(c)}),
    "grayscale": _numbers(Grayscale),
    "hue": lambda h: make(Hue, {"kind": "hue", "angle": angle(h, fix="hue")}),
}
_SPREAD: Final = ("translate", "scale")
_HELP: Final = {
    "rotate": _ONE_AXIS,
    "shear": "name the term, as in shear(xy = 0.5)",
    "color": "it is called color(c), with c as #d33, [r, g, b], rgb(r, g, b) or hsv(h, s, v)",
    **{name: f"it is called {TRANSFORMS[name].head}" for name in ("scale", "matrix")},
}


def _specs(known: Mapping[str, Word]) -> dict[str, Spec]:
    return {name: Spec(word, _BUILDS[name], name in _SPREAD, _HELP.get(name)) for name, word in known.items()}


GEOMETRY: Final = _specs(TRANSFORMS)
TEXTURE: Final = _specs(OPERATIONS)
EVEN_SCALE: Final = Spec(Word("scale", "scale(s)", "", ("s",), 1), _scale_of_one)


def spread(values: Sequence[Any], spec: Spec) -> list[Any]:
    """Arguments in full: the items of one vector, or the values as they are.

    Raises:
        Problem: a vector of a length that does not fit, or one number alone.
    """
    first = values[0]
    if any(v is not None for v in values[1:]):
        return list(values)
    if first.__class__ is float:
        missing = " and ".join(f"`{name}`" for name in spec.word.params[1 : spec.word.required])
        raise Problem("E0308", f"{missing} is missing, or a vector of all components")
    if first.__class__ is not Vec:
        raise unexpected("a vector or its components", first, operand=0)
    count = len(first.items)
    if not spec.word.required <= count <= len(spec.word.params):
        numbers = f"{spec.word.required} or {len(spec.word.params)} numbers"
        raise unexpected(f"a vector of {numbers}", first, operand=0)
    return [*first.items, *[None] * (len(spec.word.params) - count)]
