"""Statements of the top level: version, model, canvas, background, animation, imports; and whole files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.fixes import removal
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.evaluate.builder import Builder, make
from scenelang.evaluate.file_context import Action, FileContext, Place
from scenelang.evaluate.names import Binding, Env
from scenelang.evaluate.prepare.blocks import Body, define, misplaced, prepare_block
from scenelang.evaluate.prepare.calls import bind
from scenelang.evaluate.prepare.expressions import prepare, prepare_arguments
from scenelang.evaluate.report.suppression import find_damage
from scenelang.evaluate.report.type_errors import report_problem
from scenelang.evaluate.session import Session
from scenelang.evaluate.values.functions import number
from scenelang.evaluate.values.transforms import color
from scenelang.evaluate.values.value import POISON, Problem, Time, Vec, show, unexpected
from scenelang.scene.schema import MAX_FRAMES, Animation
from scenelang.syntax import nodes
from scenelang.words import SETTINGS

MAX_SIDE_PX: Final = 8192
LEFT_OUT: Final = object()  # an argument that was not given; None is the value ``none``


def at_top_level(place: Place, span: Span, what: str, name: str = "") -> bool:
    """Whether a statement stands at top level; reports it if not."""
    if place.kind == "file" and not place.nested:
        return True
    misplaced(place, span, f"{what} inside a block", name, "it stands at top level")
    return False


def _once(session: Session, what: str, span: Span) -> bool:
    """Whether a setting is given for the first time; reports a second time."""
    first = session.settings.given.setdefault(what, span)
    if first is not span:
        labels = (Label(first, "first given here"),)
        session.report.error("E0333", f"`{what}` is given twice", span, labels=labels)
    return first is span


def prepare_version(stmt: nodes.Version, place: Place) -> Action | None:
    version, first = stmt.number, place.file.first
    if not at_top_level(place, stmt.span, "the language version"):
        return None
    if version.unit or version.value != 1:
        message = f"language version {version.span.text} is not supported"
        place.report.error("E0334", message, version.span, help="this is version 1: nsg 1;")
    elif first is not stmt:
        fix = None
        if first is not None and first.span.source is stmt.span.source:
            source, start = stmt.span.source, first.span.start
            there = Edit(Span(source, start, start), f"{stmt.span.text}\n")
            away = removal(source, stmt.span.start, stmt.span.end)
            fix = Fix("move it to the top", (there, *away.edits))
        message = "the language version is not the first statement"
        place.report.error("E0334", message, stmt.span, fix=fix)
    return None


def prepare_model(stmt: nodes.Model, place: Place) -> Action | None:
    session, name, span = place.session, stmt.name, stmt.name.span
    if not at_top_level(place, stmt.span, "'model'") or not _once(session, "model", stmt.span):
        return None
    known = [m.name for m in session.vocabulary.models]
    if not isinstance(name, nodes.String):
        if not isinstance(name, nodes.BadExpr):
            prepare(name, place)
            session.report.error("E0301", "expected the model's name as a string", span)
    elif name.value not in known:
        help, fix = did_you_mean(name.value, known, Span(span.source, span.start + 1, span.end - 1))
        help = help or f"there is {listing(known)}"
        session.report.error("E0210", f"unknown model `{name.value}`", span, help=help, fix=fix)
    return None


def prepare_setting(stmt: nodes.Call, place: Place) -> Action | None:
    """``canvas``, ``background`` or ``animate``."""
    session, name, span = place.session, stmt.name.text, stmt.name.span
    given = prepare_arguments(stmt.args, place)
    if not at_top_level(place, span, "`{}`", name) or not _once(session, name, span):
        return None
    if stmt.body is not None:
        session.report.error("E0330", f"`{name}` takes no block", span, help=f"write {name}(…);")
        return None
    word, apply = SETTINGS[name], _APPLY[name]
    bound = bind(session.report, stmt.name, word.params, word.required, given, spread=name == "canvas")
    getters = [None if one is None else one.code.run for one in bound or ()]
    operands = tuple([None if one is None else one.arg.value for one in bound or ()])

    def action(env: Env, out: Builder) -> None:
        values = [LEFT_OUT if get is None else get(env) for get in getters]
        try:
            if bound is not None and POISON not in values:
                apply(session, span, *values)
                return
        except Problem as problem:
            report_problem(session.report, problem, span, operands)
        if name == "animate":  # with a mistake, which is not a further one of what needs its variables
            session.animated[:] = [POISON] * 4

    return action


def _canvas(session: Session, span: Span, width: Any, height: Any) -> None:
    if width.__class__ is Vec and height is LEFT_OUT:
        if len(width.items) != 2:
            raise unexpected("a vector of 2 numbers", width, operand=0)
        width, height = width.items
    if height is LEFT_OUT:
        raise Problem("E0308", "`canvas` needs `w` and `h`", "it is called canvas(w, h)")
    sides = []
    for operand, value in enumerate((width, height)):
        side = number(value, operand)
        if not side.is_integer() or not 1 <= side <= MAX_SIDE_PX:
            message = f"a canvas side of {show(side)} is not a whole number in 1..{MAX_SIDE_PX}"
            raise Problem("E0311", message, operand=operand)
        sides.append(int(side))
    session.settings.canvas = (sides[0], sides[1])


def _background(session: Session, span: Span, value: Any) -> None:
    if session.vocabulary.chosen is not None and session.vocabulary.dimension == 3:
        message = f"model `{session.vocabulary.chosen.name}` brings its own background"
        help = "in 3D the background belongs to the model"
        session.report.error("E0336", message, span, help=help, labels=session.model_label())
        return
    rgb = None if value is None else color(value)
    for component in rgb or ():
        if not 0.0 <= component <= 1.0:
            raise Problem("E0311", f"background component {show(component)} is outside 0..1", operand=0)
    session.settings.background = rgb


def _animate(session: Session, span: Span, seconds: Any, fps: Any, loop: Any) -> None:
    length = seconds.size if seconds.__class__ is Time else number(seconds, 0)
    rate = number(fps, 1)
    for operand, (what, value) in enumerate((("length", length), ("frame rate", rate))):
        if value <= 0.0:
            raise Problem("E0311", f"a {what} of {show(value)} is not above 0", operand=operand)
    if loop is not LEFT_OUT and loop.__class__ is not bool:
        raise unexpected("a boolean", loop, operand=2)
    rate = session.fps or rate
    if length * rate > MAX_FRAMES:
        raise Problem("E0311", f"an animation of more than {MAX_FRAMES:,} frames", operand=0)
    looping = loop is not False
    animation = make(Animation, {"seconds": length, "fps": rate, "loop": looping})
    session.settings.animation = animation
    frame, frames = session.frame, animation.frames
    if not 0 <= frame < frames:
        raise Problem("E0337", f"frame {frame} is outside 0..{frames - 1}")
    u = frame / frames if looping else frame / max(1, frames - 1)
    session.animated[:] = [frame / rate, u, float(frame), float(frames)]


_APPLY: Final[dict[str, Callable[..., None]]] = {
    "canvas": _canvas,
    "background": _background,
    "animate": _animate,
}


_BROUGHT = (nodes.Param, nodes.Let, nodes.Fn, nodes.Module, nodes.Import, nodes.Version)


def prepare_import(stmt: nodes.Import, place: Place) -> Action | None:
    context, alias = place.file, stmt.alias
    if not at_top_level(place, stmt.span, "an import"):
        define(alias, Binding("poison", alias.span), place)
        return None
    loader = context.loader
    binding = Binding("import", alias.span)
    good = define(alias, binding, place)
    found = loader.load(stmt, context.path, context.session)
    if found is None or not good:
        return None
    path, file = found
    prefix = f"{context.prefix}{alias.text}."
    brought = FileContext(file.span.source, context.session, loader, context.defines, path, prefix)
    loader.chain.append(path)
    loader.sites.append(stmt.path.span)
    try:
        body = prepare_file(brought, file, imported=True)
    finally:
        loader.chain.pop()
        loader.sites.pop()
    binding.value = brought

    def action(_: Env, out: Builder) -> None:
        for act in body.actions:
            act(brought.env, Builder())

    return action


def prepare_file(context: FileContext, file: nodes.File, *, imported: bool = False) -> Body:
    """Prepare a file's statements; of an imported one only what it brings."""
    report = context.session.report
    context.damage = find_damage(file, report.diagnostics)
    if context.damage:
        report.damaged[context.source] = context.damage
    context.first = file.statements[0] if file.statements else None
    statements = [s for s in file.statements if not imported or isinstance(s, _BROUGHT)]
    return prepare_block(statements, Place(context, context.scope, "file"), file.span)
