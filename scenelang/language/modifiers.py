"""Transforms, texture operations and materials: their arguments, and the nodes they make."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final

from scenelang.assets.element import STOPS, material_fault
from scenelang.assets.records import Record
from scenelang.language import advice, expressions, nodes, scopes, tree, words
from scenelang.language.blocks import misplaced, prepare_inner
from scenelang.language.builder import Action, Builder, FileContext, Site, make
from scenelang.language.diagnostics import Edit, Fix, Label, Span
from scenelang.language.expressions import POISONED, Code, Given, bind
from scenelang.language.library import Written
from scenelang.language.limits import MATERIAL_VALUE, MATRIX, MOVE, SAME_MOVE
from scenelang.language.reporter import Reporter
from scenelang.language.scene import Material
from scenelang.language.session import Binding, Env, Session
from scenelang.language.values import (
    POISON,
    Angle,
    MaterialValue,
    Problem,
    Time,
    Vec,
    angle,
    describe,
    number,
    show,
    unexpected,
)

LEFT_OUT: Final = object()  # an argument that was not given; None is the value ``none``
MAX_SIDE_PX: Final = 8192


def vector(value: Any, length: int, operand: int = 0, what: str = "a vector") -> tuple[float, ...]:
    """``length`` numbers; raises Problem for anything else."""
    if value.__class__ is not Vec or len(value.items) != length:
        help = "write [x, y, z], or X, Y or Z" if what in ("a point", "an axis") else None
        raise unexpected(f"{what} of {length} numbers", value, help, operand)
    return tuple([number(item, operand) for item in value.items])


def color(value: Any, operand: int = 0) -> tuple[float, ...]:
    """A colour's three numbers."""
    if value.__class__ is not Vec:
        help = "write #d33, [r, g, b], rgb(r, g, b) or hsv(h, s, v)"
        raise unexpected("a colour", value, help, operand, fix="colour")
    if len(value.items) == 4:
        help = "colours have no alpha: leave the fourth out"
        raise unexpected("a colour of 3 numbers", value, help, operand)
    return vector(value, 3, operand, "a colour")


def _opaque(value: Any, operand: int, what: str = "colour") -> tuple[float, ...]:
    rgb = color(value, operand)
    for component in rgb:
        if not 0.0 <= component <= 1.0:
            raise Problem("E0311", f"{what} component {show(component)} is outside 0..1", operand=operand)
    return rgb


def _within(
    fits: Callable[[float], bool], message: str, help: str | None = None, code: str = "E0311"
) -> Callable[[Any, int], float]:
    """The reader of a number that fits; the message has ``{}`` for one that does not."""

    def read(value: Any, operand: int) -> float:
        given = number(value, operand)
        if not fits(given):
            raise Problem(code, message.format(show(given)), help, operand)
        return given

    return read


def _boolean(value: Any, operand: int) -> bool:
    if value.__class__ is bool:
        return value
    raise unexpected("a boolean", value, operand=operand)


def _axis(value: Any, operand: int) -> tuple[float, ...]:
    axis = vector(value, 3, operand, "an axis")
    if not any(axis):
        raise Problem("E0312", "an axis of length 0", operand=operand)
    return axis


def _rate(value: Any, operand: int) -> float:
    if value.__class__ is Angle:
        help = "k is radians per unit length, a bare number: divide by 1rad"
        raise unexpected("a number", value, help, operand)
    return number(value, operand)


def _rows(rows: Any, operand: int) -> tuple[tuple[float, ...], ...]:
    if rows.__class__ is not Vec or len(rows.items) != 4:
        raise unexpected("4 rows of 4 numbers", rows, operand=operand)
    values = tuple([vector(row, 4, operand, "a row") for row in rows.items])
    if values[3] != (0.0, 0.0, 0.0, 1.0):
        raise Problem("E0311", "the last row of a matrix is not 0, 0, 0, 1", operand=operand)
    if nodes.singular(values):
        raise Problem("E0312", "a singular matrix flattens what it moves", operand=operand)
    return values


def _power(value: Any, operand: int) -> float:
    power = number(value, operand)
    if (fault := nodes.light_fault(power)) is not None:
        raise Problem("E0339", fault, operand=operand)
    if power > nodes.MOST:
        raise Problem("E0311", f"`power` is not within {nodes.MOST:,.0f} of 0", operand=operand)
    return power


