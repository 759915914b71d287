"""Transform statements: ``rotate(30deg);`` in a node's block, ``hue(0.1turn);`` in a material's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.costs import MATRIX, MOVE, SAME_MOVE
from scenelang.evaluate.file_context import Action, Place
from scenelang.evaluate.names import Env
from scenelang.evaluate.prepare.blocks import misplaced, prepare_inner
from scenelang.evaluate.prepare.calls import bind
from scenelang.evaluate.prepare.expressions import VARIES, Given, prepare_arguments
from scenelang.evaluate.report.reporter import Reporter
from scenelang.evaluate.report.type_errors import report_problem
from scenelang.evaluate.values.transforms import EVEN_SCALE, GEOMETRY, TEXTURE, Spec, spread
from scenelang.evaluate.values.value import POISON, Problem
from scenelang.scene.modifiers import Color, Grayscale
from scenelang.scene.spans import Written
from scenelang.syntax import nodes


def prepare_move(stmt: nodes.Call, place: Place) -> Action | None:
    """The action of a transform or a texture operation; checks that it may stand here."""
    name, report = stmt.name.text, place.report
    given = prepare_arguments(stmt.args, place, name)
    spec = _spec(stmt, place)
    if spec is None:
        return None
    if stmt.body is not None:
        help = f"put {name}(…); into the block of what it moves, as in square {{ {name}(…); }}"
        _skim(stmt, place)
        report.error("E0330", f"`{name}` takes no block", stmt.name.span, help=help)
        return None
    if name == "scale" and len(given) == 1 and (given[0].arg.name is None or given[0].arg.name.text == "s"):
        spec = EVEN_SCALE
    word = spec.word
    bound = bind(report, stmt.name, word.params, word.required, given, spread=spec.spread, help=spec.help)
    if bound is None:
        return None
    if name == "shear" and any(arg.name is None for arg, _ in given):
        report.error("E0308", "shear takes a named term", given[0].arg.span, help=spec.help)
        return None
    return _action(spec, bound, stmt, place)


def _spec(stmt: nodes.Call, place: Place) -> Spec | None:
    """The operation that the name stands for in such a block; None with a report if there is none."""
    name, span = stmt.name.text, stmt.name.span
    if place.kind == "material":
        if name not in TEXTURE:
            misplaced(place, span, "`{}` does not move textures", name, "put it into the object's block")
        return TEXTURE.get(name)
    if name not in GEOMETRY and place.kind != "unknown":
        from scenelang.evaluate.report.advice import material_advice

        help = f"put it into a material's block, as in {material_advice(place, name)}"
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


def _skim(stmt: nodes.Call, place: Place) -> None:
    """Look through the block of a transform as one of children."""
    if stmt.body is not None and place.kind in ("file", "group", "chain"):
        prepare_inner(stmt.body, place.inner("group"))


def _action(spec: Spec, bound: Sequence[Given | None], stmt: nodes.Call, place: Place) -> Action:
    session, span, where = place.session, stmt.name.span, Written(stmt.name.span, stmt.span)
    operands = tuple([None if one is None else one.arg.value for one in bound])
    first = operands[0] if operands else None
    if first is not None and not any(operands[1:]):
        operands = (first,) * len(spec.word.params)

    def construct(values: list[Any]) -> Any:
        """The node, or None after a report."""
        if POISON in values:
            return None
        try:
            node = spec.build(*spread(values, spec)) if spec.spread else spec.build(*values)
        except Problem as problem:
            report_problem(session.report, problem, span, operands)
            return None
        if node.__class__ is Color or node.__class__ is Grayscale:
            _warn(node, session.report, first.span if first else span)
        return node

    def append(node: Any, out: Builder) -> None:
        if out.moved is None:
            out.moved = span  # even by a transform with a mistake: children have their order all the same
        if node is not None:
            session.spans.record(node, where)
            session.count_parts(1, span)
            out.transforms.append(node)
            if session.watch is not None:
                session.watch(stmt.span, node)

    if all(one is None or one.code.value is not VARIES for one in bound):
        place.file.weight += SAME_MOVE
        constants = [None if one is None else one.code.value for one in bound]
        made: list[Any] = []

        def repeat(env: Env, out: Builder) -> None:
            if not made:
                made.append(construct(constants))
            append(made[0], out)

        return repeat

    place.file.weight += MATRIX if stmt.name.text == "matrix" else MOVE
    getters = [None if one is None else one.code.run for one in bound]

    def action(env: Env, out: Builder) -> None:
        append(construct([None if get is None else get(env) for get in getters]), out)

    return action


def _warn(node: Color | Grayscale, report: Reporter, span: Span) -> None:
    """Warn of a component of a colour, or an amount of grey, outside 0 to 1."""
    components = node.rgb if isinstance(node, Color) else (node.amount,)
    outside = next((component for component in components if not 0.0 <= component <= 1.0), None)
    if outside is not None:
        help = "components run from 0 to 1; the result is clamped to that"
        if outside > 1 and outside.is_integer():
            help = "divide components of 0 to 255 by 255"
        report.warn("W0301", f"{outside:.6g} is outside 0 to 1", span, help)
