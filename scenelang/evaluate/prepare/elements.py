"""What files of elements bring: a geometry ``zoo.car { … }``, and a ready group ``zoo.car() { … }``."""

from __future__ import annotations

from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.costs import MODULE_CALL, OBJECT
from scenelang.evaluate.file_context import Action, Place
from scenelang.evaluate.names import Env
from scenelang.evaluate.prepare.blocks import prepare_inner
from scenelang.evaluate.prepare.expressions import prepare_arguments
from scenelang.evaluate.prepare.nodes import holds_children, place_called, place_child, prepare_object
from scenelang.scene.groups import objects_of
from scenelang.scene.spans import Written
from scenelang.syntax import nodes


def prepare_element(stmt: nodes.Call, place: Place, called: str) -> Action | None:
    """A statement headed by the name of a geometry or a group.

    Args:
        called: what a Scene calls it.
    """
    alias, _, name = called.partition(".")
    file = next(file for file in place.session.elements.values() if file.name == alias)
    zoo = file.zoo
    assert zoo is not None
    groups, geometries = zoo.groups, zoo.geometries
    if stmt.args is None or (stmt.args and name not in groups):
        if name in geometries:
            return prepare_object(stmt, place, called)
        _missing(stmt, place, "geometry", [*geometries], f"its group is {stmt.name.text}() {{ … }}")
        return None
    session, where = place.session, Written(stmt.name.span, stmt.span)
    fits = holds_children(place, where.name, "group `{}`", stmt.name.text)
    block = prepare_inner(stmt.body, place.inner("object")) if stmt.body is not None else None
    if name not in groups:
        _missing(stmt, place, "group", [*groups], f"its geometry is {stmt.name.text} {{ … }}")
        return None
    if stmt.args:
        prepare_arguments(stmt.args, place)
        help = f"move it in its block: {stmt.name.text}() {{ scale(0.5); }}"
        message = f"group `{stmt.name.text}` takes no arguments"
        place.report.error("E0308", message, stmt.args[0].span, help=help)
        return None
    if not fits:
        return None
    count = len(groups[name])
    place.file.weight += MODULE_CALL + OBJECT * count

    def action(env: Env, out: Builder) -> None:
        inside = Builder()
        session.count_objects(count, where.name)
        for part in objects_of(zoo, alias, name):
            place_child(part, where, inside, session)
        place_called(inside, block, env, where, out, session)

    return action


def _missing(stmt: nodes.Call, place: Place, what: str, known: list[str], otherwise: str) -> None:
    """Report a name that stands only for the other of a geometry and a group."""
    alias, _, name = stmt.name.text.partition(".")
    last = Span(stmt.name.span.source, stmt.name.span.end - len(name), stmt.name.span.end)
    help, fix = did_you_mean(name, known, last, effort=place.report.effort)
    there = f"; it has {listing(known)}" if known and help is None else ""
    message = f"`{alias}` has no {what} `{name}`"
    place.report.error("E0212", message, last, help=f"{help or otherwise}{there}", fix=fix)
