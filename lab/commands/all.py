"""``python -m lab all``: every measurement of the documentation, one after the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lab.commands import common
from scenelang.cli import options


@click.command("all")
@common.out
@click.option(
    "--budget",
    default=0.01,
    show_default=True,
    type=options.Real(0, min_open=True),
    metavar="MINUTES",
    help="Processor time of each training.",
)
@click.option(
    "--scenes",
    default=2,
    show_default=True,
    type=click.IntRange(1, 10_000),
    help="Scenes of an evaluation; what draws many for each value takes a twentieth, but at least 1.",
)
def command(out: Path, budget: float, scenes: int) -> None:
    """Measure everything that the documentation reports, from scratch.

    As it is, a run of some minutes that shows that all of it runs; --budget and --scenes make it the real
    thing. Everything is written into FOLDER, what was run and for how long into all.json. Goes on behind a
    command that fails, and exits with 1 in the end.
    """
    import time

    from lab.about import about
    from lab.everything import run_everything
    from scenelang.cli.say import need_metrics

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
        common.write_json(out / "all.json", record)

    failed = [step["command"] for step in run_everything(out, budget, scenes, done) if step.get("exit")]
    for line in failed:
        click.echo(f"failed: {line}", err=True)
    raise SystemExit(bool(failed))
