"""Ready groups of files of elements, as objects of a Scene."""

from __future__ import annotations

from scenelang.diagnostics.suggest import listing
from scenelang.elements.groups import Part
from scenelang.elements.zoo import Zoo
from scenelang.scene.modifiers import Color, Matrix, Scale, Transform, Translate
from scenelang.scene.nodes import Material, Object


def objects_of(zoo: Zoo, file: str, name: str) -> tuple[Object, ...]:
    """The parts of a group in their places and looks, in order of painting.

    Args:
        file: what a Scene calls the file.

    Raises:
        KeyError: there is no such group.
    """
    if name not in zoo.groups:
        raise KeyError(f"`{file}` has no group `{name}`; it has {listing(zoo.groups) or 'none'}")
    return tuple(
        Object(
            f"{file}.{part.geometry}",
            _moves(part),
            _look(part, file, "flat" if zoo.geometries[part.geometry].dimension == 2 else "diffuse"),
        )
        for part in zoo.groups[name]
    )


def _moves(part: Part) -> tuple[Transform, ...]:
    moves: list[Transform] = []
    if part.turn:
        rows = [[*row, *[0.0] * (4 - len(row))] for row in part.turn]
        rows += [[float(k == at) for k in range(4)] for at in range(len(rows), 4)]
        moves.append(Matrix(tuple(tuple(row) for row in rows)))
    if part.size != 1.0:
        moves.append(Scale(part.size))
    if any(part.place):
        moves.append(Translate(*part.place))
    return tuple(moves)


def _look(part: Part, file: str, plain: str) -> Material | None:
    if part.material:
        return Material(f"{file}.{part.material}")
    return Material(plain, Color(part.color)) if part.color else None
