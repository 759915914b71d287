"""``scenelang train``: weights from a configuration, with a checkpoint to go on from."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from scenelang.cli import options
from scenelang.cli.progress import Bar


def training(made: Callable[..., None]) -> Callable[..., None]:
    """The arguments and options of commands that train."""
    for option in (
        click.option(
            "--save-every",
            type=options.Real(0),
            default=60.0,
            show_default=True,
            metavar="SECONDS",
            help="Longest time between checkpoints; the first comes after the first step.",
        ),
        click.option(
            "--every",
            type=click.IntRange(1),
            metavar="N",
            default=500,
            show_default=True,
            help="Steps between reports.",
        ),
        options.threads,
        options.device,
        click.option(
            "--budget",
            "budget_s",
            type=options.Real(0, min_open=True),
            callback=lambda ctx, param, minutes: math.inf if minutes is None else 60 * minutes,
            metavar="MINUTES",
            help="Stop after this time, with a checkpoint.",
        ),
        click.option(
            "-o",
            "--out",
            required=True,
            type=click.Path(file_okay=False, path_type=Path),
            metavar="FOLDER",
            help="Folder for the checkpoint, the log and at the end the weights.",
        ),
        click.argument("config"),
    ):
        made = option(made)
    return made


@click.command("train")
@training
def command(
    config: str, out: Path, budget_s: float, device: str, threads: int | None, every: int, save_every: float
) -> None:
    """Train, or go on where the checkpoint in FOLDER was saved.

    CONFIG is a JSON file or the name of a shipped configuration. By default one thread computes, as for
    the shipped weights. Exits with 0 also when the budget ends first.
    """
    from scenelang.training.config import (
        SolidsConfig,
        config_data,
        is_solids,
        read_config,
        read_solids_config,
    )
    from scenelang.training.loop import train
    from scenelang.training.solids import train_solids

    if b'"study"' in config_data(config):
        raise click.UsageError(f"`{config}` configures a study; scenelang lab train trains it.")
    last: dict[str, float] = {}
    with reporting_mistakes(config, out), Bar() as bar:
        wanted = read_solids_config(config) if is_solids(config_data(config)) else read_config(config)
        place = prepare_torch(device, threads)

        def note(done: int, total: int, seconds: float, parts: dict[str, float]) -> None:
            if not parts:
                begin(wanted.model, f"step {done:,} of {total:,}", done, place, out)
                return
            last.clear()
            last.update(parts)
            if sys.stderr.isatty():
                bar(_losses(parts), done, total)
            else:
                click.echo(f"{done:,} of {total:,} steps, {seconds:.0f} s, {_losses(parts)}", err=True)

        if isinstance(wanted, SolidsConfig):
            finished = train_solids(wanted, out, budget_s=budget_s, report=note)
        else:
            finished = train(
                wanted,
                out,
                budget_s=budget_s,
                device=place,
                report=note,
                save_every_s=save_every,
                report_every=every,
            )
    reached = f", mean loss {_losses(last)}" if last else ""
    weights = out / "weights.safetensors"
    if not finished:
        click.echo(f"out of time{reached}: the same command goes on from the checkpoint in {out}")
    elif isinstance(wanted, SolidsConfig):
        click.echo(f"done{reached}: {weights}")
    else:
        from scenelang.measure.scenes import record_measured

        figures = record_measured(weights, wanted.cell or wanted.model)
        means = ", ".join(f"{k[5:]} {v['mean']:.1f}" for k, v in figures.items() if k.startswith("psnr_"))
        click.echo(f"done{reached}; PSNR of unseen scenes (dB): {means}: {weights}")


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


def begin(model: str, reached: str, done: int, device: str, out: Path) -> None:
    """Say whether a training starts or goes on."""
    what = "going on with" if done else "starting"
    click.echo(f"{what} the training of {model} at {reached}, on {device}, in {out}", err=True)


def _losses(parts: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in parts.items())
