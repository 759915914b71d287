"""Statements headed by a name: what the name stands for decides what they are."""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, instead, listing
from scenelang.evaluate.names import Binding, Scope
from scenelang.evaluate.prepare.blocks import Action, Place, inner, prepare_block
from scenelang.evaluate.prepare.expressions import prepare
from scenelang.evaluate.prepare.materials import prepare_value_use
from scenelang.evaluate.prepare.nodes import HOLDERS, prepare_module_call, prepare_object
from scenelang.evaluate.prepare.references import lookup, wrong_kind
from scenelang.evaluate.prepare.settings import prepare_setting
from scenelang.evaluate.prepare.transforms import prepare_move
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Advice
from scenelang.evaluate.report.shapes import in_library
from scenelang.evaluate.report.undefined import VALUES, report_unknown, unknown, unknown_member, within_effort
from scenelang.syntax import nodes
from scenelang.words import ANIMATED, CONSTANTS, FUNCTIONS, NODES, OPERATIONS, SETTINGS, TRANSFORMS


def prepare_headed(stmt: nodes.Call, place: Place) -> Action | None:
    name = stmt.name.text
    if name in SETTINGS:
        return prepare_setting(stmt, place)
    if name in TRANSFORMS or name in OPERATIONS:
        return prepare_move(stmt, place)
    binding = lookup(stmt.name, place.unit, place.scope)
    if binding is None:
        words = place.unit.session.vocabulary
        if name in words.geometries:
            return prepare_object(stmt, place)
        if not _lacks_module(stmt, place):
            _skim(stmt, place)
            _unknown(stmt, place)
        return None
    if binding.kind == "module":
        return prepare_module_call(stmt, binding.value, place)
    if binding.kind in VALUES:
        if _is_hidden_geometry(stmt, place):
            wrong_kind(stmt.name, binding, place.unit, "a geometry here", "give one of them another name")
            return None
        return prepare_value_use(stmt, binding, place)
    _skim(stmt, place)
    if binding.kind != "poison":
        wrong_kind(stmt.name, binding, place.unit, "an object or a module")
    return None


def _is_hidden_geometry(stmt: nodes.Call, place: Place) -> bool:
    """Whether a statement can only be an object of a geometry, whose name stands for a value here."""
    if stmt.name.text not in place.unit.session.vocabulary.geometries or place.kind not in HOLDERS:
        return False
    inside = stmt.body.statements if stmt.body is not None else ()
    return place.kind == "file" or any(
        isinstance(one, nodes.MaterialUse) or (isinstance(one, nodes.Call) and one.args is None)
        for one in inside
    )


def _skim(stmt: nodes.Call, place: Place) -> None:
    """Look for mistakes in the arguments and the block of something that will not run."""
    for arg in stmt.args or ():
        prepare(arg.value, place.unit, place.scope)
    if stmt.body is not None:
        prepare_block(stmt.body.statements, inner(place, "unknown"), stmt.body.span)


def _lacks_module(stmt: nodes.Call, place: Place) -> bool:
    """Report ``dot(x, y) { … }`` whose arguments are unknown names: the word `module` is missing."""
    unit, scope, name = place.unit, place.scope, stmt.name
    if stmt.body is None or not stmt.args or "." in name.text:
        return False
    params = [
        arg.name or (arg.value.name if isinstance(arg.value, nodes.NameRef) else None) for arg in stmt.args
    ]
    bare = [p for p, arg in zip(params, stmt.args, strict=True) if p is not None and arg.name is None]
    if None in params or not bare or not all(_stands_for_nothing(p.text, scope) for p in bare):
        return False
    if unit.damage and unit.damage.loses(name.text):
        return False
    body = inner(place, "unknown")
    for param in params:
        if param is not None:
            body.scope.names[param.text] = Binding("poison", param.span)
    prepare_block(stmt.body.statements, body, stmt.body.span)
    written = ", ".join(arg.span.text for arg in stmt.args)
    help = f"to define it write module {name.text}({written}) {{ … }}"
    message = f"unknown geometry or module `{name.text}`"
    report_unknown(name, unit, scope, "E0204", message, advise=lambda: (help, None), kinds=("module",))
    return True


