"""Ready groups of a file of elements: parts with their places and looks, checked without numpy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from scenelang.elements.element import Element
from scenelang.tensors import TensorError

MOST_PARTS: Final = 256
_MOST: Final = 1e4  # how far away or how large a part may be, and how small by its inverse
_Numbers = tuple[float, ...]
Painted = tuple[()] | tuple[float, float, float]  # a colour of sRGB, 0 to 1, or none


class Part(NamedTuple):
    """A geometry, where it lies in the unit ball or disc of the whole, and what it looks like.

    Args:
        geometry: its name in the file.
        place: of its middle.
        size: of its unit ball or disc.
        turn: rows of what it is multiplied by before, a rotation or a reflection; empty for none.
        color: sRGB, 0 to 1; empty for none.
        material: the name of one in the file; empty for none.
    """

    geometry: str
    place: _Numbers
    size: float
    turn: tuple[_Numbers, ...] = ()
    color: Painted = ()
    material: str = ""


Group = tuple[Part, ...]  # in the order of painting


def read_group(
    name: str, entry: Any, geometries: Mapping[str, Element], materials: Mapping[str, Element]
) -> Group:
    """A group as a header has it.

    Raises:
        TensorError: it is damaged, too large, or has what the file does not hold.
    """
    if not (name.isascii() and name.isidentifier()):
        raise TensorError(f"a group has the name {name[:40]!r}")
    if not isinstance(entry, list) or not 1 <= len(entry) <= MOST_PARTS:
        raise TensorError(f"group `{name}` is not a list of 1 to {MOST_PARTS} parts")
    group: list[Part] = []
    for fields in entry:
        if not isinstance(fields, dict) or not {"geometry", "place", "size"} <= fields.keys() <= _FIELDS:
            raise TensorError(f"a part of group `{name}` has missing or unknown fields")
        part = Part(**{key: _frozen(value) for key, value in fields.items()})
        shape = geometries.get(part.geometry) if isinstance(part.geometry, str) else None
        if (
            shape is None
            or shape.dimension != geometries[group[0].geometry if group else shape.name].dimension
        ):
            raise TensorError(f"group `{name}` has a part that is not a geometry of its dimension")
        worn = materials.get(part.material) if isinstance(part.material, str) else None
        if part.material and (worn is None or worn.dimension > shape.dimension):
            raise TensorError(f"group `{name}` has a material that the file does not hold")
        if not _lies(part, shape.dimension):
            raise TensorError(f"group `{name}` has numbers out of range")
        group.append(part)
    return tuple(group)


_FIELDS: Final = frozenset(Part._fields)


def told(group: Group) -> str:
    """What there is to say of a group."""
    counts = Counter(part.geometry for part in group)
    shown = ", ".join(name if count == 1 else f"{count} {name}" for name, count in counts.items())
    return f"group of {shown}"


def _frozen(value: Any) -> Any:
    if not isinstance(value, list):
        return value
    return tuple([tuple(item) if isinstance(item, list) else item for item in value])


def _lies(part: Part, d: int) -> bool:
    """Whether the numbers of a part are such, so many, and within bounds."""
    rows = (part.place, (part.size,), *(part.turn if isinstance(part.turn, tuple) else (0,)), part.color)
    if not all(isinstance(row, tuple) and all(type(x) in (int, float) for x in row) for row in rows):
        return False
    turned = not part.turn or ([len(row) for row in part.turn] == [d] * d and abs(_volume(part.turn)) > 1e-6)
    placed = len(part.place) == d and all(abs(x) <= _MOST for x in (*part.place, *sum(part.turn, ())))
    coloured = len(part.color) in (0, 3) and all(0 <= x <= 1 for x in part.color)
    return turned and placed and coloured and 1 / _MOST <= part.size <= _MOST


def _volume(rows: tuple[_Numbers, ...]) -> float:
    """The determinant."""
    if not rows:
        return 1.0
    minors = [tuple(row[:k] + row[k + 1 :] for row in rows[1:]) for k in range(len(rows))]
    return float(sum((-1) ** k * rows[0][k] * _volume(minor) for k, minor in enumerate(minors)))


def entry_of(group: Group) -> list[dict[str, Any]]:
    """A group as a header has it."""
    return [{key: value for key, value in part._asdict().items() if value not in ((), "")} for part in group]
