"""``python -m lab train``: weights from a configuration, with a checkpoint to go on from."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from lab.training.config import SolidsConfig, config_data, is_solids, read_config, read_solids_config
from scenelang.cli import options
from scenelang.cli.progress import Bar


@click.command("train")
@click.argument("config")
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Folder for the checkpoint, the log and at the end the weights.",
)
@click.option(
    "--budget",
    "budget_s",
    type=options.Real(0, min_open=True),
    callback=lambda ctx, param, minutes: math.inf if minutes is None else 60 * minutes,
    metavar="MINUTES",
    help="Stop after this time, with a checkpoint; of long trainings processor time.",
)
@click.option(
    "--begin",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="WEIGHTS",
    help="Weights that a long training begins from; their time and curve go on.",
)
@options.device
@options.threads
@click.option(
    "--every",
    type=click.IntRange(1),
    metavar="N",
    default=500,
    show_default=True,
    help="Steps between reports.",
)
@click.option(
    "--save-every",
    type=options.Real(0),
    default=60.0,
    show_default=True,
    metavar="SECONDS",
    help="Longest time between checkpoints; the first comes after the first step.",
)
def command(
    config: str,
    out: Path,
    budget_s: float,
    begin: Path | None,
    device: str,
    threads: int | None,
    every: int,
    save_every: float,
) -> None:
    """Train, or go on where the checkpoint in FOLDER was saved.

    CONFIG is a JSON file or the name of a shipped configuration, such as shapes2d. By default one thread
    computes, as for the shipped weights. Exits with 0 also when the budget ends first; a long training writes
    weights then too.
    """
    with reporting_mistakes(config, out):
        data = config_data(config)
        long = b'"long"' in data
        if begin is not None and not long:
            raise click.UsageError("--begin is for long trainings; others begin from nothing")
        place = prepare_torch("cpu" if long else device, threads)
        if long:
            _long(config, out, begin, budget_s, every, save_every)
        elif is_solids(data):
            _solids(read_solids_config(config), out, budget_s, place)
        else:
            _shapes(config, out, budget_s, place, every, save_every)


def _shapes(config: str, out: Path, budget_s: float, device: str, every: int, save_every: float) -> None:
    from lab.sets.scenes import record_measured
    from lab.training.loop import train

    wanted = read_config(config)
    weights = out / "weights.safetensors"
    with Bar() as bar:
        notes = Notes(bar, wanted.model, device, out)
        finished = train(
            wanted,
            out,
            budget_s=budget_s,
            device=device,
            report=notes,
            save_every_s=save_every,
            report_every=every,
        )
    if not finished:
        click.echo(f"out of time{notes.reached}: the same command goes on from the checkpoint in {out}")
        return
    figures = record_measured(weights, wanted.cell or wanted.model)
    means = ", ".join(f"{k[5:]} {v['mean']:.1f}" for k, v in figures.items() if k.startswith("psnr_"))
    click.echo(f"done{notes.reached}; PSNR of unseen scenes (dB): {means}: {weights}")


def _solids(config: SolidsConfig, out: Path, budget_s: float, device: str) -> None:
    from lab.training.solids import train_solids

    with Bar() as bar:
        notes = Notes(bar, config.model, device, out)
        finished = train_solids(config, out, budget_s=budget_s, report=notes)
    if finished:
        click.echo(f"done{notes.reached}: {out / 'weights.safetensors'}")
    else:
        click.echo(f"out of time{notes.reached}: the same command goes on from the checkpoint in {out}")


class Notes:
    """Progress of a training by steps: a bar on terminals, else lines."""

    def __init__(self, bar: Bar, model: str, device: str, out: Path) -> None:
        self.bar, self.model, self.device, self.out = bar, model, device, out
        self.reached = ""  # ", mean loss …" of the last report

    def __call__(self, done: int, total: int, seconds: float, losses: dict[str, float]) -> None:
        """Report steps done of all, seconds spent and mean losses, of which there are none at the start."""
        if not losses:
            say_begin(self.model, f"step {done:,} of {total:,}", done, self.device, self.out)
            return
        told = ", ".join(f"{name} {value:.4g}" for name, value in losses.items())
        self.reached = f", mean loss {told}"
        if sys.stderr.isatty():
            self.bar(told, done, total)
        else:
            click.echo(f"{done:,} of {total:,} steps, {seconds:.0f} s, {told}", err=True)


def _long(
    config: str,
    out: Path,
    begin: Path | None,
    budget_s: float,
    every: int,
    save_every: float,
) -> None:
    from lab.designs.long import LongTraining, export_long, read_long

    file = read_long(config)
    run = LongTraining(file.long, out, begin)
    reached = f"step {run.step:,} of {run.steps:,}, {run.seconds / 3600:.2f} core-hours"
    say_begin(file.model, reached, run.step, "cpu", out)
    weights = out / "weights.safetensors"
    total, known = 0.0, len(run.curve)
    for done, loss in enumerate(run.run(budget_s, save_every), 1):
        total += loss
        if done % every == 0:
            click.echo(
                f"{run.step:,} of {run.steps:,} steps, {run.seconds:.0f} s, mean loss {total / every:.4g}",
                err=True,
            )
            total = 0.0
        if len(run.curve) > known:
            known = len(run.curve)
            point = run.curve[-1]
            click.echo(
                f"{point.seconds / 3600:.3f} core-hours, {point.side} x {point.side}: {point.psnr:.2f} dB",
                err=True,
            )
            export_long(run, file.model, weights)
    export_long(run, file.model, weights)
    if run.step < run.steps:
        click.echo(f"out of time: the same command goes on from the checkpoint in {out}; so far: {weights}")
    else:
        click.echo(f"done: {weights}")


@contextmanager
def reporting_mistakes(config: str, out: Path) -> Iterator[None]:
    """Report mistakes in a configuration or a checkpoint, and how an interrupted training goes on."""
    from pydantic import ValidationError

    try:
        yield
    except ValidationError as error:
        mistake = error.errors(include_url=False)[0]
        where = "".join(f"{part}." for part in mistake["loc"])[:-1]
        told = f"{where}: {mistake['msg']}" if where else mistake["msg"]
        raise click.UsageError(f"bad configuration `{config}`: {told}") from None
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    except KeyboardInterrupt:
        click.echo(f"interrupted; the same command goes on from the checkpoint in {out}", err=True)
        raise


def prepare_torch(device: str, threads: int | None) -> str:
    """Set torch up for a long computation; returns the device."""
    import torch

    from scenelang.backend.neural import choose_device
    from scenelang.backend.options import keep_memory

    keep_memory()
    torch.set_num_threads(threads or 1)
    return choose_device(device)


def say_begin(model: str, reached: str, done: int, device: str, out: Path) -> None:
    """Say whether a training starts or goes on."""
    what = "going on with" if done else "starting"
    click.echo(f"{what} the training of {model} at {reached}, on {device}, in {out}", err=True)
