"""``python -m lab stability``: how a model's error grows where scenes leave what it was trained on."""

from __future__ import annotations

import json
from pathlib import Path

import click

from lab.commands import common
from scenelang.cli.progress import Bar
from scenelang.cli.say import need_metrics


@click.command("stability")
@click.argument("model")
@click.option(
    "--only", multiple=True, metavar="NAME", help="Probe to measure; may be repeated. By default all."
)
@click.option(
    "--scenes", default=20, show_default=True, type=click.IntRange(1, 10_000), help="Scenes of each value."
)
@click.option(
    "--known",
    multiple=True,
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Record of this command to add to, not measured again; may be repeated.",
)
@common.seed
@common.out
@common.weights
def command(
    model: str,
    only: tuple[str, ...],
    scenes: int,
    known: tuple[Path, ...],
    seed: int,
    out: Path,
    weights: Path | None,
) -> None:
    """Vary one quantity at a time, far beyond what MODEL was trained on, and measure.

    Writes stability.json and, where matplotlib is installed, stability.png into FOLDER.
    """
    need_metrics()
    import torch

    from lab.stability.suite import INVARIANTS, kit_of, run_stability

    loaded = common.model_to_measure(model, weights)
    common.check_names("probe", only, [*kit_of(loaded.manifest).probes, *INVARIANTS])
    torch.set_num_threads(1)
    earlier = [json.loads(path.read_text("utf-8")) for path in known]
    try:
        with Bar() as bar:
            found = run_stability(loaded, scenes, seed, only, bar, earlier)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    common.write_json(out / "stability.json", found)
    for name, probe in found["probes"].items():
        figures = [(row["value"], row["psnr"]["mean"], row["psnr"]["worst"]) for row in probe["rows"]]
        cells = "; ".join(f"{value:g} {mean:.1f} ({worst:.1f})" for value, mean, worst in figures)
        click.echo(f"{name}: PSNR by {probe['quantity']}, mean (worst): {cells}")
    for name, figures in found["invariants"].items():
        click.echo(f"{name}: " + ", ".join(f"{k} {v:g}" for k, v in figures.items()))
    if found["probes"]:
        from lab.charts import stability_chart

        common.write_chart(out / "stability.png", lambda: stability_chart([found]))
