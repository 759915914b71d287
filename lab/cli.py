"""``python -m lab COMMAND``: what measures models, compares them and trains them."""

from __future__ import annotations

import json
import math
import runpy
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from lab import ROOT
from lab.about import about, write_json
from scenelang.assets.files import read_regular, write_whole
from scenelang.cli import options
from scenelang.cli.main import Reporting
from scenelang.cli.say import Bar, need_metrics

if TYPE_CHECKING:
    from lab.frontier.record import Frontier
    from lab.training.config import SolidsConfig
    from scenelang.drawing.neural.load import Model

SEED, VERIFY_SEED = 2021, 4042  # of measurements; of scenes that promises are verified on
_FOLDER: Final = click.Path(path_type=Path, file_okay=False)
_FILE: Final = click.Path(path_type=Path, exists=True, dir_okay=False)

_out = click.option(
    "-o",
    "--out",
    type=_FOLDER,
    default=Path("out"),
    show_default=True,
    metavar="FOLDER",
    help="Folder to write to.",
)
_weights = click.option("--weights", type=_FILE, help="Weights instead of the shipped ones.")
_kept = click.option(
    "--kept",
    type=_FOLDER,
    metavar="FOLDER",
    help="Folder of exact pictures; those that are missing are drawn and kept there.",
)


def _count(name: str, default: int | None, low: int, high: int, help: str) -> Callable[..., Any]:
    """An option that takes a whole number in a range."""
    return click.option(
        name,
        default=default,
        show_default=default is not None,
        type=click.IntRange(low, high),
        metavar="N",
        help=help,
    )


_seed = _count("--seed", SEED, 0, 2**31 - 1, "Seed of what is random.")
_threads = _count("--threads", 1, 1, 256, "Number of threads on the CPU.")


def _check_names(what: str, wanted: Iterable[str], known: Iterable[str]) -> None:
    """Raise `click.UsageError` for names that are not known."""
    known = list(known)
    for name in wanted:
        if name not in known:
            raise click.UsageError(f"no {what} `{name}`; there are {', '.join(known)}")


def _write_chart(path: Path, draw: Callable[[], bytes]) -> None:
    """Write a chart; says what is missing where none can be drawn."""
    try:
        write_whole(path, draw())
    except ImportError:
        click.echo("no chart: matplotlib is missing; pip install 'scenelang[charts]'", err=True)


def _model_to_measure(name: str, weights: Path | None) -> Model:
    """A shipped model, or one with other weights, on one thread."""
    import torch

    from scenelang.compiler.manifest import available
    from scenelang.drawing.neural.load import load_model

    torch.set_num_threads(1)
    _check_names("model", [name], available())
    if weights is not None and name in ("shapes2d-streaming", "shapes2d-reading"):
        from lab.designs.long import trained_model

        return trained_model(weights)
    return load_model(name, path=weights)


