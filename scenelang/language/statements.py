"""Statements of the top level, params, texts, statements headed by a name, and what prepares what."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from numbers import Real
from pathlib import Path
from typing import Any, Final, NamedTuple

from scenelang.assets.element_file import ALIGNED, ElementFile, Font, FontError, Placed
from scenelang.language import (
    advice,
    blocks,
    expressions,
    foreign,
    library,
    modifiers,
    scopes,
    tree,
    values,
    words,
)
from scenelang.language.builder import Action, Builder, FileContext, Site, make
from scenelang.language.diagnostics import (
    Diagnostics,
    Edit,
    Fix,
    Label,
    SourceFile,
    Span,
    did_you_mean,
    instead,
    listing,
    removal,
)
from scenelang.language.expressions import VARIES, bind, lookup, prepare, prepare_arguments, wrong_kind
from scenelang.language.library import Written
from scenelang.language.limits import MAX_BYTES, MODULE_CALL, OBJECT
from scenelang.language.modifiers import LEFT_OUT, Spec, prepare_move, prepare_value_use, spread
from scenelang.language.nodes import LAMPS, MOST, Object, Scale, Translate, camera_fault
from scenelang.language.parser import parse
from scenelang.language.reporter import Advice, Reporter, find_damage
from scenelang.language.scene import MAX_FRAMES, Animation, Camera, Elements
from scenelang.language.session import Binding, Defines, Env, Session
from scenelang.language.values import POISON, UNITS, Angle, Problem, RangeValue, Time, Vec


def at_top_level(place: Site, span: Span, what: str, name: str = "") -> bool:
    """Test whether a statement stands at top level, and report it if not."""
    if place.kind == "file" and not place.nested:
        return True
    blocks.misplaced(place, span, f"{what} inside a block", name, "it stands at top level")
    return False


def _once(session: Session, what: str, span: Span) -> bool:
    """Test whether a setting may stand, the first of its word or up to eight lights, and report it if not."""
    given = session.settings.given.setdefault(what, [])
    given.append(span)
    if what == "light" and len(given) > LAMPS:
        help = "a radius makes one light as large as several"
        session.report.error("E0391", f"more than {LAMPS} lights", span, help=help)
    elif what != "light" and len(given) > 1:
        modifiers.given_twice(what, span, given[0], session.report)
    return len(given) <= (LAMPS if what == "light" else 1)


def prepare_version(stmt: tree.Version, place: Site) -> Action | None:
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


def prepare_model(stmt: tree.ModelStatement, place: Site) -> Action | None:
    session, name, span = place.session, stmt.name, stmt.name.span
    if not at_top_level(place, stmt.span, "'model'") or not _once(session, "model", stmt.span):
        return None
    if isinstance(name, tree.String):
        session.settings.model = name.value
    elif not isinstance(name, tree.BadExpr):
        prepare(name, place)
        session.report.error("E0301", "expected the model's name as a string", span)
    return None


def prepare_setting(stmt: tree.Call, place: Site) -> Action | None:
    """A statement of the top level that sets something for the whole picture."""
    session, name, span = place.session, stmt.name.text, stmt.name.span
    given = prepare_arguments(stmt.args, place)
    if not at_top_level(place, span, "`{}`", name) or not _once(session, name, span):
        return None
    if stmt.body is not None:
        session.report.error("E0330", f"`{name}` takes no block", span, help=f"write {name}(…);")
        return None
    spec = _SETTINGS[name]
    word, where = spec.word, Written(span, stmt.span)
    bound = bind(session.report, stmt.name, word.params, word.required, given, spread=spec.spread)
    getters = [None if one is None else one.code.run for one in bound or ()]
    operands = tuple([None if one is None else one.arg.value for one in bound or ()])

    def action(env: Env, out: Builder) -> None:
        values = [LEFT_OUT if get is None else get(env) for get in getters]
        try:
            if bound is not None and POISON not in values:
                _apply(spec, values, session, where)
                return
        except Problem as problem:
            advice.report_problem(session.report, problem, span, operands)
        if name == "animate":  # with a mistake, which is not a further one of what needs its variables
            session.animated[:] = [POISON] * 4

    return action


_SETTINGS: Final = {name: Spec.of(word) for name, word in words.SETTINGS.items()}


def _apply(spec: Spec, values: list[Any], session: Session, where: Written) -> None:
    """Set what a statement states; raises Problem."""
    settings, name = session.settings, spec.word.name
    if name in words.STAGE:
        settings.stage[name] = _joined(_stage(spec, values), spec, session, where)
    elif name == "animate":
        _animate(spec.read(values), session)
    elif name == "samples":
        settings.samples = spec.read(values)["n"]
    elif name == "canvas":
        settings.canvas = tuple(spec.read(spread(values, spec.word)).values())
    else:
        settings.background = spec.read(values)["c"]


def _joined(node: Any, spec: Spec, session: Session, where: Written) -> Any:
    """A part of the stage, or all lights so far with one more; reports `light(none)` beside another."""
    settings, name = session.settings, spec.word.name
    if node is not None:
        session.spans.record(node, where)
    if name not in settings.stage:
        return node
    lights = settings.stage[name]
    if node is not None and lights is not None:
        return (*lights, node) if isinstance(lights, tuple) else (lights, node)
    labels = (Label(settings.given[name][0], "the first light"),)
    help = "leave one of them out: the first light that is written replaces the usual one"
    session.report.error("E0390", "`light(none)` beside another light", where.name, labels=labels, help=help)
    return lights


def _stage(spec: Spec, values: list[Any]) -> Any:
    """The camera, light, ground or sky, None for `none` in place of a light or ground; raises Problem."""
    if values[0] is None and spec.word.name in ("ground", "light"):
        for at, value in enumerate(values):
            if at and value is not LEFT_OUT:
                fact = f"`{spec.word.name}(none)` has no {spec.word.params[at]}"
                raise Problem("E0308", fact.replace("color", "colour"), operand=at)
        return None
    node = spec.build(values)
    for at, (name, *_) in enumerate(spec.rows):
        value = getattr(node, name)
        numbers = value if value.__class__ is tuple else (value,)
        if values[at] is not LEFT_OUT and max(map(abs, numbers)) > MOST:
            raise Problem("E0311", f"`{name}` is not within {MOST:,.0f} of 0", operand=at)
    if isinstance(node, Camera) and (fault := camera_fault(node.eye, node.target, node.fov)):
        at = [*Camera.model_fields].index(fault[0])
        raise Problem("E0338", fault[1], operand=1 if values[at] is LEFT_OUT else at)
    return node


def _animate(fields: dict[str, Any], session: Session) -> None:
    fields["fps"] = session.fps or fields["fps"]
    if fields["seconds"] * fields["fps"] > MAX_FRAMES:
        raise Problem("E0311", f"an animation of more than {MAX_FRAMES:,} frames", operand=0)
    session.settings.animation = animation = make(Animation, fields)
    frame, frames = session.frame, animation.frames
    if not 0 <= frame < frames:
        raise Problem("E0337", f"frame {frame} is outside 0..{frames - 1}")
    u = frame / frames if animation.loop else frame / max(1, frames - 1)
    session.animated[:] = [frame / animation.fps, u, float(frame), float(frames)]


BROUGHT = (tree.Param, tree.Let, tree.Fn, tree.Module, tree.Import, tree.Version)


def prepare_import(stmt: tree.Import, place: Site) -> Action | None:
    context, alias = place.file, stmt.alias
    if not at_top_level(place, stmt.span, "an import"):
        blocks.define(alias, Binding("poison", alias.span), place)
        return None
    loader = context.loader
    binding = Binding("import", alias.span)
    good = blocks.define(alias, binding, place)
    if (loaded := loader.load(stmt, context.path, context.session)) is None or not good:
        return None
    path, file = loaded
    if isinstance(file, ElementFile):
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


def _elements(path: Path, zoo: ElementFile, stmt: tree.Import, context: FileContext) -> FileContext:
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
    for name, said in [pair for element in zoo.geometries.values() for pair in element.values.items()]:
        value = Vec(said) if isinstance(said, tuple) else said
        brought.scope.names.setdefault(name, Binding("let", stmt.alias.span, value=value, known=True))
    if zoo.font is not None:
        font = Letters(zoo.font, known)
        brought.scope.names["text"] = Binding("text", stmt.alias.span, value=font)
        width = partial(prepare_width, font)
        brought.scope.names["width"] = Binding("width", stmt.alias.span, value=width)
    brought.materials.update({name: f"{known}.{name}" for name in zoo.materials})
    return brought


def prepare_file(context: FileContext, file: tree.File, *, imported: bool = False) -> blocks.PreparedBlock:
    """Prepare a file's statements; of an imported one only what it brings."""
    report = context.session.report
    damage = find_damage(file, report.diagnostics)
    if damage.lines:
        report.damaged[context.source] = damage
    context.first = file.statements[0] if file.statements else None
    if imported:
        own = {s.name.text for s in file.statements if isinstance(s, tree.Module)}
        for stmt in file.statements:
            if isinstance(stmt, tree.Call) and stmt.name.text in words.STAGE and stmt.name.text not in own:
                help = "it belongs to the scene: put it into the file that is drawn"
                fact = f"`{stmt.name.text}` in an imported file"
                report.error_once((fact, context.source), "E0330", fact, stmt.name.span, help=help)
    statements = [s for s in file.statements if not imported or isinstance(s, BROUGHT)]
    return blocks.prepare_block(statements, Site(context, context.scope, "file"), file.span)


