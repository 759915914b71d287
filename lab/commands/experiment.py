"""``python -m lab experiment``: trainings at equal budgets, measured on the same unseen scenes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lab.commands.common import check_names, write_json
from lab.commands.train import prepare_torch
from scenelang.cli import options
from scenelang.cli.say import need_metrics

if TYPE_CHECKING:
    from lab.designs.studies import Study
    from lab.experiments.runs import Run


@click.command("experiment")
@click.argument("names", metavar="NAME...", nargs=-1, required=True)
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Folder for NAME.json, strips of pictures, and checkpoints to go on from.",
)
@click.option(
    "--budget",
    required=True,
    type=options.Real(0, min_open=True),
    metavar="MINUTES",
    help="Processor time of each training.",
)
@click.option(
    "--scenes",
    default=200,
    show_default=True,
    type=click.IntRange(8, 10_000),
    help="Unseen scenes to measure.",
)
@click.option(
    "--seed",
    default=1,
    show_default=True,
    type=click.IntRange(0, 2000),
    metavar="N",
    help="Seed of parameters and training scenes.",
)
@options.device
@options.threads
def command(
    names: tuple[str, ...],
    out: Path,
    budget: float,
    scenes: int,
    seed: int,
    device: str,
    threads: int | None,
) -> None:
    """Train several renderers and liftings for the same time each and measure them alike.

    NAME is one or more of overfit, compare, table2, table3, table4, seeds, parts, or all.
    """
    need_metrics()
    from lab.experiments.experiment import Settings, run_experiment
    from lab.experiments.runs import EXPERIMENTS

    wanted = list(EXPERIMENTS) if "all" in names else list(dict.fromkeys(names))
    check_names("experiment", wanted, [*EXPERIMENTS, "all"])
    settings = Settings(out, scenes, prepare_torch(device, threads))
    for name in wanted:
        try:
            found = run_experiment(name, 60 * budget, seed, settings, _report)
        except ValueError as error:
            raise click.UsageError(f"{error}; choose another folder or the same budget") from None
        write_json(out / f"{name}.json", found)
        for run in found["runs"]:
            click.echo(
                f"{name}: {run['name']}, {run['group']}: PSNR {run['psnr']['mean']:.2f} dB, "
                f"worst {run['psnr']['worst']:.2f}, FLIP {run['flip']['mean']:.4f}, {run['steps']:,} steps"
            )


def _report(run: Run, study: Study, psnr: float | None) -> None:
    reached = "" if psnr is None else f", PSNR {psnr:.2f} dB"
    click.echo(
        f"{run.name}, {run.group}: {study.progress.seconds:.0f} of {study.config.seconds:g} s, "
        f"{study.progress.step:,} steps{reached}",
        err=True,
    )
