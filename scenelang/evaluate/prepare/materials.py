"""Materials: ``material NAME { … }`` in a block or as a value, and uses of such values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder, make
from scenelang.evaluate.costs import MATERIAL_VALUE
from scenelang.evaluate.file_context import Action, FileContext, Place
from scenelang.evaluate.names import Binding, Env
from scenelang.evaluate.prepare.blocks import misplaced, prepare_inner
from scenelang.evaluate.prepare.expressions import POISONED, Code
from scenelang.evaluate.prepare.references import value_of, wrong_kind
from scenelang.evaluate.report.undefined import VALUES, unknown, unknown_member
from scenelang.evaluate.values.value import POISON, MaterialValue, describe
from scenelang.scene.schema import Material
from scenelang.scene.spans import Written
from scenelang.syntax import nodes
from scenelang.words import GEOMETRIES, MATERIALS, TEXTURES


def _stands(
    place: Place, span: Span, what: str, help: str, inside: str | None = None, name: str = ""
) -> bool:
    """Whether a material may stand here; reports it if not."""
    if place.kind not in ("file", "material"):
        return True
    at_top = place.kind == "file"
    where = "at top level" if at_top else "inside a material"
    misplaced(place, span, f"{what} {where}", name, help if at_top else inside)
    return False


def prepare_use(stmt: nodes.MaterialUse, place: Place) -> Action | None:
    word = Span(stmt.span.source, stmt.span.start, stmt.name.span.end)
    stands = _stands(place, word, "a material", "put it into the block of an object or a group")
    make_material = _prepare(stmt, place)
    if make_material is None or not stands:
        return None
    session = place.session

    def action(env: Env, out: Builder) -> None:
        _give(make_material(env), word, out, place)
        session.count_parts(1, word)

    return action


def prepare_material(expr: nodes.MaterialExpr, place: Place) -> Code:
    make_material = _prepare(expr, place)
    if make_material is None:
        return POISONED
    return Code(lambda env: MaterialValue(make_material(env)))


def _prepare(
    written: nodes.MaterialUse | nodes.MaterialExpr, place: Place
) -> Callable[[Env], Material] | None:
    """How to make the material node; None where a name is unknown."""
    name, session = written.name, place.session
    operations = _operations(written.body, place)
    called, shading = _called(name, place), _shading(written, place)
    if called is None or shading == "":
        return None
    where = Written(name.span, written.span)

    def run(env: Env) -> Material:
        material = make(Material, {"name": called, "ops": operations(env), "shading": shading})
        session.spans.record(material, where)
        return material

    return run


def _called(name: nodes.Name, place: Place) -> str | None:
    """What a Scene calls a material; None after a report."""
    alias, dot, rest = name.text.partition(".")
    if not dot:
        known = {*MATERIALS, *TEXTURES}
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
        unknown(name, place)
    elif binding.kind not in ("import", "poison"):
        wrong_kind(nodes.Name(name.span, alias), binding, place, "an imported file")
    elif own is not None and own.kind in VALUES:
        _is_value(name, place)
    elif own is not None:
        wrong_kind(name, own, place, "a material")
    else:
        unknown_member(name, place, exported, "material")
    return None


def _shading(written: nodes.MaterialUse | nodes.MaterialExpr, place: Place) -> str | None:
    """The word before the name, None without one and empty after a report."""
    word, name = written.shading, written.name
    if word is None:
        return None
    if word.text not in MATERIALS:
        _unknown(word, place, {*MATERIALS})
        return ""
    if name.text in MATERIALS:
        help = f"write material {name.text}"
        place.report.error("E0213", f"`{name.text}` is not a texture", name.span, help=help)
        return ""
    return word.text


def _operations(body: nodes.Block | None, place: Place) -> Callable[[Env], tuple[Any, ...]]:
    """How to get the operations of a material's block."""
    if body is None:
        return lambda env: ()
    prepared = prepare_inner(body, place.inner("material"))
    session, span = place.session, body.span

    def run(env: Env) -> tuple[Any, ...]:
        out = Builder()
        prepared.run(env, out, session, span)
        return tuple(out.transforms)

    return run


def _unknown(name: nodes.Name, place: Place, known: set[str]) -> None:
    """Report a name that no material has."""
    report, span, binding = place.report, name.span, place.scope.find(name.text)
    if binding is not None and binding.kind in ("let", "argument", "loop"):
        _is_value(name, place)
    elif name.text in GEOMETRIES:
        report.error("E0213", f"`{name.text}` is a geometry, not a material", span)
    else:
        from scenelang.evaluate.report.advice import unknown_material  # only mistakes need it

        hint, fix = unknown_material(name, place, known)
        report.error("E0208", f"unknown material `{name.text}`", span, help=hint, fix=fix)


def _is_value(name: nodes.Name, place: Place) -> None:
    """Report `material mist` where `mist` is a material value, or `material red` where `red` is a colour."""
    span, binding = name.span, place.scope.find(name.text)
    if binding is not None and binding.known and binding.value is not POISON:
        from scenelang.evaluate.report.advice import material_advice  # only mistakes need it

        message = f"expected a material, found {describe(binding.value)}"
        help = f"for a colour write {material_advice(place, 'color', name.text)}"
        place.report.error("E0301", message, span, help=help, labels=binding.labels())
        return
    start = span.source.text.rfind("material", 0, span.start)
    away = Fix("remove `material`", (Edit(Span(span.source, start, span.start), ""),))
    help = f"to use the value write {name.text}; without `material`"
    message = f"`{name.text}` is a value, not a material's name"
    place.report.error("E0213", message, span, help=help, fix=away if start >= 0 else None)


def _give(material: Material, span: Span, out: Builder, place: Place) -> None:
    """Set the material of the block; a second one is a mistake."""
    if out.material is None:
        out.material, out.material_span = material, span
        return
    labels = (Label(out.material_span, "first material here"),) if out.material_span else ()
    place.report.error("E0332", "a second material in one block", span, labels=labels)


def prepare_value_use(stmt: nodes.Call, binding: Binding, place: Place) -> Action | None:
    """``mist;`` or ``mist { hue(0.1turn); }``: the block's operations come after the value's own."""
    session, name, span = place.session, stmt.name.text, stmt.name.span
    operations = _operations(stmt.body, place)
    get = value_of(stmt.name, binding, place).run
    if stmt.args:
        session.report.error("E0308", f"`{name}` is a value and takes no arguments", stmt.args[0].span)
        return None
    help = "materials stand in the block of an object or a group"
    if (binding.known and binding.value is POISON) or not _stands(
        place, span, "value `{}`", help, help, name
    ):
        return None
    place.file.weight += MATERIAL_VALUE
    where = Written(span, stmt.span)

    def action(env: Env, out: Builder) -> None:
        value = get(env)
        if value is POISON:
            return
        if value.__class__ is not MaterialValue:
            message = f"expected a material, found {describe(value)}"
            from scenelang.evaluate.report.advice import material_advice  # only mistakes need it

            help = f"for a colour write {material_advice(place, 'color', name)}"
            session.report.error("E0301", message, span, labels=binding.labels(), help=help)
            return
        material = value.material
        if stmt.body is not None:
            ops = (*material.ops, *operations(env))
            material = make(Material, {"name": material.name, "ops": ops, "shading": material.shading})
            session.spans.record(material, where)
        _give(material, span, out, place)
        session.count_parts(1 + len(material.ops), span)

    return action
