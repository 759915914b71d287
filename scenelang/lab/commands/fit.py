"""``scenelang lab fit``: how often a scene's params are found from its picture."""

from __future__ import annotations

from pathlib import Path

import click

from scenelang.cli.progress import Bar
from scenelang.lab.commands import common


@click.command("fit")
@click.argument("model")
@click.option(
    "--scenes",
    default=50,
    show_default=True,
    type=click.IntRange(1, 10_000),
    metavar="N",
    help="Number of scenes.",
)
@click.option(
    "--params",
    "counts",
    multiple=True,
    default=(1, 2, 3),
    show_default=True,
    type=click.IntRange(1, 24),
    help="Params of a scene; may be repeated: scenes have so many in turn.",
)
@click.option(
    "--side", default=256, show_default=True, type=click.IntRange(32, 1024), help="Side of targets in pixels."
)
@click.option("--gradients", is_flag=True, help="Compare descents by reverse passes and by differences.")
@click.option("--name", default="fit", show_default=True, help="Name of the record.")
@common.seed
@common.out
def command(
    model: str,
    scenes: int,
    counts: tuple[int, ...],
    side: int,
    gradients: bool,
    name: str,
    seed: int,
    out: Path,
) -> None:
    """Fit seeded scenes to exact pictures of values that only these know.

    Numbers of random scenes become params with their full ranges. A start's picture is under 25 dB from the
    target, and each param is felt: 42 dB and less where it alone is at its start. Found is what is within 1 %
    of every range, or a picture at 45 dB.
    """
    from scenelang.lab.fits import measure
    from scenelang.lab.gradients import measure as measure_gradients

    common.model_to_measure(model, None)
    with Bar() as bar:
        if gradients:
            try:
                found = measure_gradients(model, counts, scenes, seed, side, bar)
            except ValueError as error:
                raise click.UsageError(f"{error}.") from None
            common.write_json(out / f"{name}.json", found)
            for row in found["rows"]:
                click.echo(
                    f"{model}, {row['params']} params: {row['faster']} times as fast by reverse passes"
                )
            return
        found = measure(model, counts, scenes, seed, side, bar)
    common.write_json(out / f"{name}.json", found)
    click.echo(
        f"{model}: {found['found']} of {scenes} found ({found['share']:.0%} ± {found['interval']:.0%}), "
        f"median {found['median_seconds']} s and {found['median_frames']} pictures"
    )
