"""``scenelang lab eval``: figures of a model on seeded unseen scenes, as JSON and pictures of the worst."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.cli.needs import need_metrics

if TYPE_CHECKING:
    from scenelang.models.load import Model

DEFAULT_SEED = 2021


@click.command("eval")
@click.argument("model")
@click.option(
    "--set", "sets", multiple=True, metavar="NAME", help="A set; may be repeated. Default: shapes2d."
)
@click.option("--all-sets", is_flag=True, help="Every set there is.")
@click.option("--scenes", default=1000, show_default=True, type=click.IntRange(1, 1_000_000))
@click.option("--seed", default=DEFAULT_SEED, show_default=True, type=click.IntRange(0, 2**31 - 1))
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("out"), show_default=True)
@click.option(
    "--weights", type=click.Path(path_type=Path, exists=True, dir_okay=False), help="Other weights."
)
@click.option("--threads", default=1, show_default=True, type=click.IntRange(1, 256))
def command(
    model: str,
    sets: tuple[str, ...],
    all_sets: bool,
    scenes: int,
    seed: int,
    out: Path,
    weights: Path | None,
    threads: int,
) -> None:
    """Draw random scenes with MODEL and compare them with the exact reference.

    Writes SET.json (PSNR, SSIM, FLIP: mean, 5th percentile from the bad end, worst; per boolean token) and
    SET-worst.png (network, reference, FLIP map of the worst cases) into the folder OUT.
    """
    from scenelang.measure.sets import SETS

    chosen = tuple(SETS) if all_sets else sets or ("shapes2d",)
    unknown = [name for name in chosen if name not in SETS]
    if unknown:
        raise click.UsageError(f"no set '{unknown[0]}'; the sets are {', '.join(SETS)}")
    need_metrics()
    import torch

    from scenelang.backend.neural import keep_memory
    from scenelang.files import write_whole
    from scenelang.lab.evaluate import evaluate_set, worst_sheet

    loaded = model_to_measure(model, weights)
    keep_memory()
    torch.set_num_threads(threads)
    out.mkdir(parents=True, exist_ok=True)
    for name in chosen:
        summary, cases = evaluate_set(
            loaded,
            name,
            scenes,
            seed,
            threads=threads,
            progress=_progress(name) if sys.stderr.isatty() else None,
        )
        write_whole(out / f"{name}.json", (json.dumps(summary, indent=2) + "\n").encode())
        write_whole(out / f"{name}-worst.png", worst_sheet(loaded, name, seed, cases).encode())
        p, s, f = summary["psnr"], summary["ssim"], summary["flip"]
        click.echo(
            f"{name}: PSNR {p['mean']:.2f} dB (p5 {p['p5']:.2f}, worst {p['worst']:.2f}), "
            f"SSIM {s['mean']:.4f}, FLIP {f['mean']:.4f} (p95 {f['p5']:.4f}) on {scenes} scenes"
        )


def model_to_measure(name: str, weights: Path | None) -> Model:
    """A shipped model, or one with other weights; what cannot be loaded ends the command."""
    from scenelang.backend.errors import RenderError
    from scenelang.models.load import ModelError, load_model

    try:
        return load_model(name, path=weights)
    except KeyError:
        raise click.UsageError(f"no model '{name}'") from None
    except ModelError as error:
        raise RenderError(str(error)) from None


def _progress(name: str) -> Callable[[int, int], None]:
    def show(done: int, count: int) -> None:
        if done % 10 == 0 or done == count:
            end = "\n" if done == count else ""
            click.echo(f"\r{name}: {done}/{count}{end}", nl=False, err=True)

    return show
