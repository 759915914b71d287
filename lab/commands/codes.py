"""``python -m lab codes``: how many numbers a texture or a mesh needs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lab.commands import common
from scenelang.cli import options
from scenelang.cli.say import need_metrics

SECONDS = {"textures": 30.0, "meshes": 20.0}


@click.command("codes")
@click.argument("what", type=click.Choice(list(SECONDS)))
@click.option(
    "--scenes",
    default=200,
    show_default=True,
    type=click.IntRange(1, 10_000),
    metavar="N",
    help="Number of scenes.",
)
@click.option(
    "--seconds",
    type=options.Real(0, min_open=True),
    help="Processor time of training a decoder; by default 30 of textures, 20 of meshes.",
)
@click.option(
    "--sizes", metavar="D,D,…", help="Numbers of codes and forms; by default 1 to 64, and forms on to 65536."
)
@click.option(
    "--side",
    type=click.IntRange(16, 8192),
    metavar="PIXELS",
    help="Shorter side of the canvas; by default as the set says.",
)
@click.option("--kept", type=click.Path(path_type=Path, file_okay=False), help="Folder of exact pictures.")
@options.originals
@common.seed
@common.out
def command(
    what: str,
    scenes: int,
    seconds: float | None,
    sizes: str | None,
    side: int | None,
    kept: Path | None,
    seed: int,
    out: Path,
) -> None:
    """Give WHAT by d numbers each, draw random scenes with that, and compare them with exact pictures.

    Writes codes-WHAT.json and codes-WHAT.png (scenes at every size) into FOLDER, and what was trained and
    measured into FOLDER/codes, from where a study that was stopped goes on.
    """
    need_metrics()
    import torch

    from lab.codes.study import BEYOND, SIZES, study
    from lab.codes.world import world

    torch.set_num_threads(1)
    folder = out / "codes"
    asked = (
        {"sizes": tuple(map(int, sizes.split(","))), "beyond": ()}
        if sizes
        else {"sizes": SIZES, "beyond": BEYOND}
    )
    record, strip = study(
        world(what, folder),
        scenes,
        seed,
        seconds or SECONDS[what],
        folder,
        side=side,
        kept=kept,
        report=_report,
        **asked,
    )
    common.write_json(out / f"codes-{what}.json", record)
    strip.save(out / f"codes-{what}.png")


def _report(row: dict[str, Any]) -> None:
    p, f = row["psnr"], row["flip"]
    what = f"{row['kind']}, {row['d']:,} numbers" + (f", seed {row['seed']}" if "seed" in row else "")
    click.echo(f"{what}: PSNR {p['mean']:.2f} dB ± {p['interval']:.2f}, FLIP {f['mean']:.4f}")
