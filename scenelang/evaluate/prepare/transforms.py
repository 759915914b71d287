"""Transform statements: ``rotate(30deg);`` in a node's block, ``hue(0.1turn);`` in a material's."""

from __future__ import annotations

from typing import Any

from scenelang.diagnostics.diagnostic import Fix
from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.costs import MATRIX, MOVE, SAME_MOVE
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.names import Env
from scenelang.evaluate.prepare.arguments import bind
from scenelang.evaluate.prepare.blocks import Action, Place, inner, misplaced, prepare_block
from scenelang.evaluate.prepare.expressions import VARIES, Code, prepare_arguments
from scenelang.evaluate.report.type_errors import report_problem
from scenelang.evaluate.values.transforms import EVEN_SCALE, GEOMETRY, TEXTURE, Spec, outside_unit, spread
from scenelang.evaluate.values.value import POISON, Problem
from scenelang.scene import spans
from scenelang.syntax import nodes


def prepare_move(stmt: nodes.Call, place: Place) -> Action | None:
    """The action of a transform or a texture operation; checks that it may stand here."""
    unit, name = place.unit, stmt.name.text
    args = stmt.args or ()
    codes = prepare_arguments(name, args, unit, place.scope)
    spec = _spec(stmt, place)
    if spec is None or not _offered(stmt, place):
        return None
    if stmt.body is not None:
        help = f"put {name}(…); into the block of what it moves, as in square {{ {name}(…); }}"
        fix = _grouped(stmt, place)
        unit.session.report.error("E0330", f"`{name}` takes no block", stmt.name.span, help=help, fix=fix)
        return None
    if name == "scale" and len(args) == 1 and (args[0].name is None or args[0].name.text == "s"):
        spec = EVEN_SCALE
    span, word = stmt.name.span, spec.word
    bound = bind(
        unit.session, name, word.params, word.optional, args, span, spread=spec.spread, help=spec.help
    )
    if bound is None:
        return None
    if name == "shear" and any(arg.name is None for arg in args):
        unit.session.report.error("E0308", "shear takes a named term", args[0].span, help=spec.help)
        return None
    inputs = [codes[id(arg)] if arg is not None else None for arg in bound]
    operands = tuple([arg.value if arg is not None else None for arg in bound])
    return _action(spec, inputs, operands, stmt, unit)


def _spec(stmt: nodes.Call, place: Place) -> Spec | None:
    """The operation that the name stands for in such a block; None with a report if there is none."""
    name, span = stmt.name.text, stmt.name.span
    if place.kind == "material":
        if name in TEXTURE:
            return TEXTURE[name]
        misplaced(place, span, f"`{name}` does not move textures", "put it into the object's block")
        return None
    if name not in GEOMETRY and place.kind != "unknown":
        help = f"put it into a material's block, as in material flat {{ {name}(…); }}"
        from scenelang.evaluate.report.habits import in_material  # only mistakes need it

        fix = _grouped(stmt, place) or in_material(stmt, place.unit.session, name)
        misplaced(place, span, f"`{name}` stands outside a material", help, fix)
        return None
    if place.kind == "file":
        help = "put what it moves and the transform into group { … }"
        misplaced(place, span, f"transform `{name}` at top level", help, _grouped(stmt, place))
        return None
    return GEOMETRY.get(name) or TEXTURE[name]


def _grouped(stmt: nodes.Call, place: Place) -> Fix | None:
    """The fix for a transform with a block, which is looked through as one of children."""
    if stmt.body is None or place.kind not in ("file", "group", "chain"):
        return None
    from scenelang.evaluate.report.habits import as_group  # only mistakes need it

    prepare_block(stmt.body.statements, inner(place, "group"), stmt.body.span)
    return as_group(stmt, place.unit.session)


def _offered(stmt: nodes.Call, place: Place) -> bool:
    """Whether the models in use have the operation; reports it if not."""
    name, words = stmt.name.text, place.unit.session.vocabulary
    known = words.material_ops if place.kind == "material" else words.transforms | words.material_ops
    if name in known or words.blind:
        return True
    owner = words.owner(name)
    model = f"model `{words.chosen.name}` has" if words.chosen else "the models here have"
    help = f"model `{owner}` has it" if owner else None
    session = place.unit.session
    message = f"{model} no transform `{name}`"
    session.report.error("E0205", message, stmt.name.span, help=help, labels=session.model_label())
    return False


def _action(
    spec: Spec,
    inputs: list[Code | None],
    operands: tuple[nodes.Expr | None, ...],
    stmt: nodes.Call,
    unit: Unit,
) -> Action:
    session = unit.session
    span, place = stmt.name.span, spans.Place(stmt.name.span, stmt.span)
    one = operands[0] if operands else None
    alone = one is not None and not any(operands[1:])

    def construct(values: list[Any]) -> Any:
        """The node, or None after a report."""
        for value in values:
            if value is POISON:
                return None
        try:
            node = spec.build(*spread(values, spec)) if spec.spread else spec.build(*values)
        except Problem as problem:
            blamed = (one,) * len(spec.word.params) if alone else operands
            report_problem(session.report, problem, span, blamed)
            return None
        _warn(node, unit, one.span if one else span)
        return node

    def append(node: Any, out: Builder) -> None:
        if out.moved is None:
            out.moved = span  # even by a transform with a mistake: children have their order all the same
        if node is not None:
            session.count_parts(1, span)
            out.transforms.append(node)
            if session.watch is not None:
                session.watch(stmt.span, node)

    getters = [None if code is None else code.run for code in inputs]
    if all(code is None or code.value is not VARIES for code in inputs):
        unit.weight += SAME_MOVE
        constants = [None if code is None else code.value for code in inputs]
        made: list[Any] = []

        def repeat(env: Env, out: Builder) -> None:
            if not made:
                made.append(construct(constants))
            if made[0] is not None:
                session.spans.record(made[0], place)
            append(made[0], out)

        return repeat

    unit.weight += MATRIX if stmt.name.text == "matrix" else MOVE

    def action(env: Env, out: Builder) -> None:
        node = construct([None if get is None else get(env) for get in getters])
        if node is not None:
            session.spans.record(node, place)
        append(node, out)

    return action


def _warn(node: Any, unit: Unit, span: Span) -> None:
    outside = outside_unit(node)
    if outside is not None and not unit.session.report.follows("W0301", span):
        unit.session.report.diagnostics.add(
            "W0301",
            f"{outside:.6g} is outside 0 to 1",
            span,
            help="divide components of 0 to 255 by 255"
            if outside > 1 and outside.is_integer()
            else "components run from 0 to 1; the result is clamped to that",
        )