def prepare_param(stmt: tree.Param, place: Site) -> Action | None:
    file, name, session, slots = place.file, stmt.name, place.session, place.scope.slots
    default = prepare(stmt.default, place)
    bounds = prepare(stmt.range, place) if stmt.range is not None else None
    slot = slots.add()
    if not at_top_level(place, name.span, "a param"):
        blocks.define(name, Binding("poison", name.span), place)
        return None
    if not blocks.define(name, Binding("param", name.span, slots, slot, needs=session.needs), place):
        return None
    full = file.prefix + name.text
    file.has_params = True
    file.defines.known[full] = name.span

    def action(env: Env, out: Builder) -> None:
        given = file.defines.values.get(full, VARIES)  # which another run may change
        value = default.run(env)
        allowed = bounds.run(env) if bounds is not None else None
        if value is not POISON:
            value = _checked_default(value, allowed, stmt, session)
        if given is not VARIES:
            value = _from_outside(full, given, value, allowed, stmt, file)
        env[slot] = value
        if session.watch is not None:
            session.watch(name.span, value)

    return action


def _checked_default(value: Any, allowed: Any, stmt: tree.Param, session: Session) -> Any:
    """The default, or poison where it has no type for a param; reports one outside the range."""
    if value.__class__ not in (*UNITS, bool, str, Vec):
        message = f"{values.describe(value)} as the value of a param"
        help = "params are numbers, angles, times, booleans, strings and vectors"
        session.report.error("E0301", message, stmt.default.span, help=help)
        return POISON
    if stmt.range is None or allowed is POISON:
        return value
    if allowed.__class__ is not RangeValue and allowed.__class__ is not Vec:
        message = f"expected a range or a vector of choices, found {values.describe(allowed)}"
        session.report.error("E0301", message, stmt.range.span, help="write in 0..1")
        return value
    try:
        if not within(value, allowed):
            labels = (Label(stmt.range.span, "the range"),)
            message = f"default of `{stmt.name.text}` is outside {stmt.range.span.text}"
            about, fix = _range_meant(value, allowed, stmt.range)
            session.report.error("E0309", message, stmt.default.span, labels=labels, help=about, fix=fix)
    except Problem as problem:
        advice.report_problem(session.report, problem, stmt.range.span, (stmt.default,))
    return value