_LEAF: Final = "{} is in units of the leaf, before any scale"
_side = _within(
    lambda side: side.is_integer() and 1 <= side <= MAX_SIDE_PX,
    f"a canvas side of {{}} is not a whole number in 1..{MAX_SIDE_PX}",
)
_samples = _within(lambda count: count in nodes.SAMPLES, "{} samples a pixel, where it takes 4 or 16")
_seconds = _within(lambda seconds: seconds > 0.0, "a length of {} is not above 0")

KINDS: Final[dict[str, Callable[[Any, int], Any]]] = {
    "number": number,
    "angle": angle,
    "hue": lambda value, at: angle(value, at, "hue"),
    "rate": _rate,
    "factor": _within(
        bool,
        "a scale by 0 flattens what it moves",
        "leave it out, or write a factor other than 0; decimals stand behind a point",
        "E0312",
    ),
    "growth": _within(lambda r: -0.5 <= r <= 1.0, "a growth of {} is outside -0.5..1", _LEAF.format("r")),
    "wall": _within(lambda w: 0.0 < w <= 1.0, "a wall of {} is not above 0 and at most 1", _LEAF.format("w")),
    "point": lambda value, at: vector(value, 3, at, "a point"),
    "axis": _axis,
    "rows": _rows,
    "colour": color,
    "opaque": _opaque,
    "backdrop": lambda value, at: None if value is None else _opaque(value, at, "background"),
    "side": lambda value, at: int(_side(value, at)),
    "share": _within(lambda share: 0.0 <= share <= 1.0, "an opacity of {} is outside 0..1"),
    "power": _power,
    "exposure": _within(lambda times: times > 0.0, "an exposure of {} is not above 0"),
    "distance": _within(lambda far: far > 0.0, "a distance of {} is not positive"),
    "extent": _within(lambda radius: radius >= 0.0, "a radius of {} is negative"),
    "density": _within(
        lambda s: 0.0 < s <= nodes.DENSEST,
        f"a density of {{}} is not above 0 and at most {nodes.DENSEST:,.0f}",
        "in mist of 3 a third of a unit lets 37 % of the light through",
    ),
    "roughness": _within(lambda r: 0.05 <= r <= 1.0, "a roughness of {} is outside 0.05..1"),
    "samples": lambda value, at: int(_samples(value, at)),
    "seconds": lambda value, at: _seconds(value.size if value.__class__ is Time else value, at),
    "fps": _within(lambda rate: rate > 0.0, "a frame rate of {} is not above 0"),
    "boolean": _boolean,
}
"""Readers of arguments by their kinds in `words`: the value in base units; each raises Problem."""
_ONE_AXIS: Final = "it turns by one angle about one axis: rotate(45deg), or rotate(45deg, axis = X)"
_HELP: Final = {
    "rotate": _ONE_AXIS,
    "shear": "name the term, as in shear(xy = 0.5)",
    "color": "it is called color(c), with c as #d33, [r, g, b], rgb(r, g, b) or hsv(h, s, v)",
    **{name: f"it is called {words.TRANSFORMS[name].head}" for name in ("scale", "matrix")},
}
_NO_VECTOR: Final = {
    "rotate": (0, _ONE_AXIS),
    "light": (1, "the power is second: light([2, 4, 3], 30, #fff)"),
    "ground": (0, "the height comes first: ground(-1, #888), or ground(color = #888)"),
}
"""Arguments in whose place a vector is a common mistake, and what to say of it."""


