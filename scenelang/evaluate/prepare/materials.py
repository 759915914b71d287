"""Materials: ``material NAME { … }`` in a block or as a value, and uses of such values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.evaluate.builder import Builder, make
from scenelang.evaluate.costs import MATERIAL_VALUE
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.names import Binding, Env, Scope
from scenelang.evaluate.prepare.blocks import Action, Place, inner, misplaced, prepare_block
from scenelang.evaluate.prepare.expressions import Code, constant
from scenelang.evaluate.prepare.references import value_of
from scenelang.evaluate.values.value import POISON, MaterialValue, describe
from scenelang.scene import spans
from scenelang.scene.schema import Material
from scenelang.syntax import nodes


def prepare_use(stmt: nodes.MaterialUse, place: Place) -> Action | None:
    word = Span(stmt.span.source, stmt.span.start, stmt.name.span.end)
    if place.kind in ("file", "material"):
        where = "at top level" if place.kind == "file" else "inside a material"
        help = "put it into the block of an object or a group" if place.kind == "file" else None
        misplaced(place, word, f"a material {where}", help)
    make_material = _prepare(stmt.name, stmt.body, place.unit, place.scope, stmt.span)
    if make_material is None or place.kind in ("file", "material"):
        return None
    session = place.unit.session

    def action(env: Env, out: Builder) -> None:
        give(make_material(env), word, out, place)
        session.count_parts(1, word)

    return action


def prepare_material(expr: nodes.MaterialExpr, unit: Unit, scope: Scope) -> Code:
    make_material = _prepare(expr.name, expr.body, unit, scope, expr.span)
    if make_material is None:
        return constant(POISON)
    return Code(lambda env: MaterialValue(make_material(env)))


def _prepare(
    name: nodes.Name, body: nodes.Block | None, unit: Unit, scope: Scope, span: Span
) -> Callable[[Env], Material] | None:
    """How to make the material node; None where the name is unknown."""
    operations = _operations(body, Place(unit, scope, "material")) if body else None
    session = unit.session
    known = session.vocabulary.materials
    if known and name.text not in known:
        _unknown(name, unit, scope, known)
        return None
    where = spans.Place(name.span, span)

    def run(env: Env) -> Material:
        ops = operations(env) if operations else ()
        material = make(Material, {"name": name.text, "ops": ops})
        session.spans.record(material, where)
        return material

    return run


def _operations(body: nodes.Block, place: Place) -> Callable[[Env], tuple[Any, ...]]:
    """How to get the operations of a material's block."""
    prepared = prepare_block(body.statements, inner(place, "material"), body.span)
    session, span = place.unit.session, body.span

    def run(env: Env) -> tuple[Any, ...]:
        out = Builder()
        session.tick(prepared.weight, span)
        for act in prepared.actions:
            act(env, out)
        return tuple(out.transforms)

    return run


def _unknown(name: nodes.Name, unit: Unit, scope: Scope, known: set[str]) -> None:
    """Report a name that no model in use has for a material."""
    session, words = unit.session, unit.session.vocabulary
    if words.blind:
        return
    owner = words.owner(name.text)
    binding = scope.find(name.text)
    if binding is not None and binding.kind in ("let", "argument", "loop"):
        head = Span(name.span.source, name.span.start, name.span.start)
        start = name.span.source.text.rfind("material", 0, head.start)
        away = Fix("remove `material`", (Edit(Span(head.source, start, head.start), ""),))
        help = f"to use the value write {name.text}; without `material`"
        message = f"`{name.text}` is a value, not a material's name"
        session.report.error("E0213", message, name.span, help=help, fix=away if start >= 0 else None)
        return
    if owner is not None and words.chosen is not None:
        message = f"material `{name.text}` belongs to model `{owner}`, not `{words.chosen.name}`"
        help = f"model `{words.chosen.name}` has {listing(known)}"
        session.report.error("E0205", message, name.span, help=help, labels=session.model_label())
        return
    hint, fix = did_you_mean(name.text, known, name.span)
    help = hint or f"there is {listing(known)}"
    session.report.error("E0208", f"unknown material `{name.text}`", name.span, help=help, fix=fix)


def give(material: Material, span: Span, out: Builder, place: Place) -> None:
    """Set the material of the block; a second one is a mistake."""
    if out.material is None:
        out.material = material
        out.material_span = span
        return
    labels = (Label(out.material_span, "first material here"),) if out.material_span else ()
    place.unit.session.report.error("E0332", "a second material in one block", span, labels=labels)


def prepare_value_use(stmt: nodes.Call, binding: Binding, place: Place) -> Action | None:
    """``mist;`` or ``mist { hue(0.1turn); }``: the block's operations come after the value's own."""
    unit, name = place.unit, stmt.name
    operations = _operations(stmt.body, place) if stmt.body else None
    get = value_of(name, binding, unit, place.scope).run
    session = unit.session
    if stmt.args:
        session.report.error("E0308", f"`{name.text}` is a value and takes no arguments", stmt.args[0].span)
        return None
    if place.kind in ("file", "material"):
        where = "at top level" if place.kind == "file" else "inside a material"
        help = "materials stand in the block of an object or a group"
        misplaced(place, name.span, f"value `{name.text}` {where}", help)
        return None
    unit.weight += MATERIAL_VALUE
    labels = (Label(binding.span, "defined here"),) if binding.span else ()
    where_made = spans.Place(name.span, stmt.span)

    def action(env: Env, out: Builder) -> None:
        value = get(env)
        if value is POISON:
            return
        if value.__class__ is not MaterialValue:
            message = f"expected a material, found {describe(value)}"
            session.report.error("E0301", message, name.span, labels=labels)
            return
        material = value.material
        if operations is not None:
            ops = (*material.ops, *operations(env))
            material = make(Material, {"name": material.name, "ops": ops})
            session.spans.record(material, where_made)
        give(material, name.span, out, place)
        session.count_parts(1 + len(material.ops), name.span)

    return action