@click.group("lab", cls=Reporting, context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Measure models, compare designs and train: what the figures in the documentation come from."""


# ---------------------------------------------------------------- measurements


@command.command("eval")
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
@_count("--scenes", 1000, 1, 1_000_000, "Number of scenes.")
@_count("--side", None, 1, 8192, "Shorter side of the canvas in pixels; by default as the set says.")
@_kept
@options.originals
@_seed
@_out
@_weights
@_threads
def evaluate(
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
) -> None:
    """Draw random scenes with MODEL and compare them with the exact reference.

    Writes SET.json (PSNR, SSIM, FLIP: mean, 5th percentile from the bad end, worst; per boolean token) and
    SET-worst.png (network, reference, FLIP map of the worst cases) into FOLDER.
    """
    need_metrics()
    import torch

    from lab.evaluate import evaluate_set, sheet
    from lab.sets.scenes import sets_of
    from scenelang.assets.element_file import SUFFIX
    from scenelang.drawing.how import keep_memory

    loaded = _model_to_measure(model, weights)
    known = sets_of(loaded.manifest)
    chosen = tuple(known) if all_sets else sets or (loaded.manifest.set,)
    _check_names("set", [name for name in chosen if not name.endswith(SUFFIX)], known)
    keep_memory()
    torch.set_num_threads(threads)
    for name in chosen:
        with Bar() as bar:
            summary, worst = evaluate_set(
                loaded, name, scenes, seed, side=side, kept=kept, threads=threads, report=bar
            )
        stem = Path(name).stem
        write_json(out / f"{stem}.json", summary)
        sheet(loaded, name, seed, worst, side, kept).save(out / f"{stem}-worst.png")
        p, s, f = summary["psnr"], summary["ssim"], summary["flip"]
        click.echo(
            f"{name}: PSNR {p['mean']:.2f} dB (p5 {p['p5']:.2f}, worst {p['worst']:.2f}), "
            f"SSIM {s['mean']:.4f}, FLIP {f['mean']:.4f} (p95 {f['p5']:.4f}) on {scenes} scenes"
        )


@command.command()
@click.argument("model")
@click.option(
    "--only", multiple=True, metavar="NAME", help="Probe to measure; may be repeated. By default all."
)
@_count("--scenes", 20, 1, 10_000, "Scenes of each value.")
@click.option(
    "--known",
    multiple=True,
    type=_FILE,
    help="Record of this command to add to, not measured again; may be repeated.",
)
@_seed
@_out
@_weights
def stability(
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
    from lab.charts import stability_chart
    from lab.stability import INVARIANTS, kit_of, run_stability

    loaded = _model_to_measure(model, weights)
    _check_names("probe", only, [*kit_of(loaded.manifest).probes, *INVARIANTS])
    earlier = [json.loads(path.read_text("utf-8")) for path in known]
    try:
        with Bar() as bar:
            result = run_stability(loaded, scenes, seed, only, bar, earlier)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    write_json(out / "stability.json", result)
    for name, probe in result["probes"].items():
        figures = [(row["value"], row["psnr"]["mean"], row["psnr"]["worst"]) for row in probe["rows"]]
        cells = "; ".join(f"{value:g} {mean:.1f} ({worst:.1f})" for value, mean, worst in figures)
        click.echo(f"{name}: PSNR by {probe['quantity']}, mean (worst): {cells}")
    for name, figures in result["invariants"].items():
        click.echo(f"{name}: " + ", ".join(f"{k} {v:g}" for k, v in figures.items()))
    if result["probes"]:
        _write_chart(out / "stability.png", lambda: stability_chart([result]))


@command.command()
@click.argument("model", default="solids3d")
@_count("--scenes", 100, 1, 10_000, "Number of scenes.")
@_count("--side", 128, 16, 1024, "Shorter side of the canvas in pixels.")
@_seed
@_out
@_weights
def shadows(model: str, scenes: int, side: int, seed: int, out: Path, weights: Path | None) -> None:
    """Draw media that throw their shadows on solids, and measure inside the shadows.

    Writes shadows.json and shadows.png (network, exact picture, FLIP map) into FOLDER.
    """
    need_metrics()
    from lab.shadows import measure_shadows

    loaded = _model_to_measure(model, weights)
    if loaded.manifest.dimension != 3:
        raise click.UsageError(f"model `{model}` draws no media")
    with Bar() as bar:
        summary, sheet = measure_shadows(loaded, scenes, seed, side, report=bar)
    write_json(out / "shadows.json", summary)
    sheet.save(out / "shadows.png")
    inside, wrong = summary["psnr"], summary["wrong_percent"]
    click.echo(
        f"inside shadows: PSNR {inside['mean']:.2f} dB ± {inside['interval']:.2f} "
        f"(worst {inside['worst']:.2f}), {wrong['mean']:.2f} % of the shadow is wrong "
        f"(worst {wrong['worst']:.2f}) on {scenes} scenes"
    )


@command.command()
@click.argument("model")
@_count("--scenes", 50, 1, 10_000, "Number of scenes.")
@click.option(
    "--params",
    "counts",
    multiple=True,
    default=(1, 2, 3),
    show_default=True,
    type=click.IntRange(1, 24),
    help="Params of a scene; may be repeated: scenes have so many in turn.",
)
@_count("--side", 256, 32, 1024, "Side of targets in pixels.")
@click.option("--name", default="fit", show_default=True, help="Name of the record.")
@_seed
@_out
def fit(model: str, scenes: int, counts: tuple[int, ...], side: int, name: str, seed: int, out: Path) -> None:
    """Fit seeded scenes to exact pictures of values that only these know.

    Numbers of random scenes become params with their full ranges. A start's picture is under 25 dB from the
    target, and each param is felt: 42 dB and less where it alone is at its start. Found is what is within 1 %
    of every range, or a picture at 45 dB.
    """
    from lab.fits import measure

    _model_to_measure(model, None)
    with Bar() as bar:
        result = measure(model, counts, scenes, seed, side, bar)
    write_json(out / f"{name}.json", result)
    click.echo(
        f"{model}: {result['found']} of {scenes} found ({result['share']:.0%} ± {result['interval']:.0%}), "
        f"median {result['median_seconds']} s and {result['median_frames']} pictures"
    )


# ---------------------------------------------------------------- error against time


@command.command()
@click.argument("model")
@_out
@_count("--scenes", 80, 1, 100_000, "Number of scenes.")
@_count("--seed", None, 0, 2**31 - 1, f"Seed of the scenes; by default {SEED}, and {VERIFY_SEED} to verify.")
@_threads
@_kept
@click.option("--verify", is_flag=True, help="Check that promised errors hold on other scenes.")
@click.option(
    "--promises",
    type=_FILE,
    metavar="FILE",
    help="Verify this frontier.json instead of the shipped one.",
)
@click.pass_context
def frontier(
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

    That is all shipped models of the set, also with other samplings, the exact field by formulas in the
    network's place, in the same kernel, the exact reference, and the time of the
    paper's streaming renderer at full size. Writes frontier.json, frontier.png and frontier.html, which needs
    no other file, into FOLDER.

    With --verify draws other scenes and counts in how many the promised errors of the shipped frontier are
    kept, writes verified.json, and exits with 1 if that is under 95 %.
    """
    from scenelang.compiler.manifest import available, load_manifest

    if promises is not None and not verify:
        raise click.UsageError("--promises goes with --verify.")
    _check_names("model", [model], available())
    base = load_manifest(model).set
    _check_names("model named like the set", [base], available())
    need_metrics()
    out.mkdir(parents=True, exist_ok=True)
    if verify:
        ctx.exit(0 if _verify(base, out, scenes, seed, promises, kept) else 1)
    else:
        _measure(base, out, scenes, SEED if seed is None else seed, threads, kept)


def _measure(base: str, out: Path, scenes: int, seed: int, threads: int, kept: Path | None) -> None:
    from lab.frontier.chart import frontier_chart
    from lab.frontier.measure import measure_frontier
    from lab.frontier.page import frontier_page
    from scenelang.output.frontier import NAME

    with Bar() as bar:
        frontier, pictures, exact = measure_frontier(base, scenes, seed, threads, bar, kept)
    write_whole(out / NAME, frontier.to_json().encode())
    write_whole(out / "frontier.html", frontier_page(frontier, pictures, exact).encode())
    _write_chart(out / "frontier.png", lambda: frontier_chart(frontier))
    click.echo(_table(frontier))


def _table(frontier: Frontier) -> str:
    """All points, the fastest first."""
    from lab.frontier.record import between

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
    from lab.frontier.record import Frontier
    from lab.frontier.verify import KEPT, verify
    from scenelang.output.frontier import MOST_BYTES, frontier_path

    path = promises or frontier_path(base)
    try:
        frontier = Frontier.from_json(read_regular(path, MOST_BYTES))
    except FileNotFoundError:
        raise click.UsageError(f"`{base}` ships no frontier; measure one and give --promises") from None
    except ValueError as error:
        raise click.UsageError(f"`{path}` is not a frontier: {error}") from None
    try:
        with Bar() as bar:
            result = verify(frontier, base, scenes, VERIFY_SEED if seed is None else seed, bar, kept)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    write_json(out / "verified.json", result)
    for case, rows in result["cases"].items():
        click.echo(case)
        for name, row in rows.items():
            share = f"{100 * row['kept']:5.1f} % of {row['scenes']}"
            click.echo(f"  {name:40} kept in {share}, at worst {row['worst']:.2f} of the promise")
    least = f"every promise is kept in at least {100 * KEPT:.0f} % of the scenes"
    click.echo(least if result["held"] else f"not {least}")
    return bool(result["held"])


# ---------------------------------------------------------------- trainings


@command.command()
@click.argument("config")
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Folder for the checkpoint, the log and at the end the weights.",
)
@click.option(
    "--budget",
    "budget_s",
    type=options.Real(0, min_open=True),
    callback=lambda ctx, param, minutes: math.inf if minutes is None else 60 * minutes,
    metavar="MINUTES",
    help="Stop after this time, with a checkpoint; of long trainings processor time.",
)
@click.option(
    "--begin",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="WEIGHTS",
    help="Weights that a long training begins from; their time and curve go on.",
)
@options.field("device")
@options.field("threads")
@click.option(
    "--every",
    type=click.IntRange(1),
    metavar="N",
    default=500,
    show_default=True,
    help="Steps between reports.",
)
@click.option(
    "--save-every",
    type=options.Real(0),
    default=60.0,
    show_default=True,
    metavar="SECONDS",
    help="Longest time between checkpoints; the first comes after the first step.",
)
def train(
    config: str,
    out: Path,
    budget_s: float,
    begin: Path | None,
    device: str,
    threads: int | None,
    every: int,
    save_every: float,
) -> None:
    """Train, or go on where the checkpoint in FOLDER was saved.

    CONFIG is a JSON file or the name of a shipped configuration, such as shapes2d. By default one thread
    computes, as for the shipped weights. Exits with 0 also when the budget ends first; a long training writes
    weights then too.
    """
    from lab.training.config import config_data, is_solids, read_solids_config

    with _reporting_mistakes(config, out):
        data = config_data(config)
        long = b'"long"' in data
        if begin is not None and not long:
            raise click.UsageError("--begin is for long trainings; others begin from nothing")
        place = _prepare_torch("cpu" if long else device, threads)
        if long:
            _long(config, out, begin, budget_s, every, save_every)
        elif is_solids(data):
            _solids(read_solids_config(config), out, budget_s, place)
        else:
            _shapes(config, out, budget_s, place, every, save_every)


