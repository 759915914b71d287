"""``scenelang lab train``: weights of a study's configuration: other renderers and liftings."""

from __future__ import annotations

from pathlib import Path

import click

from scenelang.cli.commands.train import begin as tell_begin
from scenelang.cli.commands.train import prepare_torch, reporting_mistakes, training
from scenelang.training.config import config_data


@click.command("train")
@training
@click.option(
    "--begin",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="WEIGHTS",
    help="Weights that a long training begins from; their time and curve go on.",
)
def command(
    config: str,
    out: Path,
    budget_s: float,
    device: str,
    threads: int | None,
    every: int,
    save_every: float,
    begin: Path | None,
) -> None:
    """Train the model of a study or a long training, or go on where the checkpoint in FOLDER was saved.

    CONFIG is a JSON file or the name of a shipped configuration, such as shapes2d-streaming. By default one
    thread computes, as for the shipped weights. Budgets are processor time. Exits with 0 also when the budget
    ends first; a long training writes weights then too.
    """
    from scenelang.lab.designs.export import export
    from scenelang.lab.designs.studies import Study, read_student

    if b'"long"' in config_data(config):
        with reporting_mistakes(config, out):
            _long(config, out, begin, budget_s, threads, every, save_every)
        return
    if begin is not None:
        raise click.UsageError("a study begins from nothing; --begin is for long trainings")
    with reporting_mistakes(config, out):
        file = read_student(config)
        place = prepare_torch(device, threads)
        study = Study(file.study, out, place)
        seconds = file.study.seconds
        reached = f"{study.progress.seconds:.0f} of {seconds:g} s of processor time"
        tell_begin(file.model, reached, study.progress.step, place, out)
        total = 0.0
        for progress in study.run(budget_s, save_every):
            total += progress.loss
            if progress.step % every == 0:
                told = f"{progress.step:,} steps, {progress.seconds:.0f} of {seconds:g} s"
                click.echo(f"{told}, mean loss {total / every:.4g}", err=True)
                total = 0.0
        if study.progress.seconds < seconds:
            click.echo(f"out of time: the same command goes on from the checkpoint in {out}")
            return
        export(study, file, out / "weights.safetensors", place)
    click.echo(f"done: {out / 'weights.safetensors'}")


def _long(
    config: str,
    out: Path,
    begin: Path | None,
    budget_s: float,
    threads: int | None,
    every: int,
    save_every: float,
) -> None:
    from scenelang.lab.designs.export import export_long
    from scenelang.lab.designs.long import LongTraining
    from scenelang.lab.designs.phases import read_long

    file = read_long(config)
    place = prepare_torch("cpu", threads)
    run = LongTraining(file.long, out, begin)
    reached = f"step {run.step:,} of {run.steps:,}, {run.seconds / 3600:.2f} core-hours"
    tell_begin(file.model, reached, run.step, place, out)
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
