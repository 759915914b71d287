"""Advice on values of the wrong kind, shapes of the library, and materials, by what a text draws."""

from __future__ import annotations

import math
import re
from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.evaluate.file_context import FileContext, Place
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Advice
from scenelang.evaluate.session import Session
from scenelang.evaluate.values.value import COMPONENTS, Problem
from scenelang.scene import library
from scenelang.syntax import nodes
from scenelang.words import LEAVES, SHADINGS, STAGE

_MESHES: Final = "learned from a mesh: scenelang learn part.obj -o zoo.safetensors"


def problem_advice(problem: Problem, operand: nodes.Expr | None) -> Advice:
    """Help and fix for a value of the wrong kind, by what the problem says can be mended."""
    if problem.fix == "colour":
        text = operand.value.strip() if isinstance(operand, nodes.String) else ""
        plain = re.fullmatch("#(?:[0-9a-fA-F]{3}){1,2}", text)
        colour = plain[0] if plain else foreign_words.COLOURS.get(text.lower())
        if operand is None or colour is None:
            return problem.help, None
        return problem.help, Fix(f"write `{colour}`", (Edit(operand.span, colour),))
    if problem.fix == "turns":
        return problem.help, None
    inner = operand.operand if isinstance(operand, nodes.Unary) else operand
    if isinstance(inner, nodes.Number):
        size, end = abs(inner.value), inner.span.end
        small = "turn" if problem.fix == "hue" and size < 1 else "rad"
        unit = "deg" if size > math.tau or float(size).is_integer() else small
        fix = Fix(f"add `{unit}`", (Edit(Span(inner.span.source, end, end), unit),))
        return "give it a unit: deg, rad or turn", fix
    if operand is not None and re.search(r"\b(?:PI|TAU)\b", operand.span.text):
        return "what is in radians is multiplied by 1rad, what is in degrees by 1deg", None
    return "multiply by the unit it is in: 1deg, 1rad or 1turn", None


def member_advice(name: nodes.Name) -> str | None:
    """`v.xy`, `v.length`: what other languages have in vectors."""
    if name.text in ("length", "size"):
        return "write len(v)"
    if 2 <= len(name.text) <= 3 and set(name.text) <= set(COMPONENTS):
        return f"write [{', '.join(f'v.{letter}' for letter in name.text)}]"
    return None


def in_library(stmt: nodes.Call, place: Place) -> str | None:
    """Help for a statement whose name is that of a shape of the library."""
    shape = foreign_words.SHAPES.get(stmt.name.text.lower())
    if shape is None or likely_dimensions(place.session, stmt.span.source) == (3,):
        return None
    for alias, binding in place.scope.visible():
        value = binding.value
        if isinstance(value, FileContext) and value.source.name == library.called(library.SHAPES):
            return f"{alias}.{shape}"
    return f'import "{library.SHAPES}" as s; then s.{shape}'


# ---------------------------------------------------------------- the plane or space


def likely_dimensions(session: Session, source: SourceFile) -> tuple[int, ...]:
    """Dimension of what a text draws; both where nobody can tell."""
    words = session.report.words(source)
    likely = {d for d, leaves in LEAVES.items() if not words.isdisjoint(leaves)}
    likely |= {3} if not words.isdisjoint(STAGE) else set()
    likely |= ({2} if "shapes" in words else set()) | ({3} if "meshes" in words else set())
    return (*likely,) if len(likely) == 1 else (*LEAVES,)


def material_advice(place: Place, name: str, argument: str = "…") -> str:
    """Text of an operation on a colour, in the material of what a text draws if that is known."""
    dimensions = likely_dimensions(place.session, place.file.source)
    material = next(iter(SHADINGS[dimensions[0]])) if len(dimensions) == 1 else None
    written = f"material {material or 'flat'} {{ {name}({argument}); }}"
    return written if material else f"{written}, in space material diffuse"


def unknown_material(name: nodes.Name, place: Place, known: set[str]) -> Advice:
    """Likely meaning of a name in the place of a material."""
    span, lower = name.span, name.text.lower()
    likely = likely_dimensions(place.session, place.file.source)
    there = known.difference(*(SHADINGS[d] for d in SHADINGS.keys() - likely))
    help, fix = did_you_mean(name.text, there, span)
    here = foreign_words.MATERIALS.get(lower)
    if help is None and here in there:
        return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))
    if help is None and here is None and lower in foreign_words.COLOURS:
        return f"it is a colour: {material_advice(place, 'color', foreign_words.COLOURS[lower])}", None
    return help or (here if here and " " in here else f"there is {listing(there)}"), fix


def drawn(place: Place) -> str:
    """Shapes that can be drawn, in the plane or in space."""
    dimensions = likely_dimensions(place.session, place.file.source)
    said = {n: listing(LEAVES[n]) for n in dimensions}
    if len(said) == 1:
        return f"there is {said[dimensions[0]]}" + (f", and what is {_MESHES}" if dimensions == (3,) else "")
    return f"flat scenes draw {said[2]}, solid ones {said[3]}, and what is {_MESHES}"
