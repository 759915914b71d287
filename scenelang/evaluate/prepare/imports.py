"""``import``, and whole files: what a file brings is prepared once for each import of it."""

from __future__ import annotations

from scenelang.evaluate.builder import Builder
from scenelang.evaluate.file_context import Action, FileContext, Place
from scenelang.evaluate.names import Binding, Env
from scenelang.evaluate.prepare.blocks import Body, define, prepare_block
from scenelang.evaluate.prepare.settings import at_top_level
from scenelang.evaluate.report.suppression import find_damage
from scenelang.syntax import nodes
from scenelang.words import STAGE

_BROUGHT = (nodes.Param, nodes.Let, nodes.Fn, nodes.Module, nodes.Import, nodes.Version)


def prepare_import(stmt: nodes.Import, place: Place) -> Action | None:
    context, alias = place.file, stmt.alias
    if not at_top_level(place, stmt.span, "an import"):
        define(alias, Binding("poison", alias.span), place)
        return None
    loader = context.loader
    binding = Binding("import", alias.span)
    good = define(alias, binding, place)
    found = loader.load(stmt, context.path, context.session)
    if found is None or not good:
        return None
    path, file = found
    prefix = f"{context.prefix}{alias.text}."
    brought = FileContext(file.span.source, context.session, loader, context.defines, path, prefix)
    loader.chain.append(path)
    loader.sites.append(stmt.path.span)
    try:
        body = prepare_file(brought, file, imported=True)
    finally:
        loader.chain.pop()
        loader.sites.pop()
    binding.value = brought

    def action(_: Env, out: Builder) -> None:
        for act in body.actions:
            act(brought.env, Builder())

    return action


def prepare_file(context: FileContext, file: nodes.File, *, imported: bool = False) -> Body:
    """Prepare a file's statements; of an imported one only what it brings."""
    report = context.session.report
    context.damage = find_damage(file, report.diagnostics)
    if context.damage:
        report.damaged[context.source] = context.damage
    context.first = file.statements[0] if file.statements else None
    if imported:
        own = {s.name.text for s in file.statements if isinstance(s, nodes.Module)}
        for stmt in file.statements:
            if isinstance(stmt, nodes.Call) and stmt.name.text in STAGE and stmt.name.text not in own:
                help = "it belongs to the scene: put it into the file that is drawn"
                fact = f"`{stmt.name.text}` in an imported file"
                report.error_once((fact, context.source), "E0330", fact, stmt.name.span, help=help)
    statements = [s for s in file.statements if not imported or isinstance(s, _BROUGHT)]
    return prepare_block(statements, Place(context, context.scope, "file"), file.span)