def _shapes(config: str, out: Path, budget_s: float, device: str, every: int, save_every: float) -> None:
    from lab.sets.scenes import record_measured
    from lab.training.config import read_config
    from lab.training.loop import train

    wanted = read_config(config)
    weights = out / "weights.safetensors"
    with Bar() as bar:
        notes = _Notes(bar, wanted.model, device, out)
        finished = train(
            wanted,
            out,
            budget_s=budget_s,
            device=device,
            report=notes,
            save_every_s=save_every,
            report_every=every,
        )
    if not finished:
        click.echo(f"out of time{notes.reached}: the same command goes on from the checkpoint in {out}")
        return
    figures = record_measured(weights, wanted.cell or wanted.model)
    means = ", ".join(f"{k[5:]} {v['mean']:.1f}" for k, v in figures.items() if k.startswith("psnr_"))
    click.echo(f"done{notes.reached}; PSNR of unseen scenes (dB): {means}: {weights}")


def _solids(config: SolidsConfig, out: Path, budget_s: float, device: str) -> None:
    from lab.training.solids import train_solids

    with Bar() as bar:
        notes = _Notes(bar, config.model, device, out)
        finished = train_solids(config, out, budget_s=budget_s, report=notes)
    if finished:
        click.echo(f"done{notes.reached}: {out / 'weights.safetensors'}")
    else:
        click.echo(f"out of time{notes.reached}: the same command goes on from the checkpoint in {out}")


