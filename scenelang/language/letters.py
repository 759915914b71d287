"""Texts: `text` and `width` of a font that was imported, laid out on one line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from scenelang.assets.element_file import ALIGNED, Font, FontError, Placed
from scenelang.language import tree
from scenelang.language.advice import report_problem
from scenelang.language.blocks import holds_children, place_called, place_child, prepare_inner
from scenelang.language.builder import Action, Builder, Site, make
from scenelang.language.diagnostics import listing
from scenelang.language.expressions import Code, Given, bind, computed, prepare_arguments
from scenelang.language.library import Written
from scenelang.language.limits import MODULE_CALL, OBJECT
from scenelang.language.nodes import Object, Scale, Translate
from scenelang.language.session import Env
from scenelang.language.values import POISON, Problem, number, show, unexpected
from scenelang.language.words import LETTERS

MAX_TEXT: Final = 10_000  # characters


class Letters(NamedTuple):
    """A font and the name that a Scene has its file by."""

    font: Font
    file: str


def _line(font: Font, text: Any, size: Any) -> tuple[list[Placed], float]:
    """The line of a text at a size of 1, and its width; raises Problem."""
    if text.__class__ is not str:
        raise unexpected("a string", text, operand=0)
    if number(size, 1) <= 0.0:
        raise Problem("E0311", f"a size of {show(size)} is not above 0", operand=1)
    if len(text) > MAX_TEXT:
        raise Problem("E0370", f"a text of more than {MAX_TEXT:,} characters", operand=0)
    try:
        return font.line(text)
    except FontError as error:
        help = "texts are one line each; write one for each line" if "break" in str(error) else None
        raise Problem("E0370", str(error), help, operand=0, letter=error.at) from None


def laid_out(font: Font, text: Any, size: Any = 1.0, align: Any = "left") -> list[Placed]:
    """The letters of a text in world units; raises Problem."""
    line, width = _line(font, text, size)
    if align.__class__ is not str:
        raise unexpected("a string", align, operand=2)
    if align not in ALIGNED:
        words = listing(ALIGNED)
        raise Problem("E0311", f"no text is aligned to `{align[:40]}`", f"align is {words}", operand=2)
    left = width * ALIGNED[align]
    return [Placed(name, size * (x - left), size * y, size * radius) for name, x, y, radius in line]


def width_of(font: Font) -> Callable[..., float]:
    """The function ``width`` of a font."""
    return lambda text, size=1.0: size * _line(font, text, size)[1]


def prepare_text(stmt: tree.Call, place: Site, letters: Letters) -> Action | None:
    """``abc.text("Ag", size = 0.5) { transforms }``: one child, a union of letters."""
    session, where, word = place.session, Written(stmt.name.span, stmt.span), LETTERS["text"]
    fits = holds_children(place, where.name, "a call of `{}`", stmt.name.text)
    given = prepare_arguments(stmt.args, place)
    block = prepare_inner(stmt.body, place.inner("object")) if stmt.body is not None else None
    if (bound := bind(place.report, stmt.name, word.params, word.required, given)) is None or not fits:
        return None
    place.file.weight += MODULE_CALL
    names = [name for name, one in zip(word.params, bound, strict=True) if one is not None]
    getters = [one.code.run for one in bound if one is not None]
    operands = tuple([None if one is None else one.arg.value for one in bound])
    font, file = letters

    def action(env: Env, out: Builder) -> None:
        values = [get(env) for get in getters]
        if POISON in values:
            return
        try:
            line = laid_out(font, **dict(zip(names, values, strict=True)))
        except Problem as problem:
            report_problem(session.report, problem, where.name, operands)
            return
        session.tick(OBJECT * len(values[0]), where.name)
        session.count_objects(len(line), where.name)
        session.count_parts(2 * len(line), where.name)
        inside = Builder()
        for name, x, y, radius in line:
            scale = make(Scale, {"kind": "scale", "x": radius, "y": radius, "z": radius})
            moves = scale, make(Translate, {"kind": "translate", "x": x, "y": y, "z": 0.0})
            fields = {"kind": "object", "geometry": f"{file}.{name}", "transforms": moves, "material": None}
            place_child(make(Object, fields), where, inside, session)
        place_called(inside, block, env, where, out, session)

    return action


def prepare_width(letters: Letters, expr: tree.CallExpr, given: list[Given], place: Site) -> Code | None:
    """``abc.width("Ag", size = 0.5)``, a number; None after a report."""
    word = LETTERS["width"]
    if (bound := bind(place.report, expr.name, word.params, word.required, given)) is None:
        return None
    codes = [one.code for one in bound if one is not None]
    exprs = [one.arg.value for one in bound if one is not None]
    return computed(place, width_of(letters.font), expr.span, exprs, codes)
