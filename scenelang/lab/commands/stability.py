"""``scenelang lab stability``: how a model's error grows where scenes leave what it was trained on."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import click

from scenelang.cli.needs import need_metrics
from scenelang.lab.commands.eval import DEFAULT_SEED, model_to_measure


@click.command("stability")
@click.argument("model")
@click.option("--only", multiple=True, metavar="NAME", help="A probe; may be repeated. Default: all.")
@click.option(
    "--scenes", default=20, show_default=True, type=click.IntRange(1, 10_000), help="Of each value."
)
@click.option("--seed", default=DEFAULT_SEED, show_default=True, type=click.IntRange(0, 2**31 - 1))
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("out"), show_default=True)
@click.option(
    "--weights", type=click.Path(path_type=Path, exists=True, dir_okay=False), help="Other weights."
)
def command(
    model: str, only: tuple[str, ...], scenes: int, seed: int, out: Path, weights: Path | None
) -> None:
    """Vary one quantity at a time, far beyond what MODEL was trained on, and measure.

    Writes stability.json and, where matplotlib is installed, stability.png and stability.svg into OUT.
    """
    need_metrics()
    import torch

    from scenelang.files import write_whole
    from scenelang.lab.stability.probes import PROBES
    from scenelang.lab.stability.suite import INVARIANTS, run_stability

    known = [*PROBES, *INVARIANTS]
    unknown = [name for name in only if name not in known]
    if unknown:
        raise click.UsageError(f"no probe '{unknown[0]}'; the probes are {', '.join(known)}")
    loaded = model_to_measure(model, weights)
    torch.set_num_threads(1)
    found = run_stability(loaded, scenes, seed, only, _report if sys.stderr.isatty() else None)
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / "stability.json", (json.dumps(found, indent=1) + "\n").encode())
    for name, probe in found["probes"].items():
        click.echo(f"{name}: {_line(probe)}")
    for name, figures in found["invariants"].items():
        click.echo(f"{name}: " + ", ".join(f"{k} {v:g}" for k, v in figures.items()))
    if found["probes"]:
        _chart(found, out)


def _line(probe: dict[str, Any]) -> str:
    cells = [
        f"{row['value']:g} {row['psnr']['mean']:.1f} ({row['psnr']['worst']:.1f})" for row in probe["rows"]
    ]
    return f"PSNR by {probe['quantity']}, mean (worst): " + "; ".join(cells)


def _chart(found: dict[str, Any], out: Path) -> None:
    from scenelang.files import write_whole

    try:
        from scenelang.lab.charts import stability_chart

        for kind in ("png", "svg"):
            write_whole(out / f"stability.{kind}", stability_chart([found], kind))
    except ImportError:
        click.echo("no chart: matplotlib is missing; pip install 'scenelang[charts]'", err=True)


def _report(name: str, done: int, count: int) -> None:
    end = "\n" if done == count else ""
    click.echo(f"\r{name}: {done}/{count}{end}", nl=False, err=True)
