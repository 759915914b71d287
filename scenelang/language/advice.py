"""Advice: likely meanings of names and values that do not fit."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Final, Literal

from scenelang.language import foreign, library, scopes, tree, words
from scenelang.language.builder import FileContext, Site
from scenelang.language.diagnostics import Edit, Fix, Label, SourceFile, Span, did_you_mean, listing
from scenelang.language.reporter import Advice, Reporter
from scenelang.language.session import Scope, Session
from scenelang.language.values import COMPONENTS, Problem

_MESHES: Final = "learned from a mesh: scenelang learn part.obj -o zoo.safetensors"


def problem_advice(problem: Problem, operand: tree.Expr | None) -> Advice:
    """Help and fix for a value of the wrong kind, by what the problem says can be mended."""
    if problem.fix == "colour":
        text = operand.value.strip() if isinstance(operand, tree.String) else ""
        plain = re.fullmatch("#(?:[0-9a-fA-F]{3}){1,2}", text)
        colour = plain[0] if plain else foreign.COLOURS.get(text.lower())
        if operand is None or colour is None:
            return problem.help, None
        return problem.help, Fix(f"write `{colour}`", (Edit(operand.span, colour),))
    if problem.fix == "text" and operand is not None:
        written = f"str({operand.span.text})"
        return problem.help, Fix(f"write `{written}`", (Edit(operand.span, written),))
    inner = operand.operand if isinstance(operand, tree.Unary) else operand
    if isinstance(inner, tree.NumberLiteral):
        size, end = abs(inner.value), inner.span.end
        small = "turn" if problem.fix == "hue" and size < 1 else "rad"
        unit = "deg" if size > math.tau or float(size).is_integer() else small
        fix = Fix(f"add `{unit}`", (Edit(Span(inner.span.source, end, end), unit),))
        return "give it a unit: deg, rad or turn", fix
    if operand is not None and re.search(r"\b(?:PI|TAU)\b", operand.span.text):
        return "what is in radians is multiplied by 1rad, what is in degrees by 1deg", None
    return "multiply by the unit it is in: 1deg, 1rad or 1turn", None


def member_advice(name: tree.Name) -> str | None:
    """`v.xy`, `v.length`: what other languages have in vectors."""
    if name.text in ("length", "size"):
        return "write len(v)"
    if 2 <= len(name.text) <= 3 and set(name.text) <= set(COMPONENTS):
        return f"write [{', '.join(f'v.{letter}' for letter in name.text)}]"
    return None


def in_library(stmt: tree.Call, place: Site) -> str | None:
    """Help for a statement whose name is that of a shape of the library, unless more is known of it."""
    name = stmt.name.text.lower()
    likely = likely_dimensions(place.session, stmt.span.source)
    files = {2: (library.SHAPES, foreign.SHAPES), 3: (library.SOLIDS, foreign.SOLIDS)}
    found = [(file, shapes[name]) for file, shapes in map(files.__getitem__, likely) if name in shapes]
    if not found or name in foreign.STATEMENTS:
        return None
    file, shape = found[0]
    for alias, binding in place.scope.visible():
        value = binding.value
        if isinstance(value, FileContext) and value.source.name == library.called(file):
            return f"{alias}.{shape}"
    return f'import "{file}" as s; then s.{shape}'


# ---------------------------------------------------------------- the plane or space


def likely_dimensions(session: Session, source: SourceFile) -> tuple[int, ...]:
    """Dimension of what a text draws; both where nobody can tell."""
    known = session.report.words(source)
    likely = {d for d, leaves in words.LEAVES.items() if not known.isdisjoint(leaves)}
    likely |= set() if known.isdisjoint(words.OUTLINES) else {2}
    likely |= {3} if not known.isdisjoint(words.STAGE) else set()
    likely |= ({2} if "shapes" in known else set()) | ({3} if "meshes" in known else set())
    return (*likely,) if len(likely) == 1 else (*words.LEAVES,)


def material_advice(place: Site, name: str, argument: str = "…") -> str:
    """Text of an operation on a colour, in the material of what a text draws if that is known."""
    dimensions = likely_dimensions(place.session, place.file.source)
    material = next(iter(words.SHADINGS[dimensions[0]])) if len(dimensions) == 1 else None
    written = f"material {material or 'flat'} {{ {name}({argument}); }}"
    return written if material else f"{written}, in space material diffuse"


def unknown_material(name: tree.Name, place: Site, known: set[str]) -> Advice:
    """Likely meaning of a name in the place of a material."""
    span, lower = name.span, name.text.lower()
    likely = likely_dimensions(place.session, place.file.source)
    there = known.difference(*(words.SHADINGS[d] for d in words.SHADINGS.keys() - likely))
    help, fix = did_you_mean(name.text, there, span)
    here = foreign.MATERIALS.get(lower)
    if help is None and here in there:
        return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))
    if help is None and here is None and lower in foreign.COLOURS:
        return f"it is a colour: {material_advice(place, 'color', foreign.COLOURS[lower])}", None
    return help or (here if here and " " in here else f"there is {listing(there)}"), fix


def drawn(place: Site) -> str:
    """Shapes that can be drawn, in the plane or in space."""
    dimensions = likely_dimensions(place.session, place.file.source)
    said = {n: listing([*words.LEAVES[n], *(words.OUTLINES if n == 2 else ())]) for n in dimensions}
    if len(said) == 1:
        return f"there is {said[dimensions[0]]}" + (f", and what is {_MESHES}" if dimensions == (3,) else "")
    return f"flat scenes draw {said[2]}, solid ones {said[3]}, and what is {_MESHES}"


def report_unknown(
    name: tree.Name, place: Site, code: str, message: str, advise: Callable[[], Advice]
) -> None:
    """Report a name that stands for nothing; again only as a further place of the first report."""
    report, key = place.report, (code, name.text, name.span.source)
    known = key in report.shared or report.follows(code, name.span)
    help, fix = (None, None) if known else advise()
    report.error_once(key, code, message, name.span, help=help, fix=fix)


def visible(place: Site, kinds: Sequence[str]) -> set[str]:
    """The names in sight of some kinds; none any more where looking through them has taken too long."""
    effort = place.report.effort
    if effort.left <= 0:
        return set()
    seen = list(place.scope.visible())
    effort.left -= 2 * len(seen)
    return {name for name, binding in seen if binding.kind in kinds}


def unknown_member(
    name: tree.Name,
    place: Site,
    exported: FileContext | None,
    what: Literal["name", "material"] = "name",
    kinds: Sequence[str] = (),
) -> None:
    """Report that an imported file has no such name; nothing is known of one that cannot be read.

    ``kinds`` are those of bindings that may stand here, if it has any of them.
    """
    alias, _, rest = name.text.partition(".")
    if exported is None or place.report.damage(exported.source).explains("E0212", _last(name)):
        return
    last = _last(name)
    if what == "material":
        known = [*exported.materials]
    elif rest in exported.materials:
        help = f"write material {name.text}"
        place.report.error("E0213", f"`{name.text}` is the name of a material", name.span, help=help)
        return
    else:
        names = exported.scope.names
        fitting = [n for n, b in names.items() if b.kind in kinds]
        known = fitting or [n for n, b in names.items() if b.kind != "import"]
    missing = f"`{alias}` has no {'material ' if what == 'material' else ''}`{rest}`"

    def advise() -> Advice:
        owner, _, fact = rest.rpartition("_")
        element = exported.scope.names.get(owner)
        if element is not None and element.kind == "element" and fact in ("size", "centre"):
            return f"its file does not say how large or where `{owner}` was; learn it again", None
        help, fix = did_you_mean(rest, known, last, effort=place.report.effort)
        shape = library.shapes_of(exported.source).get(rest.lower())
        if shape is not None and (fix is None or fix.guess):
            return f"it is called {alias}.{shape} here", None
        return help or (f"it has {listing(known)}" if known else f"it defines no {what}"), fix

    nowhere = place._replace(scope=Scope(place.file.scope.slots))
    report_unknown(tree.Name(last, rest), nowhere, "E0212", missing, advise)


def _last(name: tree.Name) -> Span:
    """The place of what stands behind the first dot of a name."""
    rest = name.text.partition(".")[2]
    return Span(name.span.source, name.span.end - len(rest), name.span.end)


def report_early(name: tree.Name, place: Site) -> bool:
    """Report a name that a later line defines, if one does."""
    around = place.scope.outwards()
    later = next((scope.later[name.text] for scope in around if name.text in scope.later), None)
    if later is not None:
        message, labels = f"`{name.text}` is used before its line", (Label(later, "defined here"),)
        help = f"move the definition of `{name.text}` above this line"
        place.report.error("E0203", message, name.span, labels=labels, help=help)
    return later is not None


def unknown(name: tree.Name, place: Site, call: tree.CallExpr | None = None) -> None:
    """Report a name that stands for nothing in an expression, perhaps the one that is called."""
    alias, dot, _ = name.text.partition(".")
    if dot:
        head = Span(name.span.source, name.span.start, name.span.start + len(alias))
        unknown(tree.Name(head, alias), place)
    elif not report_early(name, place):
        code, what = ("E0207", "function") if call else ("E0201", "name")
        report_unknown(name, place, code, f"unknown {what} `{name.text}`", lambda: _advice(name, place, call))


def _advice(name: tree.Name, place: Site, call: tree.CallExpr | None) -> Advice:
    """Advice on a name in an expression that stands for nothing."""
    text, span = name.text, name.span
    lower, source = text.lower(), span.source.text
    dotted = source[span.end : span.end + 1] == "."
    if call and text in foreign.FUNCTIONS:
        return foreign.FUNCTIONS[text], None
    if call and text in words.TRANSFORMS:
        return f"transforms are statements of a block: square {{ {call.span.text}; }}", None
    if text in words.MATERIALS:
        return f"a material is written material {text}" + " { color(…); }" * bool(call), None
    if text in words.GEOMETRIES:
        moved = f"what moves it stands in its block: {text} {{ translate(0.5, 0); }}"
        return moved if dotted else f"objects are not values; write module part() {{ {text}; }}", None
    if text in foreign.LIBRARIES and dotted:
        prefix = Span(span.source, span.start, span.end + 1)
        return "functions and constants stand alone", Fix(f"remove `{text}.`", (Edit(prefix, ""),))
    before = source[max(0, span.start - 20) : span.start].rstrip()
    if before.endswith("model") and place.scope.find(text) is None:
        return "a model is named by a string", Fix("put quotes around it", (Edit(span, f'"{text}"'),))
    if text in ("x", "y", "z") and before.replace(" ", "").endswith("axis="):
        return "the axes are X, Y and Z", Fix(f"write `{text.upper()}`", (Edit(span, text.upper()),))
    own = {*words.FUNCTIONS} if call else {*words.CONSTANTS, *words.ANIMATED, "true", "false"}
    kinds = ("fn",) if call else (*scopes.VALUES, "import")
    if not call and lower in foreign.VALUES:
        return foreign.VALUES[lower], None
    here = None if call else foreign.NAMES.get(lower)
    if here is not None and here.lower() != lower:
        return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))
    help, fix = did_you_mean(text, visible(place, kinds) | own, span, effort=place.report.effort)
    colour = None if call else foreign.COLOURS.get(lower)
    if help is None and colour is not None:
        fix = Fix(f"write `{colour}`", (Edit(span, colour),))
        return f"colours have no names; {lower} is {colour}", fix
    if help is None and dotted:
        files = library.having(re.split(r"\W", source[span.end + 1 : span.end + 80], maxsplit=1)[0])
        statements = " or ".join(f'import "{file}" as {text};' for file in files or ["…"])
        return f"what stands before a dot is imported: {statements}", None
    return help or (f"there is {listing(words.FUNCTIONS)}" if call else None), fix


def report_problem(
    report: Reporter, problem: Problem, span: Span, operands: tuple[tree.Expr | None, ...] = ()
) -> None:
    """Report a `Problem` at the operand it blames, or else at ``span``."""
    at = problem.operand
    operand = operands[at] if at is not None and at < len(operands) else None
    place = operand.span if operand else span
    if problem.letter is not None and isinstance(operand, tree.String):
        place = operand.character(problem.letter)
    if (place.source, place) in report.reported:
        return
    help, fix = problem.help, None
    if problem.fix and not library.holds(place.source):
        help, fix = problem_advice(problem, operand)
    others = ((operands[index], note) for index, note in problem.notes.items() if index < len(operands))
    labels = [Label(other.span, note) for other, note in others if other is not None]
    report.error(problem.code, problem.message, place, help=help, fix=fix, labels=tuple(labels))