def _stands_for_nothing(name: str, scope: Scope) -> bool:
    return scope.find(name) is None and name not in CONSTANTS and name not in ANIMATED


def _unknown(stmt: nodes.Call, place: Place) -> None:
    """Report a statement whose name stands for nothing."""
    unit, scope, name = place.unit, place.scope, stmt.name
    session, words = unit.session, unit.session.vocabulary
    if unit.damage and unit.damage.loses(name.text):
        return
    if "." in name.text:
        alias = scope.find(name.text.partition(".")[0])
        if alias is not None and alias.kind == "import":
            unknown_member(name, unit, alias.value)
        elif alias is None:
            unknown(name, unit, scope)
        else:
            wrong_kind(name, alias, unit, "an imported file")
        return
    if words.blind and place.kind in HOLDERS:
        return  # it may be a geometry of the model that is not at hand
    later = scope.defined_later(name.text)
    if later is not None:
        help = f"move the definition of `{name.text}` above this line"
        labels = (Label(later, "defined here"),)
        session.report.error(
            "E0203", f"`{name.text}` is used before its line", name.span, labels=labels, help=help
        )
        return
    owner = words.owner(name.text)
    if owner is not None and words.chosen is not None:
        message = f"geometry `{name.text}` belongs to model `{owner}`, not `{words.chosen.name}`"
        help = f"model `{words.chosen.name}` draws {listing(words.geometries)}"
        session.report.error("E0205", message, name.span, help=help, labels=session.model_label())
        return
    if name.text in FUNCTIONS:
        message = f"`{name.text}` is a function, not an object or a module"
        session.report.error("E0213", message, name.span)
        return
    what = {"object": "transform", "material": "texture operation"}.get(place.kind, "geometry or module")

    def advise() -> Advice:
        candidates = _candidates(stmt, place, scope)
        hint, fix = did_you_mean(name.text, candidates, name.span, effort=session.report.effort)
        if hint is None and place.kind in HOLDERS:
            hint, fix = in_library(stmt, unit, scope)
        if fix is None:
            known, fix = instead(name.text, foreign_words.WORDS, candidates, name.span)
            hint = known or hint
        if fix is not None and stmt.body is not None and fix.edits[0].replacement in NODES:
            span = Span(name.span.source, name.span.start, stmt.body.span.start)  # without parentheses
            fix = Fix(fix.message, (Edit(span, f"{fix.edits[0].replacement} "),))
        meant = foreign_words.WORDS.get(name.text, "")
        if hint is None and place.kind == "object" and meant in words.material_ops - words.transforms:
            from scenelang.evaluate.report.habits import in_material  # only mistakes need it

            hint = f"it is called `{meant}` here and stands in a material: material flat {{ {meant}(…); }}"
            fix = in_material(stmt, place.unit.session, meant)
        if hint is None and foreign_words.STATEMENTS.get(name.text):
            hint = foreign_words.STATEMENTS[name.text]
        if hint is None and place.kind in ("file", "group", "chain") and words.geometries:
            hint = f"the model draws {listing(words.geometries)}"
        return hint, fix

    message = f"unknown {what} `{name.text}`"
    report_unknown(name, unit, scope, "E0204", message, advise=advise, kinds=("module", *VALUES))


def _candidates(stmt: nodes.Call, place: Place, scope: Scope) -> set[str]:
    """Names that could have been meant, given where the statement stands and how it looks."""
    words = place.unit.session.vocabulary
    before = stmt.span.source.text[max(0, stmt.span.start - 1000) : stmt.span.start].rstrip()
    otherwise = {"else", "else if"} if before.endswith("}") and stmt.body is not None else set()
    if place.kind == "material":
        return words.material_ops
    if place.kind == "object" and stmt.args is not None:
        return words.transforms
    near = within_effort(place.unit.session.report, scope, VALUES if place.kind == "object" else ("module",))
    names = {n for n, _ in near}
    if place.kind == "object":
        return {*names, "material"}
    found = words.geometries | names
    if not stmt.args and stmt.body is not None:
        found.update((*NODES, *(otherwise - {"else if"})))
    if stmt.args is not None and stmt.body is None:
        found.update(words.transforms if place.kind != "file" else SETTINGS)
    if stmt.args is not None and stmt.body is not None:
        found.update(otherwise - {"else"})
    return found