class Spec(Record):
    """A reader of a statement's arguments: into a node, or values in order where it has none."""

    word: words.Word
    help: str | None  # advice for a wrong number of arguments; None prints the signature
    spread: bool  # whether one vector may stand for all arguments
    node: type[nodes.Frozen] | None  # None for a single value: of a material, or of the picture
    rows: tuple[tuple[str, Callable[[Any, int], Any], Any, int], ...]  # field, reader, default, number
    stated: bool  # whether it is a setting, or a property of a material

    @staticmethod
    def of(word: words.Word) -> Spec:
        """The one for a word of the language."""
        node = getattr(nodes, "Animation" if word.name == "animate" else word.name.capitalize(), None)
        fields = {} if node is None else {n: f for n, f in node.model_fields.items() if n != "kind"}
        defaults = [1.0 if field.is_required() else field.default for field in fields.values()]
        readers = [KINDS[kind] for kind in word.kinds]
        rows = tuple(zip(fields or word.params, readers, defaults or [None] * 2, range(6), strict=False))
        spread = word.name in ("translate", "scale", "canvas")
        stated = word.name in words.SETTINGS or word.name in words.PROPERTIES
        return Spec(word, _HELP.get(word.name), spread, node, rows, stated)

    def read(self, values: Sequence[Any]) -> dict[str, Any]:
        """Fields of the node; raises Problem."""
        fields: dict[str, Any] = {} if self.stated else {"kind": self.word.name}
        at, value = 0, None
        try:
            for (name, read, default, at), value in zip(self.rows, values, strict=False):
                fields[name] = default if value is LEFT_OUT else read(value, at)
        except Problem as problem:
            place, help = _NO_VECTOR.get(self.word.name, (at, problem.help))
            problem.help = help if at == place and value.__class__ is Vec else problem.help
            raise
        return fields

    def build(self, values: Sequence[Any]) -> Any:
        """The node of values, one an argument; raises Problem."""
        assert self.node is not None
        return make(self.node, self.read(spread(values, self.word) if self.spread else values))


def _shear(spec: Spec, terms: Sequence[Any]) -> nodes.Shear:
    given = [at for at, term in enumerate(terms) if term is not LEFT_OUT]
    if len(given) != 1:
        help = "write one term a call, as in shear(xy = 0.5); several calls apply in order"
        raise Problem("E0308", f"shear takes one term, found {len(given)}", help)
    at = given[0]
    return make(nodes.Shear, {"kind": "shear", "axes": spec.word.params[at], "k": number(terms[at], at)})


GEOMETRY: Final = {name: Spec.of(word) for name, word in words.TRANSFORMS.items()}
TEXTURE: Final = {name: Spec.of(word) for name, word in words.OPERATIONS.items()}
_ANY_WALL: Final = _within(lambda w: w > 0.0, "a wall of {} is not above 0")
BY_POINTS: Final = {
    name: replace(GEOMETRY[name], rows=((field, read, 1.0, 0),))
    for name, field, read in (("grow", "r", number), ("shell", "w", _ANY_WALL))
}
"""In the blocks of polygons and splines, in whose own units the numbers are."""
EVEN_SCALE: Final = replace(GEOMETRY["scale"], word=words.Word("scale", "scale(s)", "", ("s",), 1))


def spread(values: Sequence[Any], word: words.Word) -> Sequence[Any]:
    """Arguments in full: the items of one vector, or the values as they are; raises Problem."""
    first, params, required = values[0], word.params, word.required
    if len(values) > 1 and (values[1] is not LEFT_OUT or values[-1] is not LEFT_OUT):
        return values
    if len(params) == 1 and first.__class__ is not Vec:  # scale(s)
        return [first] * 3
    if first.__class__ is float:
        missing = " and ".join(f"`{name}`" for name in params[1:required])
        raise Problem("E0308", f"{missing} is missing, or a vector of all components")
    if first.__class__ is not Vec:
        raise unexpected("a vector or its components", first, operand=0)
    params, required = (words.TRANSFORMS["scale"].params, 2) if len(params) == 1 else (params, required)
    if not required <= len(first.items) <= len(params):
        counts = " or ".join(str(count) for count in range(required, len(params) + 1))
        raise unexpected(f"a vector of {counts} numbers", first, operand=0)
    return [*first.items, *[LEFT_OUT] * (len(params) - len(first.items))]


def prepare_move(stmt: tree.Call, place: Site) -> Action | None:
    """The action of a transform or a texture operation; checks that it may stand here."""
    name, report = stmt.name.text, place.report
    given = expressions.prepare_arguments(stmt.args, place, name)
    if (spec := _spec(stmt, place)) is None:
        return None
    if stmt.body is not None:
        help = f"put {name}(…); into the block of what it moves, as in square {{ {name}(…); }}"
        _skim(stmt, place)
        report.error("E0330", f"`{name}` takes no block", stmt.name.span, help=help)
        return None
    if name == "scale" and len(given) == 1 and (given[0].arg.name is None or given[0].arg.name.text == "s"):
        spec = EVEN_SCALE
    spec = BY_POINTS.get(name, spec) if place.by_points and place.kind == "object" else spec
    word = spec.word
    bound = bind(report, stmt.name, word.params, word.required, given, spread=spec.spread, help=spec.help)
    if bound is None:
        return None
    if name == "shear" and any(arg.name is None for arg, _ in given):
        report.error("E0308", "shear takes a named term", given[0].arg.span, help=spec.help)
        return None
    return _action(spec, bound, stmt, place)


