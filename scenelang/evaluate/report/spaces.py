"""Advice by what a text draws: shapes of the plane or solids."""

from __future__ import annotations

from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import SourceFile
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.evaluate.file_context import Place
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Advice
from scenelang.evaluate.session import Session
from scenelang.scene import library
from scenelang.syntax import nodes
from scenelang.words import LEAVES, SHADINGS, STAGE

_MESHES: Final = "learned from a mesh: scenelang learn part.obj -o zoo.safetensors"


def likely_dimensions(session: Session, source: SourceFile) -> tuple[int, ...]:
    """The dimension of what a text draws; both where nobody can tell."""
    words = session.report.uses(source).keys()
    found = {d for d, leaves in LEAVES.items() if not words.isdisjoint(leaves)}
    found |= {3} if not words.isdisjoint(STAGE) else set()
    found |= {2} if f'"{library.SHAPES}"' in source.text else set()
    found |= {3} if f'"{library.MESHES}"' in source.text else set()
    return (*found,) if len(found) == 1 else (*LEAVES,)


def likely_material(session: Session, source: SourceFile) -> str | None:
    """The material that what a text draws has without one; None where nobody can tell."""
    dimensions = likely_dimensions(session, source)
    return next(iter(SHADINGS[dimensions[0]])) if len(dimensions) == 1 else None


def material_advice(place: Place, name: str, argument: str = "…") -> str:
    """Text of an operation on a colour, in the material of what a text draws if that is known."""
    material = likely_material(place.session, place.file.source)
    written = f"material {material or 'flat'} {{ {name}({argument}); }}"
    return written if material else f"{written}, in space material diffuse"


def unknown_material(name: nodes.Name, place: Place, known: set[str]) -> Advice:
    """Likely meaning of a name in the place of a material."""
    session, source, span, lower = place.session, place.file.source, name.span, name.text.lower()
    there = known.difference(*(SHADINGS[d] for d in SHADINGS.keys() - likely_dimensions(session, source)))
    help, fix = did_you_mean(name.text, there, span)
    colour, here = foreign_words.COLOURS.get(lower), foreign_words.MATERIALS.get(lower)
    if help is None and colour is not None and here is None:
        return f"it is a colour: {material_advice(place, 'color', colour)}", None
    listed = f"there is {listing(there)}"
    if help is None and here is not None and here in there:
        return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))
    return help or (here if here is not None and " " in here else listed), fix


def drawn(place: Place) -> str:
    """Shapes that can be drawn, in the plane or in space."""
    dimensions = likely_dimensions(place.session, place.file.source)
    said = {n: listing(LEAVES[n]) for n in dimensions}
    if len(said) == 1:
        return f"there is {said[dimensions[0]]}" + (f", and what is {_MESHES}" if dimensions == (3,) else "")
    return f"flat scenes draw {said[2]}, solid ones {said[3]}, and what is {_MESHES}"
