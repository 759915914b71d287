"""``scenelang lab train``: weights of a study's configuration: other renderers and liftings."""

from __future__ import annotations

from pathlib import Path

import click

from scenelang.cli.commands.train import begin, prepare_torch, reporting_mistakes, training


@click.command("train")
@training
def command(
    config: str,
    out: Path,
    budget_s: float,
    device: str,
    threads: int | None,
    every: int,
    save_every: float,
) -> None:
    """Train the model of a study, or go on where the checkpoint in FOLDER was saved.

    CONFIG is a JSON file or the name of a shipped configuration, such as shapes2d-streaming. By default one
    thread computes, as for the shipped weights. Exits with 0 also when the budget ends first.
    """
    from scenelang.lab.designs.export import export
    from scenelang.lab.designs.studies import Study, read_student

    with reporting_mistakes(config, out):
        file = read_student(config)
        place = prepare_torch(device, threads)
        study = Study(file.study, out, place)
        seconds = file.study.seconds
        reached = f"{study.progress.seconds:.0f} of {seconds:g} s of processor time"
        begin(file.model, reached, study.progress.step, place, out)
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
