"""``scenelang explain-plan``: what a scene costs after every stage, and what was left out."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Literal

import click

from scenelang.cli import options
from scenelang.diagnostics.suggest import plural
from scenelang.words import COMBINE

if TYPE_CHECKING:
    from scenelang.cli.inputs import Request


@click.command("explain-plan")
@click.argument("file", metavar="FILE")
@options.request
@options.device
@options.threads
@options.choice("--format", "kind", words="text json", help="Format of what is printed.")
@click.pass_context
def command(
    ctx: click.Context,
    file: str,
    request: Request,
    device: str,
    threads: int | None,
    kind: Literal["text", "json"],
) -> None:
    """Say what drawing a scene takes and what the compiler and the renderer leave out.

    FILE is a scene, or - for standard input. Shows objects, matrices and tokens after each pass, the model
    and the next best, how many pixels an object reached and how many samples met how many objects (in
    space how many rays were followed, their steps and evaluations of the network), the parameters, the time
    of a frame, and the error against the exact picture.
    """
    from scenelang.cli.jobs import prepare_scene

    job, source = prepare_scene(file, request)
    scene, program = source.scene, job.program
    if program is None or scene is None or job.failed():
        ctx.exit(1)
    from scenelang.backend.neural import choose_device, open_model
    from scenelang.backend.options import threads_for
    from scenelang.measure.plan import plan_of

    opened = open_model(program.model, choose_device(device))
    asked, cores = request.model is not None, threads or threads_for(program.canvas)
    found = plan_of(scene, program, job.graphs, opened, asked=asked, spans=source.spans, threads=cores)
    plan: dict[str, Any] = {"version": 1, "file": file, **found}
    click.echo(json.dumps(plan, indent=2) if kind == "json" else _text(plan))


def _text(plan: dict[str, Any]) -> str:
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
