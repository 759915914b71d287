"""``python -m lab eval``: figures of a model on seeded unseen scenes, as JSON and pictures of the worst."""

from __future__ import annotations

from pathlib import Path

import click

from lab.commands import common
from scenelang.cli import options
from scenelang.cli.progress import Bar
from scenelang.cli.say import need_metrics


@click.command("eval")
@click.argument("model")
@click.option(
    "--set",
    "sets",
    multiple=True,
    metavar="NAME",
    help="Set to draw, or a file of elements, whose solids take the place of those of meshes3d; "
    "may be repeated. By default MODEL's own.",
)
@click.option("--all-sets", is_flag=True, help="Draw every set there is.")
@click.option(
    "--scenes",
    default=1000,
    show_default=True,
    type=click.IntRange(1, 1_000_000),
    metavar="N",
    help="Number of scenes.",
)
@click.option(
    "--side",
    type=click.IntRange(1, 8192),
    metavar="PIXELS",
    help="Shorter side of the canvas; by default as the set says.",
)
@common.kept
@options.originals
@common.seed
@common.out
@common.weights
@common.threads
@options.cluster
def command(
    model: str,
    sets: tuple[str, ...],
    all_sets: bool,
    scenes: int,
    side: int | None,
    kept: Path | None,
    seed: int,
    out: Path,
    weights: Path | None,
    threads: int,
    cluster: str | None,
) -> None:
    """Draw random scenes with MODEL and compare them with the exact reference.

    Writes SET.json (PSNR, SSIM, FLIP: mean, 5th percentile from the bad end, worst; per boolean token) and
    SET-worst.png (network, reference, FLIP map of the worst cases) into FOLDER.
    """
    need_metrics()
    if cluster is not None and (weights is not None or kept is not None or threads != 1):
        raise click.UsageError("--cluster is for shipped weights, one thread each, without --kept.")
    import torch

    from lab.evaluate import evaluate_set, sheet
    from lab.sets.scenes import sets_of
    from scenelang.backend.options import keep_memory
    from scenelang.elements.zoo import SUFFIX

    loaded = common.model_to_measure(model, weights)
    known = sets_of(loaded.manifest)
    chosen = tuple(known) if all_sets else sets or (loaded.manifest.set,)
    common.check_names("set", [name for name in chosen if not name.endswith(SUFFIX)], known)
    keep_memory()
    torch.set_num_threads(threads)
    for name in chosen:
        with Bar() as bar:
            summary, worst = evaluate_set(
                loaded, name, scenes, seed, side=side, kept=kept, threads=threads, cluster=cluster, report=bar
            )
        stem = Path(name).stem
        common.write_json(out / f"{stem}.json", summary)
        sheet(loaded, name, seed, worst, side, kept).save(out / f"{stem}-worst.png")
        p, s, f = summary["psnr"], summary["ssim"], summary["flip"]
        click.echo(
            f"{name}: PSNR {p['mean']:.2f} dB (p5 {p['p5']:.2f}, worst {p['worst']:.2f}), "
            f"SSIM {s['mean']:.4f}, FLIP {f['mean']:.4f} (p95 {f['p5']:.4f}) on {scenes} scenes"
        )
