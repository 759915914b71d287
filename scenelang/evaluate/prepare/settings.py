"""Statements of the top level: version, model, canvas, background, animation, stage, imports; whole files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.fixes import removal
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.elements.zoo import Zoo
from scenelang.evaluate.builder import Builder, make
from scenelang.evaluate.file_context import Action, FileContext, Place
from scenelang.evaluate.limits import MAX_BYTES
from scenelang.evaluate.names import Binding, Env
from scenelang.evaluate.prepare.blocks import Body, define, misplaced, prepare_block
from scenelang.evaluate.prepare.calls import bind
from scenelang.evaluate.prepare.expressions import prepare, prepare_arguments
from scenelang.evaluate.report.reporter import find_damage
from scenelang.evaluate.report.type_errors import report_problem
from scenelang.evaluate.session import Session
from scenelang.evaluate.values.functions import angle, number
from scenelang.evaluate.values.transforms import color, vector
from scenelang.evaluate.values.value import POISON, Problem, Time, Vec, show, unexpected
from scenelang.scene import library
from scenelang.scene.faults import MOST, camera_fault, light_fault
from scenelang.scene.schema import MAX_FRAMES, Animation, Camera, Elements, Ground, Light
from scenelang.scene.spans import Written
from scenelang.syntax import nodes
from scenelang.words import SETTINGS, STAGE

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
        more = "; there is one light, and its power says how bright" if what == "light" else ""
        help = f"leave one of them out{more}"
        session.report.error("E0333", f"`{what}` is given twice", span, labels=labels, help=help)
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
    if isinstance(name, nodes.String):
        session.settings.model = name.value
    elif not isinstance(name, nodes.BadExpr):
        prepare(name, place)
        session.report.error("E0301", "expected the model's name as a string", span)
    return None


def prepare_setting(stmt: nodes.Call, place: Place) -> Action | None:
    """``canvas``, ``background``, ``animate``, ``camera``, ``light`` or ``ground``."""
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

    where = Written(span, stmt.span)

    def action(env: Env, out: Builder) -> None:
        values = [LEFT_OUT if get is None else get(env) for get in getters]
        try:
            if bound is not None and POISON not in values:
                apply(session, where, *values)
                return
        except Problem as problem:
            report_problem(session.report, problem, span, operands)
        if name == "animate":  # with a mistake, which is not a further one of what needs its variables
            session.animated[:] = [POISON] * 4

    return action


def _canvas(session: Session, where: Written, width: Any, height: Any) -> None:
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


def _opaque(value: Any, what: str, operand: int) -> tuple[float, float, float]:
    """A colour whose components are in 0..1."""
    rgb = color(value, operand)
    for component in rgb:
        if not 0.0 <= component <= 1.0:
            raise Problem("E0311", f"{what} component {show(component)} is outside 0..1", operand=operand)
    return rgb


def _background(session: Session, where: Written, value: Any) -> None:
    session.settings.background = None if value is None else _opaque(value, "background", 0)


def _state(session: Session, where: Written, cls: type[Camera | Light | Ground], *given: Any) -> None:
    """Set one value of the stage from its fields in order, with defaults for those left out."""
    names = list(cls.model_fields)
    for at, value in enumerate(given):
        if value is not LEFT_OUT and max(map(abs, value if value.__class__ is tuple else (value,))) > MOST:
            raise Problem("E0311", f"`{names[at]}` is not within {MOST:,.0f} of 0", operand=at)
    default = [field.default for field in cls.model_fields.values()]
    values = [own if value is LEFT_OUT else value for value, own in zip(given, default, strict=True)]
    node = make(cls, dict(zip(names, values, strict=True)))
    if isinstance(node, Camera) and (fault := camera_fault(node.eye, node.target, node.fov)):
        at = names.index(fault[0])
        raise Problem("E0338", fault[1], operand=1 if given[at] is LEFT_OUT else at)
    if isinstance(node, Light) and (dark := light_fault(node.power)):
        raise Problem("E0339", dark, operand=1)
    session.settings.stage[cls.__name__.lower()] = node
    session.spans.record(node, where)


def _given(value: Any, read: Callable[..., Any], *rest: Any) -> Any:
    return LEFT_OUT if value is LEFT_OUT else read(value, *rest)


def _camera(session: Session, where: Written, eye: Any, target: Any, fov: Any) -> None:
    points = [_given(value, vector, 3, at, "a point") for at, value in enumerate((eye, target))]
    _state(session, where, Camera, *points, _given(fov, angle, 2))


def _light(session: Session, where: Written, position: Any, power: Any, rgb: Any) -> None:
    place = _given(position, vector, 3, 0, "a point")
    if power.__class__ is Vec:
        raise unexpected("a number", power, "the power is second: light([2, 4, 3], 30, #fff)", 1)
    _state(session, where, Light, place, _given(power, number, 1), _given(rgb, _opaque, "colour", 2))


def _ground(session: Session, where: Written, y: Any, rgb: Any) -> None:
    if y.__class__ is Vec:
        raise unexpected(
            "a number", y, "the height comes first: ground(-1, #888), or ground(color = #888)", 0
        )
    if y is not None:
        _state(session, where, Ground, _given(y, number, 0), _given(rgb, _opaque, "colour", 1))
        return
    if rgb is not LEFT_OUT:
        raise Problem("E0308", "`ground(none)` has no colour", operand=1)
    session.settings.stage["ground"] = None


def _animate(session: Session, where: Written, seconds: Any, fps: Any, loop: Any) -> None:
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
    "camera": _camera,
    "light": _light,
    "ground": _ground,
}


BROUGHT = (nodes.Param, nodes.Let, nodes.Fn, nodes.Module, nodes.Import, nodes.Version)


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
    if isinstance(file, Zoo):
        binding.value = _elements(path, file, stmt, context)
        return None
    known = loader.prepared.get(path)
    if known is not None and not known.has_params:  # it means the same wherever it is imported
        binding.value = known
        return None
    if known is not None:
        loader.repeated += len(file.span.source.text)
        if loader.repeated > MAX_BYTES:
            message = f"files with params that are imported again come to more than {MAX_BYTES:,} characters"
            raise context.session.halt("E0324", message, stmt.path.span)
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
    loader.prepared[path] = brought
    context.has_params |= brought.has_params

    def action(_: Env, out: Builder) -> None:
        for act in body.actions:
            act(brought.env, Builder())

    return action


def _elements(path: Path, zoo: Zoo, stmt: nodes.Import, context: FileContext) -> FileContext:
    """An imported file of elements as a file whose names they are."""
    session, root = context.session, context.loader.root
    if path not in session.elements:
        taken, name, count = {e.name for e in session.elements.values()}, stmt.alias.text, 1
        while name in taken:  # the alias of another file, elsewhere
            count += 1
            name = f"{stmt.alias.text}_{count}"
        inside = root is not None and not library.owns(path)
        written = path.relative_to(root).as_posix() if root is not None and inside else stmt.path.value
        session.elements[path] = Elements.of(name, written, zoo)
    known = session.elements[path].name
    source = SourceFile(stmt.path.value, "")
    brought = FileContext(source, session, context.loader, context.defines, path)
    for name in (*zoo.geometries, *zoo.groups):
        brought.scope.names[name] = Binding("element", stmt.alias.span, value=f"{known}.{name}")
    brought.materials.update({name: f"{known}.{name}" for name in zoo.materials})
    return brought


def prepare_file(context: FileContext, file: nodes.File, *, imported: bool = False) -> Body:
    """Prepare a file's statements; of an imported one only what it brings."""
    report = context.session.report
    damage = find_damage(file, report.diagnostics)
    if damage.lines:
        report.damaged[context.source] = damage
    context.first = file.statements[0] if file.statements else None
    if imported:
        own = {s.name.text for s in file.statements if isinstance(s, nodes.Module)}
        for stmt in file.statements:
            if isinstance(stmt, nodes.Call) and stmt.name.text in STAGE and stmt.name.text not in own:
                help = "it belongs to the scene: put it into the file that is drawn"
                fact = f"`{stmt.name.text}` in an imported file"
                report.error_once((fact, context.source), "E0330", fact, stmt.name.span, help=help)
    statements = [s for s in file.statements if not imported or isinstance(s, BROUGHT)]
    return prepare_block(statements, Place(context, context.scope, "file"), file.span)
