"""Shapes that are not leaves, under the names that people know: where the library has them."""

from __future__ import annotations

from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.evaluate.file_context import FileContext, Place
from scenelang.records import Record
from scenelang.scene import library
from scenelang.syntax import nodes

_LEAVES: Final = frozenset(("square", "triangle", "pentagon"))  # what the library is made of


class Shape(Record):
    """A module of ``std/shapes``.

    Args:
        call: how it is called, for people.
        least, most: how many arguments without a name it takes; of others nothing is known.
        bare: what stands for a call without any, if that means something.
    """

    call: str
    least: int = 0
    most: int = 0
    bare: str = ""

    @property
    def module(self) -> str:
        return self.call.partition("(")[0]


SHAPES: Final = {
    **dict.fromkeys(("circle", "disc", "disk", "dot"), Shape("disc(r)", 1, 1, "disc()")),
    **dict.fromkeys(("ellipse", "oval"), Shape("ellipse(rx, ry)", 2, 2)),
    **dict.fromkeys(("ring", "annulus"), Shape("ring(r, width)", 2, 2, "ring()")),
    **dict.fromkeys(("rect", "rectangle", "box", "cube", "quad"), Shape("rect(w, h)", 1, 2, "rect()")),
    **dict.fromkeys(
        ("rounded", "rounded_rect", "rounded_rectangle", "roundrect", "rrect"), Shape("rounded(w, h, r)")
    ),
    **dict.fromkeys(("line", "segment"), Shape("line(a, b, width)", 2, 3)),
    **dict.fromkeys(("capsule", "stadium"), Shape("capsule(a, b, width)", 2, 3)),
    **dict.fromkeys(("path", "polyline"), Shape("path(points, width)", 1, 2)),
    **dict.fromkeys(("polygon", "ngon"), Shape("polygon(n, r)")),
    **dict.fromkeys(("pie", "sector", "wedge"), Shape("pie(r, from, to)")),
    "arrow": Shape("arrow(a, b, width)", 2, 3),
    "arc": Shape("arc(r, width, from, to)"),
    "parallelogram": Shape("parallelogram(p, a, b)", 3, 3),
    "hexagon": Shape("polygon(6)", bare="polygon(6)"),
    "heptagon": Shape("polygon(7)", bare="polygon(7)"),
    "octagon": Shape("polygon(8)", bare="polygon(8)"),
}
"""Names of shapes, in small letters."""


def in_library(stmt: nodes.Call, place: Place) -> tuple[str | None, Fix | None]:
    """Help and fix for a statement whose name is that of a shape of the library; both None for any other."""
    shape = SHAPES.get(stmt.name.text.lower())
    if shape is None or not place.session.vocabulary.geometries >= _LEAVES:
        return None, None
    imported = next(
        (n for n, b in place.scope.visible() if b.kind == "import" and _is_library(b.value)), None
    )
    alias = imported or ("s" if place.scope.find("s") is None else "shapes")
    text = f'import "{library.SHAPES}" as {alias};'
    help = f"{'' if imported else text + ' then '}{alias}.{shape.call}"
    if imported is None and place.scope.find(alias) is not None:
        return help, None
    edit = _edit(stmt, shape, alias)
    if edit is None:
        return help, None
    message = f"write `{edit.replacement}`"
    if imported:
        return help, Fix(message, (edit,))
    return help, Fix(f"import it and {message}", _with_import(edit, place.file, text))


def _is_library(value: object) -> bool:
    return isinstance(value, FileContext) and value.source.name == library.called(library.SHAPES)


def _edit(stmt: nodes.Call, shape: Shape, alias: str) -> Edit | None:
    """The call of the library's module, where the arguments that are there fit it."""
    name = stmt.name.span
    if not stmt.args:
        end = name.end if stmt.args is None else name.source.text.find(")", name.end) + 1
        return Edit(Span(name.source, name.start, end), f"{alias}.{shape.bare}") if shape.bare else None
    fits = shape.least <= len(stmt.args) <= shape.most and not any(arg.name for arg in stmt.args)
    return Edit(name, f"{alias}.{shape.module}") if fits else None


def _with_import(edit: Edit, file: FileContext, text: str) -> tuple[Edit, ...]:
    """An edit, and the import on a line of its own at the head of the file."""
    first = file.first.span if file.first is not None else edit.span
    source = first.source
    if isinstance(file.first, nodes.Version):
        return Edit(Span(source, first.end, first.end), f"\n{text}"), edit
    if first.start == edit.span.start:
        return (Edit(edit.span, f"{text}\n{edit.replacement}"),)
    return Edit(Span(source, first.start, first.start), f"{text}\n"), edit
