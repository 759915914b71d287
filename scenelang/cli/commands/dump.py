"""``scenelang dump``: what a scene is after each stage of the compiler; and what drawing it takes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Literal

import click

from scenelang.cli import options
from scenelang.cli.say import put_out
from scenelang.diagnostics.suggest import plural
from scenelang.words import COMBINE

if TYPE_CHECKING:
    from scenelang.backend.options import How
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
@click.option("--costs", is_flag=True, help="Show what drawing the scene takes and what is left out of it.")
@click.option("--diff", is_flag=True, help="Show only what each pass changed.")
@options.choice("--format", "kind", words="text json", help="Format of what is printed.")
@options.out
@options.request
@options.drawing("device", "threads")
@click.pass_context
def command(
    ctx: click.Context,
    file: str,
    stages: tuple[str, ...],
    costs: bool,
    diff: bool,
    kind: Literal["text", "json"],
    out: str | None,
    request: Request,
    how: How,
) -> None:
    """Show what a scene is after stages of the compiler.

    FILE is a scene, or - for standard input. The stages are syntax (the tree), scene, lower (the graph as
    written), the passes in their order (`--after help` lists them) and program. A scene with mistakes is
    shown as far as it goes; then the exit code is 1.

    --costs shows objects, matrices and tokens after each pass, the model and the next best, how many pixels
    an object reached and how many samples met how many objects (in space how many rays were followed, their
    steps and evaluations of the network), the parameters, the time of a frame, and the error against the
    exact picture.
    """
    from scenelang.cli.jobs import STAGES, check_stages, prepare_scene

    if stages == ("help",):
        click.echo("\n".join(STAGES))
        return
    if costs and (stages or diff):
        raise click.UsageError("--costs is of the whole scene; leave out --after and --diff.")
    check_stages(stages)
    job, source = prepare_scene(file, request)
    if costs:
        _say_costs(ctx, job, request, how, kind, out)
        return
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


def _say_costs(
    ctx: click.Context, job: Job, request: Request, how: How, kind: Literal["text", "json"], out: str | None
) -> None:
    """Draw the scene and write what that took."""
    if job.program is None or job.source is None or job.source.scene is None or job.failed():
        ctx.exit(1)
    from scenelang.backend.neural import choose_device, open_model
    from scenelang.backend.options import threads_for
    from scenelang.measure.plan import plan_of

    opened = open_model(job.program.model, choose_device(how.device))
    asked, cores = request.source.model is not None, how.threads or threads_for(job.program.canvas)
    spans = job.source.spans
    found = plan_of(
        job.source.scene, job.program, job.graphs, opened, asked=asked, spans=spans, threads=cores
    )
    plan: dict[str, Any] = {"version": 1, "file": job.name, **found}
    put_out((json.dumps(plan, indent=2) if kind == "json" else _costs_text(plan)) + "\n", out)


def _costs_text(plan: dict[str, Any]) -> str:
    cost = plan["drawing"]
    if plan["runner_up"]:
        others = f"next best {plan['runner_up']}"
    else:
        others = "no other has all the scene uses" if plan["lacking"] else "there is no other"
    tokens = ", ".join(f"{number:,} {word}" for word, number in plan["tokens"].items())
    if cost["unknown"] is not None:
        error = f"not known: {cost['unknown']}"
    else:
        flip = "" if cost["flip"] is None else f", FLIP {cost['flip']:.4f},"
        error = f"{cost['psnr']:.2f} dB PSNR (50 at most){flip} against the exact picture"
    return "\n".join(
        [
            f"stream     {plural(plan['rows'], 'row')} of 64 numbers ({tokens or 'empty'})",
            *(_rays(cost, plan["rows"]) if "rays" in cost else _meetings(cost)),
            f"frame      {cost['ms']:.1f} ms",
            f"error      {error}",
            "",
            f"model {plan['model']} ({plan['why']}), {cost['parameters']:,} parameters; {others}",
            *[f"  {name} lacks {', '.join(names)}" for name, names in plan["lacking"].items()],
            "",
            *_table(plan["stages"]),
        ]
    )


def _meetings(cost: dict[str, Any]) -> list[str]:
    return [
        f"pixels     {cost['evaluated']:,} of {cost['pixels']:,} evaluated "
        f"({_share(cost['evaluated'], cost['pixels'])}), {cost['refined']:,} of them sampled four times "
        f"({_share(cost['refined'], cost['pixels'])})",
        f"meetings   {cost['meetings']:,} of a sample and an object, "
        f"{_share(cost['meetings'], cost['meetings_unskipped'])} of {cost['meetings_unskipped']:,}",
    ]


def _rays(cost: dict[str, Any], objects: int) -> list[str]:
    rays, steps = cost["rays"] + cost["light_rays"], cost["steps"]
    return [
        f"pixels     {cost['refined']:,} of {cost['pixels']:,} sampled four times "
        f"({_share(cost['refined'], cost['pixels'])})",
        f"rays       {cost['rays']:,} from the eye and {cost['light_rays']:,} to the light, "
        f"{_share(cost['near'], rays)} near an object",
        f"steps      {steps:,}, {steps / max(1, cost['near']):.1f} on a ray near an object",
        f"network    {cost['evaluations']:,} evaluations of an object, "
        f"{cost['evaluations'] / max(1, steps):.2f} of {objects} a step",
    ]


def _table(stages: list[dict[str, Any]]) -> list[str]:
    """A line for each stage; a column for each word that joins something in one of them."""
    words = [w for w in COMBINE if any(w in s["tokens"] for s in stages)]
    heads = ["objects", "matrices", "affine", "deform", "folds", *words]
    lines = [f"{'after':16}" + "".join(f"{head:>10}" for head in heads) + "  (= as before)"]
    for row in stages:
        values = [row[key] for key in ("objects", "matrices", "affines", "deformations", "folds")]
        values += [row["tokens"].get(word, 0) for word in words]
        mark = "" if row["changed"] or row["stage"] == "lower" else "  ="
        lines.append(f"{row['stage']:16}" + "".join(f"{value:10,}" for value in values) + mark)
    return lines


def _share(part: int, whole: int) -> str:
    return f"{100 * part / whole if whole else 0.0:.1f} %"
