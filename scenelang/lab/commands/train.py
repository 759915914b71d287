"""``scenelang lab train``: weights of a study's configuration: other renderers and liftings."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.cli.commands.train import begin, first_mistake, training

if TYPE_CHECKING:
    from scenelang.lab.designs.config import StudentFile


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
    """Train the model of a study, or go on where the checkpoint in FOLDER was saved.

    CONFIG is a JSON file or the name of a shipped configuration, such as shapes2d-streaming. By default one
    thread computes, as for the shipped weights. Exits with 0 also when the budget ends first.
    """
    import torch
    from pydantic import ValidationError

    from scenelang.backend.memory import keep_memory
    from scenelang.backend.neural import choose_device
    from scenelang.lab.designs.config import read_student

    try:
        file = read_student(config)
    except ValidationError as error:
        raise click.UsageError(f"bad configuration `{config}`: {first_mistake(error)}") from None
    keep_memory()
    torch.set_num_threads(threads or 1)
    try:
        _train(
            file, out, math.inf if budget is None else 60 * budget, choose_device(device), every, save_every
        )
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def _train(file: StudentFile, out: Path, budget_s: float, device: str, every: int, save_every: float) -> None:
    """Train, or go on."""
    from scenelang.lab.designs.export import export
    from scenelang.lab.designs.studies import Study

    config = file.study
    study = Study(config, out, device)
    reached = f"{study.progress.seconds:.0f} of {config.seconds:g} s of processor time"
    begin(file.model, reached, study.progress.step, device, out)
    total = 0.0
    for progress in study.run(budget_s, save_every):
        total += progress.loss
        if progress.step % every == 0:
            mean, total = total / every, 0.0
            click.echo(
                f"{progress.step:,} steps, {progress.seconds:.0f} of {config.seconds:g} s, "
                f"mean loss {mean:.4g}",
                err=True,
            )
    if study.progress.seconds < config.seconds:
        click.echo(f"out of time: the same command goes on from the checkpoint in {out}")
        return
    export(study, file, out / "weights.safetensors", device)
    click.echo(f"done: {out / 'weights.safetensors'}")