def _range_meant(value: Any, allowed: Any, range: tree.Expr) -> tuple[str | None, Fix | None]:
    """Help and fix for `in [3, 9]` where the default lies between the two."""
    ends = allowed.items if allowed.__class__ is Vec else ()
    if len(ends) != 2 or not all(one.__class__ is value.__class__ and one.__class__ in UNITS for one in ends):
        return None, None
    low, at, high = (values.unpack(one)[0] for one in (ends[0], value, ends[1]))
    if not low < at < high:
        return None, None
    help = "a vector has the choices there are; a range is written 3..9"
    if not isinstance(range, tree.Vector):
        return help, None
    text = "..".join(item.span.text for item in range.items)
    return help, Fix(f"write `{text}`", (Edit(range.span, text),))


def within(value: Any, allowed: Any) -> bool:
    """Test whether a value, or each number of a vector, is in a range or among choices; raises Problem."""
    if allowed.__class__ is Vec:
        return any(values.equal(value, choice) for choice in allowed.items)
    if value.__class__ is Vec:
        return all(within(item, allowed) for item in value.items)
    if value.__class__ not in UNITS:
        raise Problem("E0301", f"{values.describe(value)} with a range of {allowed.unit}s")
    x, kind = values.unpack(value)
    values.same_unit(x, kind, allowed.start or allowed.stop, allowed.unit)
    return bool(allowed.contains(x))


