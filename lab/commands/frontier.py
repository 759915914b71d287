"""``python -m lab frontier``: speed against error of every way to draw a set's scenes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lab.commands import common
from scenelang.cli.progress import Bar
from scenelang.cli.say import need_metrics
from scenelang.files import read_regular, write_whole

if TYPE_CHECKING:
    from scenelang.measure.frontier import Frontier

VERIFY_SEED = 4042


@click.command("frontier")
@click.argument("model")
@common.out
@click.option(
    "--scenes",
    default=80,
    show_default=True,
    type=click.IntRange(1, 100_000),
    metavar="N",
    help="Number of scenes.",
)
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    help=f"Seed of the scenes.  [default: {common.DEFAULT_SEED}; {VERIFY_SEED} to verify]",
)
@common.threads
@common.kept
@click.option("--verify", is_flag=True, help="Check that promised errors hold on other scenes.")
@click.option(
    "--promises",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="FILE",
    help="Verify this frontier.json instead of the shipped one.",
)
@click.pass_context
def command(
    ctx: click.Context,
    model: str,
    out: Path,
    scenes: int,
    seed: int | None,
    threads: int,
    kept: Path | None,
    verify: bool,
    promises: Path | None,
) -> None:
    """Measure time and error of every way to draw the scenes of MODEL's set, side by side, in one run.

    That is all shipped models of the set, with and without skipping and with other samplings, the exact
    field in the network's place with all that the renderer skips, the exact reference, and the time of the
    paper's streaming renderer at full size. Writes frontier.json, frontier.png and frontier.html, which needs
    no other file, into FOLDER.

    With --verify draws other scenes and counts in how many the promised errors of the shipped frontier are
    kept, writes verified.json, and exits with 1 if that is under 95 %.
    """
    from scenelang.models.manifest import available, load_manifest

    if promises is not None and not verify:
        raise click.UsageError("--promises goes with --verify.")
    common.check_names("model", [model], available())
    base = load_manifest(model).set
    common.check_names("model named like the set", [base], available())
    need_metrics()
    out.mkdir(parents=True, exist_ok=True)
    if verify:
        ctx.exit(0 if _verify(base, out, scenes, seed, promises, kept) else 1)
    else:
        _measure(base, out, scenes, common.DEFAULT_SEED if seed is None else seed, threads, kept)


def _measure(base: str, out: Path, scenes: int, seed: int, threads: int, kept: Path | None) -> None:
    from lab.frontier.chart import frontier_chart
    from lab.frontier.measure import measure_frontier
    from lab.frontier.page import frontier_page
    from scenelang.measure.frontier import NAME

    with Bar() as bar:
        frontier, pictures, exact = measure_frontier(base, scenes, seed, threads, bar, kept)
    write_whole(out / NAME, frontier.to_json().encode())
    write_whole(out / "frontier.html", frontier_page(frontier, pictures, exact).encode())
    common.write_chart(out / "frontier.png", lambda: frontier_chart(frontier))
    click.echo(_table(frontier))


def _table(frontier: Frontier) -> str:
    """All points, the fastest first."""
    from scenelang.measure.frontier import between

    lines = [f"{'':2}{'way to draw':44}{'ms':>9}{'FLIP':>9}{'promise':>9}{'PSNR':>7}{'scenes':>8}"]
    for p in frontier.points:
        errors = " " * 25
        if p.flip is not None and p.psnr is not None:
            errors = f"{p.flip.mean:9.5f}{p.flip.bound:9.5f}{p.psnr.mean:7.2f}"
        lines.append(f"{'* ' if p.on_front else '  '}{p.title:44}{p.ms.median:9.2f}{errors}{p.scenes:8}")
    count = between(frontier.points)
    return "\n".join([*lines, f"* on the front. {count} points lie between the fastest and the nearest."])


def _verify(
    base: str, out: Path, scenes: int, seed: int | None, promises: Path | None, kept: Path | None
) -> bool:
    from lab.frontier.verify import KEPT, verify
    from scenelang.measure.frontier import MOST_BYTES, Frontier, frontier_path

    path = promises or frontier_path(base)
    try:
        frontier = Frontier.from_json(read_regular(path, MOST_BYTES))
    except FileNotFoundError:
        raise click.UsageError(f"`{base}` ships no frontier; measure one and give --promises") from None
    except ValueError as error:
        raise click.UsageError(f"`{path}` is not a frontier: {error}") from None
    try:
        with Bar() as bar:
            found = verify(frontier, base, scenes, VERIFY_SEED if seed is None else seed, bar, kept)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    common.write_json(out / "verified.json", found)
    for case, rows in found["cases"].items():
        click.echo(case)
        for name, row in rows.items():
            share = f"{100 * row['kept']:5.1f} % of {row['scenes']}"
            click.echo(f"  {name:40} kept in {share}, at worst {row['worst']:.2f} of the promise")
    least = f"every promise is kept in at least {100 * KEPT:.0f} % of the scenes"
    click.echo(least if found["held"] else f"not {least}")
    return bool(found["held"])
