"""Habits of other languages, angles without a unit, shapes of the library: what to write instead."""

from __future__ import annotations

import math
import re
from collections.abc import Container, Iterable
from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.evaluate.file_context import FileContext, Place
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.foreign_words import SHAPES, Shape
from scenelang.evaluate.report.reporter import Advice
from scenelang.evaluate.report.spaces import likely_dimensions, likely_material
from scenelang.evaluate.session import Session
from scenelang.evaluate.values.value import COMPONENTS, Problem
from scenelang.scene import library
from scenelang.syntax import nodes
from scenelang.words import TRANSFORMS

_GLUED: Final = "give it a unit: deg, rad or turn"
_RADIANS: Final = "a multiple of PI or TAU is in radians: multiply by 1rad"
_COMPUTED: Final = "multiply by the unit it is in: 1deg, 1rad or 1turn"
_OPENS: Final = ("(", "[", ",", "=", "")
"""What an expression stands behind that may grow by a factor without parentheses."""


def angle_advice(
    expr: nodes.Expr | None, variables: Container[tuple[SourceFile, int]], *, hue: bool = False
) -> tuple[str, Fix | None]:
    """Help and fix for a bare number where an angle is wanted.

    A literal gets the unit that such numbers have elsewhere. A multiple of PI or TAU is in radians. Of other
    computed numbers nobody can tell the unit, so they get no fix.

    Args:
        expr: the number; None where it has no place of its own.
        variables: the names that the file defines, by their file and place.
        hue: the angle shifts a hue, whose fractions are turns, as those of ``hsv`` are.
    """
    inner = expr.operand if isinstance(expr, nodes.Unary) else expr
    if isinstance(inner, nodes.Number):
        unit = _unit(abs(inner.value), hue)
        return _GLUED, Fix(f"add `{unit}`", (Edit(_at(inner, inner.span.end), unit),))
    if expr is None:
        return _GLUED, None
    if _power_of_pi(expr, variables) != 1:
        return _COMPUTED, None
    if expr.span.text.count("(") != expr.span.text.count(")"):
        return _RADIANS, None  # literals keep their place inside their parentheses, and so do sums of them
    loose = isinstance(expr, nodes.Conditional) or (isinstance(expr, nodes.Binary) and expr.op in "+-")
    head, tail = ("(", ") * 1rad") if loose else ("", " * 1rad")
    before = expr.span.source.text[max(0, expr.span.start - 100) : expr.span.start].rstrip()
    if before[-1:] not in _OPENS:
        head, tail = f"({head}", f"{tail})"
    edits = (Edit(_at(expr, expr.span.start), head),) if head else ()
    return _RADIANS, Fix("multiply by `1rad`", (*edits, Edit(_at(expr, expr.span.end), tail)))


def _unit(size: float, hue: bool) -> str:
    """The unit that a literal most likely has."""
    if size > math.tau or float(size).is_integer():
        return "deg"
    return "turn" if hue and size < 1 else "rad"


def _at(expr: nodes.Expr, place: int) -> Span:
    return Span(expr.span.source, place, place)


def _power_of_pi(expr: nodes.Expr, variables: Container[tuple[SourceFile, int]]) -> int:
    """To which power PI or TAU is a factor of a number: 1 where it is in radians, -1 in ``180 / PI``."""
    match expr:
        case nodes.NameRef(name=name):
            own = (name.span.source, name.span.start) not in variables
            return int(own and name.text in ("PI", "TAU"))
        case nodes.Unary():
            return _power_of_pi(expr.operand, variables)
        case nodes.Binary(op="*" | "/" | "+" | "-" | "%" as op):
            left, right = _power_of_pi(expr.left, variables), _power_of_pi(expr.right, variables)
            if op in "*/":
                return left + right if op == "*" else left - right
            return left if op == "%" else max(left, right)
        case nodes.Conditional():
            return max(_power_of_pi(expr.then, variables), _power_of_pi(expr.otherwise, variables))
        case _:
            return 0


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


def called_boolean(stmt: nodes.Call, here: str) -> Advice:
    """`difference(square, star);`: the boolean word with its block."""
    parts = [arg.value.span.text for arg in stmt.args or ()]
    plain = all(isinstance(arg.value, nodes.NameRef) and not arg.name for arg in stmt.args or ())
    text = f"{here} {{ {' '.join(f'{part};' for part in parts)} }}"
    fix = write(stmt.span, text) if plain and stmt.body is None else None
    return f"it is called `{here}` here and has a block: {here} {{ square; star; }}", fix


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
    """`square { color(#d33); }`: into the material that it has without one."""
    source, span = stmt.span.source, stmt.span
    material = likely_material(session, source)
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
        material = likely_material(session, source)
        if material is None or any(isinstance(one, nodes.MaterialUse) for one in body.statements):
            return None
        moved = f"material {material} {{ {moved} }}"
    return Fix("write it as a group", (Edit(head, "group "), Edit(Span(source, last, last), f" {moved}")))


def in_library(stmt: nodes.Call, place: Place) -> tuple[str | None, Fix | None]:
    """Help and fix for a statement whose name is that of a shape of the library; both None for any other."""
    shape = SHAPES.get(stmt.name.text.lower())
    session = place.session
    if shape is None or likely_dimensions(session, stmt.span.source) == (3,):
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
    first, points = stmt.args[0].value, "[" in shape.call or shape.module == "parallelogram"
    fits = fits and not isinstance(first, nodes.Number if points else nodes.Vector)
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
