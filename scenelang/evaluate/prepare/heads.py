"""Statements headed by a name: what the name stands for decides what they are."""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, instead
from scenelang.evaluate.file_context import Action, Place
from scenelang.evaluate.names import Binding
from scenelang.evaluate.prepare.blocks import prepare_inner
from scenelang.evaluate.prepare.elements import prepare_element
from scenelang.evaluate.prepare.expressions import prepare_arguments
from scenelang.evaluate.prepare.materials import prepare_value_use
from scenelang.evaluate.prepare.nodes import HOLDERS, prepare_module_call, prepare_object
from scenelang.evaluate.prepare.references import lookup, wrong_kind
from scenelang.evaluate.prepare.settings import prepare_setting
from scenelang.evaluate.prepare.transforms import prepare_move
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Advice
from scenelang.evaluate.report.undefined import (
    VALUES,
    report_early,
    report_unknown,
    unknown,
    unknown_member,
    visible,
)
from scenelang.syntax import nodes
from scenelang.words import (
    ANIMATED,
    COMBINE,
    CONSTANTS,
    FUNCTIONS,
    GEOMETRIES,
    LANGUAGE,
    MATERIALS,
    NODES,
    OPERATIONS,
    SETTINGS,
    TRANSFORMS,
)


def prepare_headed(stmt: nodes.Call, place: Place) -> Action | None:
    name = stmt.name.text
    binding = None if name in LANGUAGE else lookup(stmt.name, place)
    if name in SETTINGS and not hides(binding, stmt):
        return prepare_setting(stmt, place)
    if name in LANGUAGE:
        return prepare_move(stmt, place)
    if binding is None:
        if name in GEOMETRIES:
            return prepare_object(stmt, place)
        if not _lacks_module(stmt, place):
            if _boolean(stmt) is None:
                _skim(stmt, place)
            _unknown(stmt, place)
        return None
    if binding.kind == "module":
        return prepare_module_call(stmt, binding.value, place)
    if binding.kind == "element":
        return prepare_element(stmt, place, binding.value)
    if binding.kind in VALUES:
        return prepare_value_use(stmt, binding, place)
    _skim(stmt, place)
    if binding.kind != "poison":
        wrong_kind(stmt.name, binding, place, "an object or a module")
    return None


def hides(binding: Binding | None, stmt: nodes.Call) -> bool:
    """Whether a scene's own name stands here for a setting: a module, or a material in use."""
    return binding is not None and (
        binding.kind in ("module", "poison") or (binding.kind in VALUES and stmt.args is None)
    )


def _boolean(stmt: nodes.Call) -> str | None:
    """The boolean word that a call with objects as arguments stands for."""
    here = foreign_words.WORDS.get(stmt.name.text.lower())
    return here if here in COMBINE and stmt.args and stmt.body is None else None


def _skim(stmt: nodes.Call, place: Place) -> None:
    """Look for mistakes in the arguments and the block of something that will not run."""
    prepare_arguments(stmt.args, place)
    prepare_inner(stmt.body, place.inner("unknown"))


def _lacks_module(stmt: nodes.Call, place: Place) -> bool:
    """Report ``dot(x, y) { … }`` whose arguments are unknown names: the word `module` is missing."""
    name = stmt.name.text
    if stmt.body is None or not stmt.args or "." in name:
        return False
    values = [arg.value.name for arg in stmt.args if isinstance(arg.value, nodes.NameRef) and not arg.name]
    params = [arg.name for arg in stmt.args if arg.name] + values
    if len(params) < len(stmt.args) or not values:
        return False
    if any(place.scope.find(p.text) or p.text in CONSTANTS or p.text in ANIMATED for p in values):
        return False
    body = place.inner("unknown")
    body.scope.names.update({param.text: Binding("poison", param.span) for param in params})
    prepare_inner(stmt.body, body)
    written = ", ".join(arg.span.text for arg in stmt.args)
    help = f"to define it write module {name}({written}) {{ … }}"
    message = f"unknown geometry or module `{name}`"
    report_unknown(stmt.name, place, "E0204", message, lambda: (help, None))
    return True


