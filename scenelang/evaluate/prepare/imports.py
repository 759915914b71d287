"""``import``, and whole files: what a file brings is prepared once for each import of it."""

from __future__ import annotations

from scenelang.evaluate.builder import Builder
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.names import Binding, Env
from scenelang.evaluate.prepare.blocks import Action, Body, Place, define, prepare_block
from scenelang.evaluate.prepare.settings import at_top_level
from scenelang.evaluate.report.suppression import find_damage
from scenelang.syntax import nodes

_BROUGHT = (nodes.Param, nodes.Let, nodes.Fn, nodes.Module, nodes.Import, nodes.Version)


def prepare_import(stmt: nodes.Import, place: Place) -> Action | None:
    unit = place.unit
    if not at_top_level(place, stmt.span, "an import"):
        define(stmt.alias, Binding("poison", stmt.alias.span), place)
        return None
    loader = unit.loader
    binding = Binding("import", stmt.alias.span)
    good = define(stmt.alias, binding, place)
    path = loader.find(stmt, unit.path, unit.session)
    file = loader.read(path, stmt, unit.session) if path is not None else None
    if path is None or file is None or not good:
        return None
    prefix = f"{unit.prefix}{stmt.alias.text}."
    brought = Unit(file.span.source, unit.session, loader, unit.defines, path, prefix)
    loader.chain.append(path)
    loader.sites.append(stmt.path.span)
    try:
        body = prepare_file(brought, file, imported=True)
    finally:
        loader.chain.pop()
        loader.sites.pop()
    binding.value = brought
    env = brought.root_env

    def action(_: Env, out: Builder) -> None:
        for act in body.actions:
            act(env, Builder())

    return action


def prepare_file(unit: Unit, file: nodes.File, *, imported: bool = False) -> Body:
    """Prepare a file's statements; of an imported one only what it brings."""
    unit.damage = find_damage(file, unit.session.report.diagnostics)
    if unit.damage:
        unit.session.report.damaged[id(unit.source)] = unit.damage
    unit.first = file.statements[0] if file.statements else None
    statements = [s for s in file.statements if not imported or isinstance(s, _BROUGHT)]
    return prepare_block(statements, Place(unit, unit.scope, "file"), file.span)