def _spec(stmt: tree.Call, place: Site) -> Spec | None:
    """The operation that the name stands for in such a block; None with a report if there is none."""
    name, span = stmt.name.text, stmt.name.span
    if place.kind == "material":
        if name not in TEXTURE:
            misplaced(place, span, "`{}` does not move textures", name, "put it into the object's block")
        return TEXTURE.get(name)
    if name not in GEOMETRY and place.kind != "unknown":
        help = f"put it into a material's block, as in {advice.material_advice(place, name)}"
        if name == "flip":
            help = "a material's flip() mirrors its texture; for an object write scale(-1, 1)"
        _skim(stmt, place)
        misplaced(place, span, "`{}` stands outside a material", name, help)
        return None
    if place.kind == "file":
        help = "put what it moves and the transform into group { … }"
        _skim(stmt, place)
        misplaced(place, span, "transform `{}` at top level", name, help)
        return None
    return GEOMETRY.get(name) or TEXTURE[name]


def _skim(stmt: tree.Call, place: Site) -> None:
    """Look through the block of a transform as one of children."""
    if stmt.body is not None and place.kind in ("file", "group", "chain"):
        prepare_inner(stmt.body, place.inner("group"))


def _action(spec: Spec, bound: Sequence[Given | None], stmt: tree.Call, place: Site) -> Action:
    session, span, where = place.session, stmt.name.span, Written(stmt.name.span, stmt.span)
    operands = tuple([None if one is None else one.arg.value for one in bound])
    first = operands[0] if operands else None
    if first is not None and not any(operands[1:]):
        operands = (first,) * len(spec.rows)

    def construct(values: list[Any]) -> Any:
        """The node, or None after a report."""
        if POISON in values:
            return None
        try:
            if spec.node is None:  # a property that is a number
                return spec.read(values)[spec.word.params[0]]
            node = _shear(spec, values) if spec.node is nodes.Shear else spec.build(values)
        except Problem as problem:
            advice.report_problem(session.report, problem, span, operands)
            return None
        if isinstance(node, nodes.Color | nodes.Grayscale | nodes.Stop):
            _warn(node, session.report, next((o.span for o in reversed(operands) if o is not None), span))
        return node

    def append(node: Any, out: Builder) -> None:
        if (name := spec.word.name) in words.PROPERTIES:
            first = out.properties.setdefault(name, (span, node))[0]
            if first is not span:
                given_twice(name, span, first, session.report)
            return
        if out.moved is None:
            out.moved = span  # even by a transform with a mistake: children have their order all the same
        if node is not None:
            session.spans.record(node, where, session.report.calls)
            session.count_parts(1, span)
            out.transforms.append(node)
            if session.watch is not None:
                session.watch(stmt.span, node)

    if all(one is None or one.code.value is not expressions.VARIES for one in bound):
        place.file.weight += SAME_MOVE
        constants = [LEFT_OUT if one is None else one.code.value for one in bound]
        created: list[Any] = []

        def repeat(env: Env, out: Builder) -> None:
            if not created:
                created.append(construct(constants))
            append(created[0], out)

        return repeat

    place.file.weight += MATRIX if stmt.name.text == "matrix" else MOVE
    getters = [None if one is None else one.code.run for one in bound]

    def action(env: Env, out: Builder) -> None:
        append(construct([LEFT_OUT if get is None else get(env) for get in getters]), out)

    return action


def given_twice(what: str, span: Span, first: Span, report: Reporter) -> None:
    labels = (Label(first, "first given here"),)
    report.error("E0333", f"`{what}` is given twice", span, labels=labels, help="leave one of them out")


def _warn(node: nodes.Color | nodes.Grayscale | nodes.Stop, report: Reporter, span: Span) -> None:
    """Warn of a component of a colour, or an amount of grey, outside 0 to 1."""
    components = (node.amount,) if isinstance(node, nodes.Grayscale) else node.rgb
    outside = next((component for component in components if not 0.0 <= component <= 1.0), None)
    if outside is not None:
        help = "components run from 0 to 1; the result is clamped to that"
        if outside > 1 and outside.is_integer():
            help = "divide components of 0 to 255 by 255"
        report.warn("W0301", f"{outside:.6g} is outside 0 to 1", span, help)