class _Notes:
    """Progress of a training by steps: a bar on terminals, else lines."""

    def __init__(self, bar: Bar, model: str, device: str, out: Path) -> None:
        self.bar, self.model, self.device, self.out = bar, model, device, out
        self.reached = ""  # ", mean loss …" of the last report

    def __call__(self, done: int, total: int, seconds: float, losses: dict[str, float]) -> None:
        """Report steps done of all, seconds spent and mean losses, of which there are none at the start."""
        if not losses:
            _say_begin(self.model, f"step {done:,} of {total:,}", done, self.device, self.out)
            return
        told = ", ".join(f"{name} {value:.4g}" for name, value in losses.items())
        self.reached = f", mean loss {told}"
        if sys.stderr.isatty():
            self.bar(told, done, total)
        else:
            click.echo(f"{done:,} of {total:,} steps, {seconds:.0f} s, {told}", err=True)


def _long(
    config: str,
    out: Path,
    begin: Path | None,
    budget_s: float,
    every: int,
    save_every: float,
) -> None:
    from lab.designs.long import LongTraining, export_long, read_long

    file = read_long(config)
    run = LongTraining(file.long, out, begin)
    reached = f"step {run.step:,} of {run.steps:,}, {run.seconds / 3600:.2f} core-hours"
    _say_begin(file.model, reached, run.step, "cpu", out)
    weights = out / "weights.safetensors"
    total, known = 0.0, len(run.curve)
    for done, loss in enumerate(run.run(budget_s, save_every), 1):
        total += loss
        if done % every == 0:
            click.echo(
                f"{run.step:,} of {run.steps:,} steps, {run.seconds:.0f} s, mean loss {total / every:.4g}",
                err=True,
            )
            total = 0.0
        if len(run.curve) > known:
            known = len(run.curve)
            point = run.curve[-1]
            click.echo(
                f"{point.seconds / 3600:.3f} core-hours, {point.side} x {point.side}: {point.psnr:.2f} dB",
                err=True,
            )
            export_long(run, file.model, weights)
    export_long(run, file.model, weights)
    if run.step < run.steps:
        click.echo(f"out of time: the same command goes on from the checkpoint in {out}; so far: {weights}")
    else:
        click.echo(f"done: {weights}")


