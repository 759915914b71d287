"""Habits of other languages that parse here and mean nothing: what to write, and a fix where that is sure."""

from __future__ import annotations

import re
from collections.abc import Container, Iterable
from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.angles import angle_advice
from scenelang.evaluate.report.reporter import Advice
from scenelang.evaluate.session import Session
from scenelang.evaluate.values.value import COMPONENTS, Problem
from scenelang.syntax import nodes
from scenelang.words import TRANSFORMS

_SIMPLE: Final = re.compile(r"[\w.#]+(?:\([^()]*\)|\[[^\[\]]*\])?|\([^()]*\)|\[[^\[\]]*\]")
_NEAR: Final = 500
"""So many letters around a place are looked at."""


def write(span: Span, text: str) -> Fix:
    """A fix that puts a text in the place of another."""
    return Fix(f"write `{text}`" if len(text) <= 60 else "write it so", (Edit(span, text),))


def call_advice(name: str, call: nodes.CallExpr | None) -> Advice:
    """Help and fix for a call of a function that other languages have."""
    known = foreign_words.FUNCTIONS.get(name)
    if known is None or "->" not in known:
        return known, None
    ways = [tuple(part.strip() for part in way.split("->")) for way in known.split(";")]
    params, body = next((w for w in ways if call and len(w[0].split()) == len(call.args)), ("", ways[0][1]))
    help = f"write {body}"
    if call is None or not params or any(arg.name for arg in call.args):
        return help, None
    given = dict(zip(params.split(), (arg.value.span.text for arg in call.args), strict=True))
    source, start, end = call.span.source, call.span.start, call.span.end
    around = (
        source.text[max(0, start - _NEAR) : start].rstrip()[-1:],
        source.text[end : end + _NEAR].lstrip()[:1],
    )
    operator = re.search(r" [-+*/%^<?] ", body) is not None
    if operator:
        given = {key: text if _SIMPLE.fullmatch(text) else f"({text})" for key, text in given.items()}
    text = re.sub(r"\b[a-z]\b", lambda letter: given.get(letter[0], letter[0]), body)
    alone = not operator or (around[0] in "(,=[" and around[1] in "),;]")
    return help, write(call.span, text if alone else f"({text})")


def member_advice(of: nodes.Expr | None, name: nodes.Name) -> Advice:
    """`v.xy`, `v.length`: what other languages have in vectors."""
    if not isinstance(of, nodes.NameRef):
        return None, None
    if name.text in ("length", "size"):
        text = f"len({of.span.text})"
    elif 2 <= len(name.text) <= 3 and set(name.text) <= set(COMPONENTS):
        text = f"[{', '.join(f'{of.span.text}.{letter}' for letter in name.text)}]"
    else:
        return None, None
    return f"write {text}", write(of.span.to(name.span), text)


def advice(
    problem: Problem, operand: nodes.Expr | None, variables: Container[tuple[SourceFile, int]]
) -> Advice:
    """Help and fix for a value of the wrong kind, by what the problem says can be mended."""
    if problem.fix == "colour":
        colour = _colour(operand.value) if isinstance(operand, nodes.String) else None
        return problem.help, write(operand.span, colour) if operand and colour else None
    if problem.fix == "turns":
        items = operand.items if isinstance(operand, nodes.Vector) else ()
        flat = len(items) == 3 and all(isinstance(i, nodes.Number) and not i.value for i in items[:2])
        return problem.help, write(operand.span, items[2].span.text) if operand and flat else None
    return angle_advice(operand, variables, hue=problem.fix == "hue")


def _colour(text: str) -> str | None:
    """A colour written as a string."""
    plain = re.fullmatch("#(?:[0-9a-fA-F]{3}){1,2}", text.strip())
    return plain[0] if plain else foreign_words.COLOURS.get(text.strip().lower())


def _material(session: Session, source: SourceFile) -> str | None:
    """The only material that there is for what a text draws; None where there are several."""
    drawn = session.report.uses(source)
    models = [m for m in session.vocabulary.in_use if any(geometry in drawn for geometry in m.geometries)]
    materials = {material for model in models for material in model.materials}
    return materials.pop() if len(materials) == 1 else None


def _beside(text: str, start: int, end: int) -> str | None:
    """What stands around a statement in its block, without the blocks there; None where that is far."""
    before = _level(reversed(text[max(0, start - _NEAR) : start]), "}", "{")
    after = _level(text[end : end + _NEAR], "{", "}")
    return None if before is None or after is None else f"{before[::-1]} {after}"


def _level(letters: Iterable[str], deeper: str, higher: str) -> str | None:
    """Letters up to where a block ends, without those of deeper ones."""
    kept: list[str] = []
    depth = 0
    for letter in letters:
        depth += (letter == deeper) - (letter == higher)
        if depth < 0:
            return "".join(kept)
        if depth == 0:
            kept.append(letter)
    return None


def in_material(stmt: nodes.Call, session: Session, name: str) -> Fix | None:
    """`square { color(#d33); }`: into the material, where there is but one for what the text draws."""
    source, span = stmt.span.source, stmt.span
    material = _material(session, source)
    beside = _beside(source.text, span.start, span.end)
    if material is None or stmt.body is not None or beside is None or "material" in beside:
        return None
    head = Edit(Span(source, span.start, stmt.name.span.end), f"material {material} {{ {name}")
    return Fix("put it into a material", (head, Edit(Span(source, span.end, span.end), " }")))


def as_group(stmt: nodes.Call, session: Session) -> Fix | None:
    """`translate(1, 0) { … }`: a group that ends with the transform, or with the material of a colour."""
    body, source = stmt.body, stmt.span.source
    if body is None or not body.span.text.endswith("}"):
        return None
    head = Span(source, stmt.span.start, body.span.start)
    last = body.statements[-1].span.end if body.statements else body.span.start + 1
    moved = f"{head.text.rstrip()};"
    if stmt.name.text not in TRANSFORMS:
        material = _material(session, source)
        if material is None or any(isinstance(one, nodes.MaterialUse) for one in body.statements):
            return None
        moved = f"material {material} {{ {moved} }}"
    return Fix("write it as a group", (Edit(head, "group "), Edit(Span(source, last, last), f" {moved}")))