def _from_outside(
    full: str, given: Any, default: Any, allowed: Any, stmt: tree.Param, file: FileContext
) -> Any:
    """The value from outside, of the default's type and in range; poison after a report."""
    span, report = stmt.name.span, file.session.report
    text = given if isinstance(given, str) else repr(given)
    shown = f"{full}={text}" if len(text) <= 60 else f"{full}={text[:57]}…"
    value = given
    if default.__class__ is not str or not isinstance(given, str):
        value = literal(given, file) if isinstance(given, str) else from_python(given)
    help: str | None
    if value is None:
        colour = foreign.COLOURS.get(given.lower()) if isinstance(given, str) else None
        help = "write a number with its unit, a colour, a vector, true or false"
        help = f"colours have no names; {given} is {colour}" if colour else help
        labels = (Label(stmt.default.span, "its default"),)
        report.error("E0310", f"{shown} is not a literal", span, help=help, labels=labels)
        return POISON
    if default is POISON:
        return value
    if value.__class__ is float and default.__class__ is Time:
        value = Time(value)  # a bare number is seconds
    elif value.__class__ is float and default.__class__ is Angle and value == 0.0:
        value = Angle(0.0)
    if value.__class__ is not default.__class__:
        help = "give it a unit, as in 30deg" if default.__class__ is Angle else None
        message = f"{shown} is {values.describe(value)}, expected {values.describe(default)}"
        labels = (Label(stmt.default.span, f"its default is {values.describe(default)}"),)
        report.error("E0310", message, span, help=help, labels=labels)
        return POISON
    if stmt.range is not None and (allowed.__class__ is RangeValue or allowed.__class__ is Vec):
        try:
            inside = within(value, allowed)
        except Problem:
            return value  # the default has met and reported it
        if not inside:
            labels = (Label(stmt.range.span, "the range"),)
            report.error("E0309", f"{shown} is outside {stmt.range.span.text}", span, labels=labels)
            return POISON
    return value


def from_python(value: Any) -> Any:
    """A Python value as one of the language, which one of the language is; None where there is none."""
    if isinstance(value, bool | str | Angle | Time | Vec):
        return value
    if isinstance(value, Real):
        try:
            number = float(value)
        except OverflowError:
            return None
        return number if number - number == 0.0 else None
    if isinstance(value, Sequence) or hasattr(value, "tolist"):
        try:
            items = [from_python(item) for item in (value.tolist() if hasattr(value, "tolist") else value)]
            return None if None in items else Vec(tuple(items))
        except (Problem, RecursionError, TypeError):
            return None
    return None


def literal(text: str, file: FileContext) -> Any:
    """The value of a literal; None where ``text`` is not a literal."""
    diagnostics, around = Diagnostics(), file.session
    parsed = parse(SourceFile("", f"let value = {text};"), diagnostics)
    stmt = parsed.statements[0] if len(parsed.statements) == 1 else None
    if diagnostics.errors or not isinstance(stmt, tree.Let) or not _is_literal(stmt.value):
        return None
    session = Session(Reporter(diagnostics), around.expressions, around.statements)
    alone = FileContext(SourceFile("", text), session, file.loader, Defines({}))
    value = prepare(stmt.value, Site(alone, alone.scope, "file")).run([])
    return None if value is POISON or diagnostics.errors else value


def _is_literal(expr: tree.Expr) -> bool:
    """Test whether an expression names nothing and computes nothing but a sign."""
    match expr:
        case tree.NumberLiteral() | tree.Bool() | tree.ColorLiteral() | tree.String():
            return True
        case tree.Unary(op="-" | "+", operand=tree.NumberLiteral()):
            return True
        case tree.Vector():
            return all(_is_literal(item) for item in expr.items)
        case tree.CallExpr():
            return expr.name.text in ("rgb", "hsv") and all(_is_literal(a.value) for a in expr.args)
        case _:
            return False