def _stands(place: Site, span: Span, what: str, help: str, inside: str | None = None, name: str = "") -> bool:
    """Test whether a material may stand here, and report it if not."""
    if place.kind not in ("file", "material"):
        return True
    at_top = place.kind == "file"
    where = "at top level" if at_top else "inside a material"
    misplaced(place, span, f"{what} {where}", name, help if at_top else inside)
    return False


def prepare_use(stmt: tree.MaterialUse, place: Site) -> Action | None:
    word = Span(stmt.span.source, stmt.span.start, stmt.name.span.end)
    stands = _stands(place, word, "a material", "put it into the block of an object or a group")
    if (make_material := _prepare(stmt, place)) is None or not stands:
        return None
    session = place.session

    def action(env: Env, out: Builder) -> None:
        _give(make_material(env), word, out, place)
        session.count_parts(1, word)

    return action


def prepare_material(expr: tree.MaterialExpr, place: Site) -> Code:
    make_material = _prepare(expr, place)
    return POISONED if make_material is None else Code(lambda env: MaterialValue(make_material(env)))


_UNSAID: Final = {name: nodes.LATER[name] for name in words.PROPERTIES}


def _prepare(written: tree.MaterialUse | tree.MaterialExpr, place: Site) -> Callable[[Env], Material] | None:
    """Function that makes the material node; None where a name is unknown."""
    name, session = written.name, place.session
    operations = _operations(written.body, place)
    called, shading = _called(name, place), _shading(written, place)
    if called is None or shading == "":
        return None
    where = Written(name.span, written.span)

    def run(env: Env) -> Material:
        ops, given = operations(env)
        fields = {"name": called, "ops": ops, "shading": shading, **_UNSAID, **given}
        material = make(Material, fields)
        session.spans.record(material, where)
        _check_stops(material, where, session)
        return material

    return run


def _check_stops(material: Material, where: Written, session: Session) -> None:
    """Report a gradient whose stops are too few, too many or out of order, and stops of what is not one."""
    if (fault := material_fault(material.name, material.ops)) is None:
        return
    stop, message = fault
    statement, report = where.statement, session.report
    if len([op for op in material.ops if op.kind == "stop"]) < STOPS[0] and any(
        error.span is not None
        and error.span.source is statement.source
        and statement.start <= error.span.start < statement.end
        for error in report.diagnostics
        if error.severity == "error"
    ):
        return  # a stop was refused already
    span = (session.spans.span(stop) if stop is not None else None) or where.name
    code, help = "E0330", "stops stand in the block of material linear or material radial"
    if material.name in words.GRADIENTS:
        code = "E0360"
        help = "as in material linear { stop(0, #d33); stop(0.5, #fff); stop(1, #33d); }: 2 to 8, in order"
    report.error(code, message, span, help=help)


def _called(name: tree.Name, place: Site) -> str | None:
    """Name of a material in a Scene; None after a report."""
    alias, dot, rest = name.text.partition(".")
    if not dot:
        known = {*words.MATERIALS, *words.PAINTS}
        if alias in known:
            return alias
        _unknown(name, place, known)
        return None
    binding = place.scope.find(alias)
    exported: FileContext | None = binding.value if binding and binding.kind == "import" else None
    own = None if exported is None else exported.scope.names.get(rest)
    if exported is not None and rest in exported.materials:
        return exported.materials[rest]
    if binding is None:
        advice.unknown(name, place)
    elif binding.kind not in ("import", "poison"):
        expressions.wrong_kind(tree.Name(name.span, alias), binding, place, "an imported file")
    elif own is not None and own.kind in scopes.VALUES:
        _is_value(name, place)
    elif own is not None:
        expressions.wrong_kind(name, own, place, "a material")
    else:
        advice.unknown_member(name, place, exported, "material")
    return None


