"""``scenelang dump``: what a scene is after each stage of the compiler; imports no torch."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Literal

import click

from scenelang.cli import options
from scenelang.cli.say import put_out

if TYPE_CHECKING:
    from scenelang.cli.inputs import Input, Request
    from scenelang.cli.jobs import Job


@click.command("dump")
@click.argument("file", metavar="FILE")
@click.option(
    "--after",
    "stages",
    multiple=True,
    metavar="STAGE",
    help="Stage or pass to show; may be given several times. By default program, with --diff all.",
)
@click.option("--diff", is_flag=True, help="Show only what each pass changed.")
@options.choice("--format", "kind", words="text json", help="Format of what is printed.")
@options.out
@options.request
@click.pass_context
def command(
    ctx: click.Context,
    file: str,
    stages: tuple[str, ...],
    diff: bool,
    kind: Literal["text", "json"],
    out: str | None,
    request: Request,
) -> None:
    """Show what a scene is after stages of the compiler.

    FILE is a scene, or - for standard input. The stages are syntax (the tree), scene, lower (the graph as
    written), the passes in their order (`--after help` lists them) and program. A scene with mistakes is
    shown as far as it goes; then the exit code is 1.
    """
    from scenelang.cli.jobs import STAGES, check_stages, prepare_scene

    if stages == ("help",):
        click.echo("\n".join(STAGES))
        return
    check_stages(stages)
    job, source = prepare_scene(file, request)
    shown = list(_changes(job, stages) if diff else _whole(job, source, stages or ("program",), kind))
    if kind == "json":
        put_out(json.dumps({"version": 1, "stages": shown}, indent=2, ensure_ascii=False) + "\n", out)
    else:
        titled = len(shown) > 1 or diff
        parts = [(f"after {each['stage']}:\n" if titled else "") + each["text"] for each in shown]
        put_out("\n".join(parts), out)
    ctx.exit(int(job.failed()))


def _changes(job: Job, wanted: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    """The differences that the passes made, of those that made any; all passes, or the wanted."""
    from scenelang.interchange.dumps import changes, dump

    before, old = "", "nothing"
    for name, graph in job.graphs.items():
        text = before if before and job.graphs[old] is graph else dump(graph)
        if not wanted or name in wanted:
            said = changes(before, text, old, name) if before else text
            if said or wanted:
                yield {"stage": name, "text": said}
        before, old = text, name


def _whole(job: Job, source: Input, wanted: tuple[str, ...], kind: str) -> Iterator[dict[str, Any]]:
    """The stages that were reached, as text or as data."""
    from scenelang.interchange.dumps import (
        dump,
        graph_data,
        program_data,
        program_table,
        tree_data,
        tree_text,
    )

    known: dict[str, tuple[str, Any, Callable[[Any], Any], Callable[[Any], str]]] = {
        name: ("graph", graph, graph_data, dump) for name, graph in job.graphs.items()
    }
    known["syntax"] = ("tree", source.tree, tree_data, tree_text)
    known["scene"] = ("scene", source.scene, lambda s: json.loads(s.to_json()), lambda s: str(s.to_nsg()))
    known["program"] = ("program", job.program, program_data, program_table)
    for name in wanted:
        key, value, data, text = known.get(name, ("", None, str, str))
        if value is not None:
            yield {"stage": name, **({key: data(value)} if kind == "json" else {"text": text(value)})}