class Letters(NamedTuple):
    """A font and the name that a Scene has its file by."""

    font: Font
    file: str


def _line(font: Font, text: Any, size: Any) -> tuple[list[Placed], float]:
    """The line of a text at a size of 1, and its width; raises Problem."""
    if text.__class__ is not str:
        raise values.unexpected("a string", text, operand=0)
    if values.number(size, 1) <= 0.0:
        raise Problem("E0311", f"a size of {values.show(size)} is not above 0", operand=1)
    if len(text) > values.MAX_TEXT:
        help = "write it as several texts, as one is a line"
        raise Problem("E0370", f"a text of more than {values.MAX_TEXT:,} characters", help, operand=0)
    try:
        return font.line(text)
    except FontError as error:
        learnt = "`scenelang learn Font.ttf` makes a font of letters of your own"
        help = "texts are one line each; write one for each line" if "break" in str(error) else learnt
        raise Problem("E0370", str(error), help, operand=0, letter=error.at) from None


def laid_out(font: Font, text: Any, size: Any = 1.0, align: Any = "left") -> list[Placed]:
    """The letters of a text in world units; raises Problem."""
    line, width = _line(font, text, size)
    if align.__class__ is not str:
        raise values.unexpected("a string", align, operand=2)
    if align not in ALIGNED:
        known = listing(ALIGNED)
        raise Problem("E0311", f"no text is aligned to `{align[:40]}`", f"align is {known}", operand=2)
    left = width * ALIGNED[align]
    return [Placed(name, size * (x - left), size * y, size * radius) for name, x, y, radius in line]


def width_of(font: Font) -> Callable[..., float]:
    """The function ``width`` of a font."""
    return lambda text, size=1.0: size * _line(font, text, size)[1]


def prepare_text(stmt: tree.Call, place: Site, letters: Letters) -> Action | None:
    """``abc.text("Ag", size = 0.5) { transforms }``: one child, a union of letters."""
    session, where, word = place.session, Written(stmt.name.span, stmt.span), words.LETTERS["text"]
    fits = blocks.holds_children(place, where.name, "a call of `{}`", stmt.name.text)
    given = prepare_arguments(stmt.args, place)
    block = blocks.prepare_inner(stmt.body, place.inner("object")) if stmt.body is not None else None
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
            advice.report_problem(session.report, problem, where.name, operands)
            return
        session.tick(OBJECT * len(values[0]), where.name)
        session.count_objects(len(line), where.name)
        session.count_parts(2 * len(line), where.name)
        inside = Builder()
        for name, x, y, radius in line:
            scale = make(Scale, {"kind": "scale", "x": radius, "y": radius, "z": radius})
            moves = scale, make(Translate, {"kind": "translate", "x": x, "y": y, "z": 0.0})
            fields: dict[str, Any] = {"kind": "object", "geometry": f"{file}.{name}"}
            fields |= {"transforms": moves, "material": None, "points": ()}
            blocks.place_child(make(Object, fields), where, inside, session)
        blocks.place_called(inside, block, env, where, out, session)

    return action


def prepare_width(
    letters: Letters, expr: tree.CallExpr, given: list[expressions.Given], place: Site
) -> expressions.Code | None:
    """``abc.width("Ag", size = 0.5)``, a number; None after a report."""
    word = words.LETTERS["width"]
    if (bound := bind(place.report, expr.name, word.params, word.required, given)) is None:
        return None
    codes = [one.code for one in bound if one is not None]
    exprs = [one.arg.value for one in bound if one is not None]
    return expressions.computed(place, width_of(letters.font), expr.span, exprs, codes)


