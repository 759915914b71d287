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
from scenelang.models.manifest import Manifest
from scenelang.scene import library
from scenelang.syntax import nodes
from scenelang.words import STAGE

_MESHES: Final = "learned from a mesh: scenelang learn part.obj -o zoo.safetensors"


def likely_models(session: Session, source: SourceFile) -> list[Manifest]:
    """The models in use of the dimension of what a text draws, of all where nobody can tell."""
    words, models = session.report.uses(source), session.vocabulary.in_use
    dimensions = {m.dimension for m in models if any(geometry in words for geometry in m.geometries)}
    dimensions |= {3} if not words.keys().isdisjoint(STAGE) else set()
    dimensions |= {2} if f'"{library.SHAPES}"' in source.text else set()
    dimensions |= {3} if f'"{library.MESHES}"' in source.text else set()
    return [m for m in models if m.dimension in dimensions] if len(dimensions) == 1 else [*models]


def likely_material(session: Session, source: SourceFile) -> str | None:
    """The material that what a text draws has without one; None where nobody can tell."""
    materials = {model.default_material for model in likely_models(session, source)}
    return materials.pop() if len(materials) == 1 else None


def material_advice(place: Place, name: str, argument: str = "…") -> str:
    """Text of an operation on a colour, in the material of what a text draws if that is known."""
    material = likely_material(place.session, place.file.source)
    written = f"material {material or 'flat'} {{ {name}({argument}); }}"
    return written if material else f"{written}, in space material diffuse"


def unknown_material(name: nodes.Name, place: Place, known: set[str]) -> Advice:
    """Likely meaning of a name in the place of a material."""
    session, source, span, lower = place.session, place.file.source, name.span, name.text.lower()
    models = likely_models(session, source)
    there = known & {look for model in models for look in model.looks} or known
    help, fix = did_you_mean(name.text, there, span)
    colour, here = foreign_words.COLOURS.get(lower), foreign_words.MATERIALS.get(lower)
    if help is None and colour is not None and here is None:
        return f"it is a colour: {material_advice(place, 'color', colour)}", None
    listed = f"there is {listing(there)}"
    if help is None and here is not None and here in there:
        return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))
    return help or (here if here is not None and " " in here else listed), fix


def drawn(place: Place, known: set[str]) -> str:
    """Shapes that can be drawn, in the plane or in space."""
    models = [m for m in likely_models(place.session, place.file.source) if known.intersection(m.geometries)]
    spaces = sorted({model.dimension for model in models})
    said = {n: listing({g for m in models if m.dimension == n for g in m.geometries}) for n in spaces}
    if len(said) == 1:
        return f"there is {said[spaces[0]]}" + (f", and what is {_MESHES}" if spaces == [3] else "")
    if not said:
        return "no model is at hand"
    return f"flat scenes draw {said[2]}, solid ones {said[3]}, and what is {_MESHES}"