def _shading(written: tree.MaterialUse | tree.MaterialExpr, place: Site) -> str | None:
    """The word before the name, None without one and empty after a report."""
    word, name = written.shading, written.name
    if word is None:
        return None
    if word.text in words.PAINTS and name.text in words.MATERIALS:
        turned = f"{name.text} {word.text}"
        edit = Edit(Span(word.span.source, word.span.start, name.span.end), turned)
        fact, fix = f"`{word.text}` before the way it is lit", Fix(f"write `{turned}`", (edit,))
        place.report.error("E0213", fact, word.span, help=f"write material {turned}", fix=fix)
        return ""
    if word.text not in words.MATERIALS:
        _unknown(word, place, {*words.MATERIALS})
        return ""
    if name.text in words.MATERIALS:
        help = f"write material {name.text}"
        place.report.error("E0213", f"`{name.text}` is not a texture", name.span, help=help)
        return ""
    return word.text


def _operations(
    body: tree.Block | None, place: Site
) -> Callable[[Env], tuple[tuple[Any, ...], dict[str, Any]]]:
    """Function that returns the operations of a material's block, and the properties that it gives."""
    if body is None:
        return lambda env: ((), {})
    prepared = prepare_inner(body, place.inner("material"))
    session, span = place.session, body.span

    def run(env: Env) -> tuple[tuple[Any, ...], dict[str, Any]]:
        out = Builder()
        prepared.run(env, out, session, span)
        given = {name: value for name, (_, value) in out.properties.items() if value is not None}
        return tuple(out.transforms), given

    return run


def _unknown(name: tree.Name, place: Site, known: set[str]) -> None:
    """Report a name that no material has."""
    report, span, binding = place.report, name.span, place.scope.find(name.text)
    if binding is not None and binding.kind in ("let", "argument", "loop"):
        _is_value(name, place)
    elif name.text in words.GEOMETRIES:
        report.error("E0213", f"`{name.text}` is a geometry, not a material", span)
    else:
        hint, fix = advice.unknown_material(name, place, known)
        report.error("E0208", f"unknown material `{name.text}`", span, help=hint, fix=fix)


def _is_value(name: tree.Name, place: Site) -> None:
    """Report `material mist` where `mist` is a material value, or `material red` where `red` is a colour."""
    span, binding = name.span, place.scope.find(name.text)
    if binding is not None and binding.known and binding.value is not POISON:
        message = f"expected a material, found {describe(binding.value)}"
        help = f"for a colour write {advice.material_advice(place, 'color', name.text)}"
        place.report.error("E0301", message, span, help=help, labels=binding.labels())
        return
    start = span.source.text.rfind("material", 0, span.start)
    away = Fix("remove `material`", (Edit(Span(span.source, start, span.start), ""),))
    help = f"to use the value write {name.text}; without `material`"
    message = f"`{name.text}` is a value, not a material's name"
    place.report.error("E0213", message, span, help=help, fix=away if start >= 0 else None)


def _give(material: Material, span: Span, out: Builder, place: Site) -> None:
    """Set the material of the block; a second one is a mistake."""
    if out.material is None:
        out.material, out.material_span = material, span
        return
    labels = (Label(out.material_span, "first material here"),) if out.material_span else ()
    place.report.error("E0332", "a second material in one block", span, labels=labels)


def prepare_value_use(stmt: tree.Call, binding: Binding, place: Site) -> Action | None:
    """``mist;`` or ``mist { hue(0.1turn); }``: the block's operations come after the value's own."""
    session, name, span = place.session, stmt.name.text, stmt.name.span
    operations = _operations(stmt.body, place)
    get = expressions.value_of(stmt.name, binding, place).run
    if stmt.args:
        session.report.error("E0308", f"`{name}` is a value and takes no arguments", stmt.args[0].span)
        return None
    help = "materials stand in the block of an object or a group"
    wrong = binding.known and binding.value is POISON
    if wrong or not _stands(place, span, "value `{}`", help, help, name):
        return None
    place.file.weight += MATERIAL_VALUE
    where = Written(span, stmt.span)

    def action(env: Env, out: Builder) -> None:
        value = get(env)
        if value is POISON:
            return
        if value.__class__ is not MaterialValue:
            message = f"expected a material, found {describe(value)}"
            help = f"for a colour write {advice.material_advice(place, 'color', name)}"
            session.report.error("E0301", message, span, labels=binding.labels(), help=help)
            return
        material = value.material
        if stmt.body is not None:
            ops, given = operations(env)
            material = make(Material, {**material.__dict__, "ops": (*material.ops, *ops), **given})
            session.spans.record(material, where)
            _check_stops(material, where, session)
        _give(material, span, out, place)
        session.count_parts(1 + len(material.ops), span)

    return action