@contextmanager
def _reporting_mistakes(config: str, out: Path) -> Iterator[None]:
    """Report mistakes in a configuration or a checkpoint, and how an interrupted training goes on."""
    from pydantic import ValidationError

    try:
        yield
    except ValidationError as error:
        mistake = error.errors(include_url=False)[0]
        where = "".join(f"{part}." for part in mistake["loc"])[:-1]
        told = f"{where}: {mistake['msg']}" if where else mistake["msg"]
        raise click.UsageError(f"bad configuration `{config}`: {told}") from None
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    except KeyboardInterrupt:
        click.echo(f"interrupted; the same command goes on from the checkpoint in {out}", err=True)
        raise


def _prepare_torch(device: str, threads: int | None) -> str:
    """Set torch up for a long computation; returns the device."""
    import torch

    from scenelang.drawing.how import keep_memory
    from scenelang.drawing.torch_backend import choose_device

    keep_memory()
    torch.set_num_threads(threads or 1)
    torch.set_flush_denormal(True)  # gradients of 1e-39 took seven eighths of the ConvLSTM's time
    return choose_device(device)


def _say_begin(model: str, reached: str, done: int, device: str, out: Path) -> None:
    """Say whether a training starts or goes on."""
    what = "going on with" if done else "starting"
    click.echo(f"{what} the training of {model} at {reached}, on {device}, in {out}", err=True)


# ---------------------------------------------------------------- all of it, benchmarks, scripts