def prepare_headed(stmt: tree.Call, place: Site) -> Action | None:
    name = stmt.name.text
    binding = None if name in words.LANGUAGE else lookup(stmt.name, place)
    head = scopes.head_of(stmt, binding, place.kind)
    if head == "setting":
        return prepare_setting(stmt, place)
    if head == "move":
        return prepare_move(stmt, place)
    if binding is None or head == "leaf":
        if name in words.GEOMETRIES or name in words.OUTLINES:
            return blocks.prepare_object(stmt, place)
        if not _lacks_module(stmt, place):
            if _boolean(stmt) is None:
                _skim(stmt, place)
            _unknown(stmt, place)
        return None
    if binding.kind == "module":
        return blocks.prepare_module_call(stmt, binding.value, place)
    if binding.kind == "text":
        return prepare_text(stmt, place, binding.value)
    if binding.kind == "element":
        return blocks.prepare_element(stmt, place, binding.value)
    if binding.kind in scopes.VALUES:
        return prepare_value_use(stmt, binding, place)
    _skim(stmt, place)
    if binding.kind != "poison":
        wrong_kind(stmt.name, binding, place, "an object or a module")
    return None


def _boolean(stmt: tree.Call) -> str | None:
    """The boolean word that a call with objects as arguments stands for."""
    here = foreign.WORDS.get(stmt.name.text.lower())
    return here if here in words.COMBINE and stmt.args and stmt.body is None else None


def _skim(stmt: tree.Call, place: Site) -> None:
    """Look for mistakes in the arguments and the block of something that will not run."""
    prepare_arguments(stmt.args, place)
    blocks.prepare_inner(stmt.body, place.inner("unknown"))


def _lacks_module(stmt: tree.Call, place: Site) -> bool:
    """Report ``dot(x, y) { … }`` whose arguments are unknown names: the word `module` is missing."""
    name = stmt.name.text
    if stmt.body is None or not stmt.args or "." in name:
        return False
    values = [arg.value.name for arg in stmt.args if isinstance(arg.value, tree.NameRef) and not arg.name]
    params = [arg.name for arg in stmt.args if arg.name] + values
    if len(params) < len(stmt.args) or not values:
        return False
    if any(place.scope.find(p.text) or p.text in words.CONSTANTS or p.text in words.ANIMATED for p in values):
        return False
    body = place.inner("unknown")
    body.scope.names.update({param.text: Binding("poison", param.span) for param in params})
    blocks.prepare_inner(stmt.body, body)
    written = ", ".join(arg.span.text for arg in stmt.args)
    help = f"to define it write module {name}({written}) {{ … }}"
    message = f"unknown geometry or module `{name}`"
    advice.report_unknown(stmt.name, place, "E0204", message, lambda: (help, None))
    return True


def _unknown(stmt: tree.Call, place: Site) -> None:
    """Report a statement whose name stands for nothing."""
    name, text = stmt.name, stmt.name.text
    if "." in text:
        if (alias := place.scope.find(text.partition(".")[0])) is None:
            advice.unknown(name, place)
        elif alias.kind == "import":
            advice.unknown_member(name, place, alias.value, kinds=("module", "text", "element"))
        else:
            wrong_kind(name, alias, place, "an imported file")
        return
    if advice.report_early(name, place):
        return
    if text in words.FUNCTIONS:
        call, inside = stmt.span.text.rstrip("; "), place.kind == "material"
        written = f"write color({call});" if inside else advice.material_advice(place, "color", call)
        message = f"`{text}` is a function, not an object or a module"
        place.report.error("E0213", message, name.span, help=written if text in ("rgb", "hsv") else None)
        return
    what = {"object": "transform", "material": "texture operation"}.get(place.kind, "geometry or module")
    advice.report_unknown(name, place, "E0204", f"unknown {what} `{text}`", lambda: _advice(stmt, place))


def _advice(stmt: tree.Call, place: Site) -> Advice:
    """Advice on a statement whose name stands for nothing."""
    name, text = stmt.name, stmt.name.text
    candidates = _candidates(stmt, place)
    help, fix = did_you_mean(text, candidates, name.span, effort=place.report.effort)
    if fix is None and text.lower() in foreign.STATEMENTS:
        help = None  # what is known of a word goes before what is only near
    if place.kind == "object" and text in words.MATERIALS:
        return _lacks_material(stmt)
    if help is None and place.kind in blocks.HOLDERS:
        if (here := _boolean(stmt)) is not None:
            return f"it is called `{here}` here and has a block: {here} {{ square; star; }}", None
        help, fix = advice.in_library(stmt, place), None
    if fix is None or fix.guess:
        known, sure = instead(text, foreign.WORDS, candidates, name.span)
        help, fix = known or help, sure or fix
    if fix is not None and stmt.body is not None and fix.edits[0].replacement in words.NODES:
        span = Span(name.span.source, name.span.start, stmt.body.span.start)  # without parentheses
        fix = Fix(fix.message, (Edit(span, f"{fix.edits[0].replacement} "),), fix.guess)
    meant = foreign.WORDS.get(text, "")
    if help is None and place.kind == "object" and meant in words.OPERATIONS.keys() - words.TRANSFORMS.keys():
        help = f"it is called `{meant}` here and stands in a material: {advice.material_advice(place, meant)}"
    help = help or foreign.STATEMENTS.get(text.lower())
    if help is None and place.kind in ("file", "group", "chain"):
        help = advice.drawn(place)
    there = {"material": words.OPERATIONS, "object": words.TRANSFORMS}.get(place.kind)
    if help is None and there and stmt.args is not None:
        help = f"there is {listing(there)}"
    return help, fix