def _unknown(stmt: nodes.Call, place: Place) -> None:
    """Report a statement whose name stands for nothing."""
    name, text = stmt.name, stmt.name.text
    if "." in text:
        alias = place.scope.find(text.partition(".")[0])
        if alias is None:
            unknown(name, place)
        elif alias.kind == "import":
            unknown_member(name, place, alias.value, kinds=("module", "element"))
        else:
            wrong_kind(name, alias, place, "an imported file")
        return
    if report_early(name, place):
        return
    if text in FUNCTIONS:
        from scenelang.evaluate.report.advice import material_advice  # only mistakes need it

        call, inside = stmt.span.text.rstrip("; "), place.kind == "material"
        written = f"write color({call});" if inside else material_advice(place, "color", call)
        message = f"`{text}` is a function, not an object or a module"
        place.report.error("E0213", message, name.span, help=written if text in ("rgb", "hsv") else None)
        return
    what = {"object": "transform", "material": "texture operation"}.get(place.kind, "geometry or module")
    report_unknown(name, place, "E0204", f"unknown {what} `{text}`", lambda: _advice(stmt, place))


def _advice(stmt: nodes.Call, place: Place) -> Advice:
    """What may have been meant by a statement whose name stands for nothing."""
    name, text = stmt.name, stmt.name.text
    candidates = _candidates(stmt, place)
    help, fix = did_you_mean(text, candidates, name.span, effort=place.report.effort)
    if fix is None and text.lower() in foreign_words.STATEMENTS:
        help = None  # what is known of a word goes before what is only near
    if place.kind == "object" and text in MATERIALS:
        return _lacks_material(stmt)
    if help is None and place.kind in HOLDERS:
        from scenelang.evaluate.report.advice import in_library  # only mistakes need it

        if (here := _boolean(stmt)) is not None:
            return f"it is called `{here}` here and has a block: {here} {{ square; star; }}", None
        help, fix = in_library(stmt, place), None
    if fix is None:
        known, fix = instead(text, foreign_words.WORDS, candidates, name.span)
        help = known or help
    if fix is not None and stmt.body is not None and fix.edits[0].replacement in NODES:
        span = Span(name.span.source, name.span.start, stmt.body.span.start)  # without parentheses
        fix = Fix(fix.message, (Edit(span, f"{fix.edits[0].replacement} "),))
    meant = foreign_words.WORDS.get(text, "")
    if help is None and place.kind == "object" and meant in OPERATIONS.keys() - TRANSFORMS.keys():
        from scenelang.evaluate.report.advice import material_advice

        help = f"it is called `{meant}` here and stands in a material: {material_advice(place, meant)}"
    help = help or foreign_words.STATEMENTS.get(text.lower())
    if help is None and place.kind in ("file", "group", "chain"):
        from scenelang.evaluate.report.advice import drawn  # only mistakes need it

        help = drawn(place)
    return help, fix


def _lacks_material(stmt: nodes.Call) -> Advice:
    """`square { flat(#f00); }`: the word `material` is missing."""
    written = f"material {stmt.name.text}"
    if stmt.args is None:
        return f"write {written}", Fix("insert `material`", (Edit(stmt.name.span, written),))
    colour = stmt.args[0].value.span.text if len(stmt.args) == 1 else "…"
    written = f"{written} {{ color({colour}); }}"
    if colour == "…" or stmt.body is not None:
        return f"write {written}", None
    return f"write {written}", Fix(f"write `{written}`", (Edit(stmt.span, written),))


def _candidates(stmt: nodes.Call, place: Place) -> set[str]:
    """Names that could have been meant, given where the statement stands and how it looks."""
    kind = place.kind
    if kind == "material":
        return {*OPERATIONS}
    if kind == "object" and stmt.args is not None:
        return {*TRANSFORMS}
    names = visible(place, VALUES if kind == "object" else ("module",))
    if kind == "object":
        return {*names, "material"}
    found = {*GEOMETRIES, *names}
    if stmt.body is None:
        return found if stmt.args is None else found | {*(TRANSFORMS if kind != "file" else SETTINGS)}
    before = stmt.span.source.text[max(0, stmt.span.start - 1000) : stmt.span.start].rstrip()
    otherwise = before.endswith("}")
    if not stmt.args:
        found = {*found, *NODES, *(["else"] if otherwise else [])}
    return {*found, "else if"} if stmt.args is not None and otherwise else found
