"""``scenelang train``: weights from a configuration, with a checkpoint to go on from."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.cli import options

if TYPE_CHECKING:
    from pydantic import ValidationError


def training(made: Callable[..., None]) -> Callable[..., None]:
    """The arguments and options of commands that train."""
    for option in (
        click.pass_context,
        click.option(
            "--save-every",
            type=click.FloatRange(0),
            default=60.0,
            show_default=True,
            metavar="SECONDS",
            help="Most time between checkpoints; the first comes after the first step.",
        ),
        click.option(
            "--every", type=click.IntRange(1), default=500, show_default=True, help="Steps between reports."
        ),
        options.threads,
        options.device,
        click.option(
            "--budget",
            type=click.FloatRange(0, min_open=True),
            metavar="MINUTES",
            help="Stop after this time, with a checkpoint.",
        ),
        click.option(
            "-o",
            "--out",
            required=True,
            type=click.Path(file_okay=False, path_type=Path),
            metavar="FOLDER",
            help="Gets the checkpoint, the log and at the end the weights.",
        ),
        click.argument("config"),
    ):
        made = option(made)
    return made


@click.command("train")
@training
def command(
    ctx: click.Context,
    config: str,
    out: Path,
    budget: float | None,
    device: str,
    threads: int | None,
    every: int,
    save_every: float,
) -> None:
    """Train, or go on where the checkpoint in FOLDER was saved.

    CONFIG is a JSON file or the name of a shipped configuration. By default one thread computes, as for
    the shipped weights. Exits with 0 also when the budget ends first.
    """
    import torch
    from pydantic import ValidationError

    from scenelang.backend.memory import keep_memory
    from scenelang.backend.neural import choose_device
    from scenelang.cli.progress import Bar
    from scenelang.training.config import config_data, is_study, read_config
    from scenelang.training.loop import train

    if is_study(config_data(config)):
        raise click.UsageError(f"`{config}` configures a study; scenelang lab train trains it.")
    try:
        wanted = read_config(config)
    except ValidationError as error:
        raise click.UsageError(f"bad configuration `{config}`: {first_mistake(error)}") from None
    keep_memory()
    torch.set_num_threads(threads or 1)
    place = choose_device(device)
    last: dict[str, float] = {}
    try:
        with Bar() as bar:

            def note(done: int, total: int, seconds: float, parts: dict[str, float]) -> None:
                if not parts:
                    begin(wanted.model, f"step {done:,} of {total:,}", done, place, out)
                    return
                last.clear()
                last.update(parts)
                if sys.stderr.isatty():
                    bar(_losses(parts), done, total)
                else:
                    told = f"{done:,} of {total:,} steps, {seconds:.0f} s, {_losses(parts)}"
                    click.echo(told, err=True)

            finished = train(
                wanted,
                out,
                budget_s=math.inf if budget is None else 60 * budget,
                device=place,
                report=note,
                save_every_s=save_every,
                report_every=every,
            )
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    except KeyboardInterrupt:
        click.echo(f"interrupted; the same command goes on from the checkpoint in {out}", err=True)
        raise
    reached = f", mean loss {_losses(last)}" if last else ""
    if finished:
        from scenelang.measure.record import record_measured

        weights = out / "weights.safetensors"
        figures = record_measured(weights, wanted.cell or wanted.model)
        means = ", ".join(f"{k[5:]} {v['mean']:.1f}" for k, v in figures.items() if k.startswith("psnr_"))
        click.echo(f"done{reached}; PSNR of unseen scenes (dB): {means}: {weights}")
    else:
        click.echo(f"out of time{reached}: the same command goes on from the checkpoint in {out}")
    ctx.exit(0)


def begin(model: str, reached: str, done: int, device: str, out: Path) -> None:
    """Say whether a training starts or goes on."""
    what = "going on with" if done else "starting"
    click.echo(f"{what} the training of {model} at {reached}, on {device}, in {out}", err=True)


def _losses(parts: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in parts.items())


def first_mistake(error: ValidationError) -> str:
    """The first mistake that was found, in a line."""
    mistake = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in mistake["loc"])
    return f"{where}: {mistake['msg']}" if where else mistake["msg"]