def _lacks_material(stmt: tree.Call) -> Advice:
    """`square { flat(#f00); }`: the word `material` is missing."""
    written = f"material {stmt.name.text}"
    if stmt.args is None:
        return f"write {written}", Fix("insert `material`", (Edit(stmt.name.span, written),))
    colour = stmt.args[0].value.span.text if len(stmt.args) == 1 else "…"
    written = f"{written} {{ color({colour}); }}"
    if colour == "…" or stmt.body is not None:
        return f"write {written}", None
    return f"write {written}", Fix(f"write `{written}`", (Edit(stmt.span, written),))


def _candidates(stmt: tree.Call, place: Site) -> set[str]:
    """Names that could have been meant, given where the statement stands and how it looks."""
    kind = place.kind
    if kind == "material":
        return {*words.OPERATIONS}
    if kind == "object" and stmt.args is not None:
        return {*words.TRANSFORMS}
    names = advice.visible(place, scopes.VALUES if kind == "object" else ("module",))
    if kind == "object":
        return {*names, "material"}
    known = {*words.GEOMETRIES, *words.OUTLINES, *names}
    if stmt.body is None:
        calls = words.TRANSFORMS if kind != "file" else words.SETTINGS
        return known if stmt.args is None else known | {*calls}
    before = stmt.span.source.text[max(0, stmt.span.start - 1000) : stmt.span.start].rstrip()
    otherwise = before.endswith("}")
    if not stmt.args:
        known = {*known, *words.NODES, *(["else"] if otherwise else [])}
    return {*known, "else if"} if stmt.args is not None and otherwise else known


EXPRESSIONS: Final[Mapping[type, Callable[..., Any]]] = {
    tree.NumberLiteral: expressions.prepare_number,
    tree.String: lambda expr, place: expressions.constant(expr.value),
    tree.Bool: lambda expr, place: expressions.constant(expr.value),
    tree.ColorLiteral: lambda expr, place: expressions.constant(Vec(tuple(map(float, expr.rgb)))),
    tree.Vector: blocks.prepare_vector,
    tree.Range: expressions.prepare_range,
    tree.NameRef: expressions.prepare_name,
    tree.Unary: expressions.prepare_unary,
    tree.Binary: expressions.prepare_binary,
    tree.Conditional: expressions.prepare_conditional,
    tree.CallExpr: expressions.prepare_call,
    tree.Member: expressions.prepare_member,
    tree.Index: lambda expr, place: expressions.computed(
        place, expressions.item, expr.span, (expr.value, expr.index), item_steps=0
    ),
    tree.MaterialExpr: modifiers.prepare_material,
    tree.BadExpr: lambda expr, place: expressions.POISONED,  # recovery has reported it
}
STATEMENTS: Final[Mapping[type, Callable[..., Any]]] = {
    tree.Version: prepare_version,
    tree.ModelStatement: prepare_model,
    tree.Param: prepare_param,
    tree.Let: blocks.prepare_let,
    tree.Fn: lambda stmt, place: None,  # `prepare_block` has declared it
    tree.Module: lambda stmt, place: None,
    tree.Import: prepare_import,
    tree.For: blocks.prepare_for,
    tree.If: blocks.prepare_if,
    tree.Call: prepare_headed,
    tree.Node: blocks.prepare_node,
    tree.Combined: blocks.prepare_combined,
    tree.MaterialUse: modifiers.prepare_use,
    tree.BadStmt: lambda stmt, place: None,
}
