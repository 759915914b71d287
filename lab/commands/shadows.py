"""``python -m lab shadows``: the error inside the shadows that media throw on solids."""

from __future__ import annotations

from pathlib import Path

import click

from lab.commands import common
from scenelang.cli.progress import Bar
from scenelang.cli.say import need_metrics


@click.command("shadows")
@click.argument("model", default="solids3d")
@click.option(
    "--scenes",
    default=100,
    show_default=True,
    type=click.IntRange(1, 10_000),
    metavar="N",
    help="Number of scenes.",
)
@click.option(
    "--side",
    default=128,
    show_default=True,
    type=click.IntRange(16, 1024),
    metavar="PIXELS",
    help="Shorter side of the canvas.",
)
@common.seed
@common.out
@common.weights
def command(model: str, scenes: int, side: int, seed: int, out: Path, weights: Path | None) -> None:
    """Draw media that throw their shadows on solids, and measure inside the shadows.

    Writes shadows.json and shadows.png (network, exact picture, FLIP map) into FOLDER.
    """
    need_metrics()
    from lab.shadows import measure_shadows

    loaded = common.model_to_measure(model, weights)
    if loaded.manifest.dimension != 3:
        raise click.UsageError(f"model `{model}` draws no media")
    with Bar() as bar:
        summary, sheet = measure_shadows(loaded, scenes, seed, side, report=bar)
    common.write_json(out / "shadows.json", summary)
    sheet.save(out / "shadows.png")
    inside, wrong = summary["psnr"], summary["wrong_percent"]
    click.echo(
        f"inside shadows: PSNR {inside['mean']:.2f} dB ± {inside['interval']:.2f} "
        f"(worst {inside['worst']:.2f}), {wrong['mean']:.2f} % of the shadow is wrong "
        f"(worst {wrong['worst']:.2f}) on {scenes} scenes"
    )
