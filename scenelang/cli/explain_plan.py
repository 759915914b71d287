"""``scenelang explain-plan``: what a scene costs after every stage, and what was left out."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Literal

import click

from scenelang.cli import options

if TYPE_CHECKING:
    from scenelang.scene.params import Defines


@click.command("explain-plan")
@click.argument("file", metavar="FILE")
@options.define
@options.size
@options.frame
@options.model
@options.root
@options.device
@options.threads
@click.option("--format", "kind", type=click.Choice(["text", "json"]), default="text", show_default=True)
@click.pass_context
def command(
    ctx: click.Context,
    file: str,
    defines: Defines,
    size: tuple[int, int] | None,
    frame: int,
    model: str | None,
    root: str | None,
    device: str,
    threads: int | None,
    kind: Literal["text", "json"],
) -> None:
    """Say what drawing a scene takes and what the compiler and the renderer leave out.

    FILE is a scene, or - for standard input. Shows objects, matrices and folds after each pass, the model
    and the next best, how many samples met how many objects, the time of a frame, and the error against the
    exact picture.
    """
    from scenelang.cli.inputs import Request
    from scenelang.cli.say import say_diagnostics
    from scenelang.cli.stages import run_stages

    made = run_stages(file, Request(defines, model, root, frame, size))
    say_diagnostics(made.diagnostics)
    if made.program is None or made.source.scene is None or made.diagnostics.errors:
        ctx.exit(1)
    from scenelang.backend.neural import choose_device, open_model, usable_cores
    from scenelang.evaluation.plan import choice, drawing_cost, stages, token_counts

    scene, program = made.source.scene, made.program
    opened = open_model(program.model, choose_device(device))
    plan: dict[str, Any] = {
        "version": 1,
        "file": file,
        **choice(scene, program.model, asked=model is not None),
        "stages": stages(made.graphs),
        "rows": len(program),
        "tokens": token_counts(program.tokens.tolist()),
        "drawing": drawing_cost(scene, program, opened, made.source.spans, threads or usable_cores()),
    }
    click.echo(json.dumps(plan, indent=2) if kind == "json" else _text(plan))


def _text(plan: dict[str, Any]) -> str:
    cost = plan["drawing"]
    lines = [
        f"model {plan['model']} ({plan['why']}), {cost['parameters']:,} parameters; "
        + (f"next best {plan['runner_up']}" if plan["runner_up"] else "no other has all the scene uses")
    ]
    lines += [f"  {name} lacks {', '.join(names)}" for name, names in plan["lacking"].items()]
    lines += ["", f"{'after':16} {'objects':>8} {'matrices':>9} {'affine':>7} {'deform':>7} {'folds':>6}"]
    for row in plan["stages"]:
        mark = "" if row["changed"] or row["stage"] == "lower" else "  ="
        lines.append(
            f"{row['stage']:16} {row['objects']:8,} {row['matrices']:9,} {row['affines']:7,} "
            f"{row['deformations']:7,} {row['folds']:6,}{mark}"
        )
    tokens = ", ".join(f"{number:,} {word}" for word, number in plan["tokens"].items())
    unskipped = cost["meetings_unskipped"]
    share = cost["meetings"] / unskipped if unskipped else 0.0
    lines += [
        "",
        f"stream     {plan['rows']:,} rows of 64 numbers ({tokens or 'empty'})",
        f"pixels     {cost['pixels']:,}, of which {cost['refined']:,} sampled four times "
        f"({100 * cost['refined'] / cost['pixels']:.1f} %)",
        f"meetings   {cost['meetings']:,} of a sample and an object, {100 * share:.1f} % of {unskipped:,}",
        f"frame      {cost['ms']:.1f} ms",
        f"error      {cost['psnr']:.2f} dB PSNR against the exact picture (50 at most)",
    ]
    return "\n".join(lines)