@command.command()
@click.argument("families", nargs=-1)
@_count("--scenes", 40, 1, 10_000, "Number of scenes of a family.")
@_count("--first", 0, 0, 10_000, "Index of the first.")
@_count("--size", 128, 16, 1024, "Side of pictures in pixels.")
@_count("--paths", 1024, 8, 1 << 20, "Most paths of a pixel; fewer where the noise is below 52 dB.")
@click.option("--cache", type=_FOLDER, metavar="FOLDER", help="Folder of traced pictures.")
@click.option("--points", is_flag=True, help="Trace with points of all surfaces that send light.")
@click.option("--trace", is_flag=True, help="Trace what the folder lacks, and draw nothing.")
@_threads
@_seed
@_out
def light(
    families: tuple[str, ...],
    scenes: int,
    first: int,
    size: int,
    paths: int,
    cache: Path | None,
    points: bool,
    trace: bool,
    threads: int,
    seed: int,
    out: Path,
) -> None:
    """Draw scenes lit by a sky, and compare with path tracing; by default all FAMILIES.

    Writes light-FAMILY.json and a picture of the three worst: traced, drawn, and four times the difference.
    """
    need_metrics()
    import numpy as np
    from PIL import Image

    from lab.light.families import FAMILIES
    from lab.light.measure import measure
    from lab.light.probes import PROBES

    _check_names("family", families, {**FAMILIES, **PROBES})
    for family in families or FAMILIES:
        how: dict[str, Any] = {"threads": threads, "cache": cache, "first": first, "drawn": not trace}
        how["points"] = points
        result, worst = measure(
            family, scenes, size, paths, seed, say=lambda s: click.echo(s, err=True), **how
        )
        if trace:
            continue
        write_json(out / f"light-{family}.json", about() | result)
        pixels = (255 * np.concatenate(worst) + 0.5).astype(np.uint8)
        Image.fromarray(pixels).save(out / f"light-{family}.png")
        click.echo(
            f"{family:8} PSNR {result['mean_psnr']:.2f} dB, 5th percentile {result['psnr_5']:.2f}, "
            f"FLIP {result['mean_flip']:.4f}, {result['mean_seconds']:.2f} s; "
            f"traced to {result['own']:.1f} dB, without that noise {result['mean_clean']:.2f} and "
            f"{result['clean_5']:.2f} dB"
        )


@command.command("all")
@_out
@click.option(
    "--budget",
    default=0.01,
    show_default=True,
    type=options.Real(0, min_open=True),
    metavar="MINUTES",
    help="Processor time of each training.",
)
@_count(
    "--scenes",
    2,
    1,
    10_000,
    "Scenes of an evaluation; what draws many for each value takes a twentieth, but at least 1.",
)
def everything(out: Path, budget: float, scenes: int) -> None:
    """Measure everything that the documentation reports, from scratch.

    As it is, a run of some minutes that shows that all of it runs; --budget and --scenes make it the real
    thing. Everything is written into FOLDER, what was run and for how long into all.json. Goes on behind a
    command that fails, and exits with 1 in the end.
    """
    from lab.everything import run_everything

    need_metrics()
    started = time.perf_counter()

    def done(steps: list[dict[str, Any]]) -> None:
        last = steps[-1]
        told = (
            f"left out, needs {', '.join(last['needs'])}" if "needs" in last else f"{last['seconds']:.0f} s"
        )
        click.echo(f"-- {last['command']}: {told}{', failed' if last.get('exit') else ''}", err=True)
        seconds = round(time.perf_counter() - started, 1)
        record: dict[str, Any] = {**about(), "budget": budget, "scenes": scenes, "seconds": seconds}
        record["processor_s"] = round(sum(step.get("processor_s", 0.0) for step in steps), 1)
        record["steps"] = steps
        write_json(out / "all.json", record)

    failed = [step["command"] for step in run_everything(out, budget, scenes, done) if step.get("exit")]
    for line in failed:
        click.echo(f"failed: {line}", err=True)
    raise SystemExit(bool(failed))


def _scripts(name: str, prefix: str, words: str) -> None:
    """A command that runs a module of a folder (``prefix`` and a name), which reads the rest of the line."""
    files = (ROOT / "lab" / name).glob(f"{prefix}*.py")
    known = sorted(path.stem.removeprefix(prefix) for path in files if path.stem != "__init__")

    @command.command(
        name,
        help=f"{words}: SCRIPT is one of {', '.join(known)}.",
        context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False},
    )
    @click.argument("script", type=click.Choice(known), metavar="SCRIPT")
    @click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
    def run(script: str, arguments: tuple[str, ...]) -> None:
        sys.argv = [f"python -m lab {name} {script}", *arguments]
        runpy.run_module(f"lab.{name}.{prefix}{script}", run_name="__main__")


_scripts("bench", "", "Run a benchmark")
_scripts("docs", "make_", "Write tables, pictures and files of the repository anew")
