"""What a dask cluster on this machine gives and costs: the same bytes, its overhead, what outlives it.

Scheduler and two workers are processes of their own, as on other machines; they listen on loopback.

    python -m lab bench cluster [MEASURE …] [--share S] [-o OUT.json]
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
from distributed import Client

from lab.about import about
from scenelang.animation.cluster import Cluster
from scenelang.animation.painting import Errand
from scenelang.animation.run import Progress
from scenelang.animation.store import put_frame
from scenelang.backend.options import RenderError, usable_cores
from scenelang.backend.small import draw_small
from scenelang.evaluate.evaluation import loads
from scenelang.program.compile import compile_scene
from scenelang.sweep.api import Sweep, render_many

SCENE = """\
canvas(640, 480);
param k = 0 in -0.8..0.8;
param turn = 0deg in 0deg..360deg;
chain {
  torus { twist(k); rotate(turn); material diffuse { color(#c8502f); } }
  smooth(k = 0.2) sphere { scale(0.45); material diffuse { color(#e8c060); } }
}
"""
SMALL = "canvas(8, 8); param k = 0.5 in 0..1; star { scale(0.9); rotate(90deg * k); }"
WORKERS = 2
Process = subprocess.Popen[bytes]


@contextlib.contextmanager
def cluster(folder: Path) -> Iterator[tuple[str, Process, list[Process]]]:
    """A scheduler and workers: its address and process, and those of the workers."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    # one message each, where dask keeps a thousand that were sent
    quiet: dict[str, Any] = {"env": {**os.environ, "DASK_DISTRIBUTED__ADMIN__LOW_LEVEL_LOG_LENGTH": "1"}}
    quiet |= {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0",
         "--no-dashboard", "--scheduler-file", str(file)], **quiet
    )  # fmt: skip
    while not file.exists() or not file.read_text():
        time.sleep(0.05)
    address = json.loads(file.read_text())["address"]
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--host"]
    command += ["127.0.0.1", "--no-dashboard", "--local-directory", str(folder)]
    workers = [subprocess.Popen(command, **quiet) for _ in range(WORKERS)]
    try:
        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(WORKERS)
        yield address, scheduler, workers
    finally:
        for process in [scheduler, *workers]:
            for child in [*psutil.Process(process.pid).children(recursive=True)]:
                with contextlib.suppress(psutil.Error):
                    child.kill()
            process.kill()
            process.wait()


def same(one: Sweep, two: Sweep) -> bool:
    """Whether all pictures have the same bytes."""
    pairs = zip(one.lines, two.lines, strict=True)
    folders = one.table.parent, two.table.parent
    return all(
        (folders[0] / a.picture).read_bytes() == (folders[1] / b.picture).read_bytes() for a, b in pairs
    )


def processor_s(process: psutil.Process) -> float:
    """Seconds of the processor that a process and those below it took so far."""
    times = [one.cpu_times() for one in (process, *process.children(recursive=True))]
    return sum(one.user + one.system for one in times)


class Killer:
    """Kills a process when a run is so far, and says how often it did."""

    def __init__(self, *shares: float) -> None:
        self.shares, self.kills = list(shares), 0

    def __call__(self, now: Progress) -> None:
        if self.shares and now.done >= self.shares[0] * now.total:
            self.shares.pop(0)
            mine = psutil.Process().children(recursive=True)
            found = [child for child in mine if "spawn_main" in " ".join(child.cmdline())]
            if found:
                found[0].send_signal(signal.SIGKILL)
                self.kills += 1


def compared(folder: Path, frames: int) -> dict[str, Any]:
    """One process, two workers, and two workers that are killed: seconds, and whether bytes are the same."""
    scene = folder / "scene.nsg"
    scene.write_text(SCENE)
    asked: dict[str, Any] = {"random": ["k", "turn"], "seed": 1}

    def timed(name: str, count: int = frames, **more: Any) -> tuple[dict[str, float], Sweep]:
        mine = psutil.Process()
        started, before = time.perf_counter(), processor_s(mine)
        made = render_many(scene, folder / name, **asked, count=count, **more)
        seconds = time.perf_counter() - started
        return {"seconds": seconds, "processor_s": processor_s(mine) - before}, made

    timed("once", count=2, jobs=1)  # loads what drawing needs
    alone_s, alone = timed("alone", jobs=1)
    with cluster(folder) as (address, *_):
        timed("warm", count=8, cluster=address)
        two_s, two = timed("two", cluster=address)
        killer = Killer(1 / 3, 2 / 3)
        killed_s, killed = timed("killed", cluster=address, progress=killer)
    return {
        "frames": frames,
        "canvas": [640, 480],
        "workers": WORKERS,
        "alone": alone_s,
        "two": two_s,
        "killed": killed_s,
        "kills": killer.kills,
        "two_same": same(alone, two),
        "killed_same": same(alone, killed),
    }


def gone(folder: Path, frames: int) -> dict[str, Any]:
    """A scheduler that is killed halfway: what was said, what was kept, and what the next run drew."""
    scene = folder / "scene.nsg"
    scene.write_text(SCENE)
    asked: dict[str, Any] = {"random": ["k", "turn"], "count": frames, "seed": 1}
    started = 0.0
    with cluster(folder) as (address, scheduler, _):

        def end(now: Progress) -> None:
            nonlocal started
            if now.done >= now.total / 2 and not started:
                scheduler.kill()
                started = time.perf_counter()

        said = ""
        try:
            render_many(scene, folder / "gone", **asked, cluster=address, progress=end)
        except RenderError as error:
            said = str(error).replace(address, "ADDRESS")
        told_s = time.perf_counter() - started
    with cluster(folder) as (address, *_):
        made = render_many(scene, folder / "gone", **asked, cluster=address)
    alone = render_many(scene, folder / "alone", **asked, jobs=1)
    return {
        "said": said,
        "told_s": told_s,
        "kept": made.made.resumed,
        "drawn": made.made.drawn,
        "same": same(alone, made),
    }


def many(folder: Path, frames: int) -> dict[str, Any]:
    """Small frames through a cluster: milliseconds of the processor for each, and memory on the way (MiB)."""
    programs = [compile_scene(loads(SMALL, k=at / 100)) for at in range(100)]
    put, few = folder / "frames", frames // 10
    put.mkdir()
    draw_small(programs[0])
    started = time.process_time()
    for at in range(few):
        put_frame({put / f"{at}.png": draw_small(programs[at % 100]).image.encode()})
    alone_ms = 1e3 * (time.process_time() - started) / few
    memory = []
    with cluster(folder) as (address, scheduler, workers):
        helper = Cluster(address)
        found = {"scheduler": psutil.Process(scheduler.pid)}
        found |= {f"worker {at}": psutil.Process(worker.pid) for at, worker in enumerate(workers)}
        mine = psutil.Process()
        for at in range(8 * WORKERS):  # loads what drawing needs
            helper.submit(programs[at], Errand(str(put / f"{at}.png"), None, 1, ()))
        while helper.waiting:
            helper.take()
        before = {name: processor_s(process) for name, process in found.items()}
        client_s, started = time.process_time(), time.perf_counter()
        for at in range(frames):
            helper.submit(programs[at % 100], Errand(str(put / f"{at}.png"), None, 1, ()))
            if at % few == few - 1:
                sizes = {"client": mine.memory_info().rss, "scheduler": found["scheduler"].memory_info().rss}
                memory.append({"frames": at + 1, **{name: size / 2**20 for name, size in sizes.items()}})
        while helper.waiting:
            helper.take()
        seconds = time.perf_counter() - started
        spent = {name: processor_s(process) - before[name] for name, process in found.items()}
        client_s = time.process_time() - client_s
        batches = helper.batches
        helper.close()
    return {
        "frames": frames,
        "canvas": [8, 8],
        "seconds": seconds,
        "batches": batches,
        "alone_ms": alone_ms,
        "client_ms": 1e3 * client_s / frames,
        "scheduler_ms": 1e3 * spent["scheduler"] / frames,
        "workers_ms": 1e3 * sum(s for name, s in spent.items() if "worker" in name) / frames,
        "memory_mib": memory,
        "files": len(list(put.glob("*.png"))),
    }


MEASURES = {"compared": (compared, 30), "gone": (gone, 16), "many": (many, 10_000)}


def main() -> None:
    """Measure, and write a record, or a part of one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("measure", nargs="*", choices=[*MEASURES, []])
    parser.add_argument("--share", type=float, default=1.0, help="of the frames")
    parser.add_argument("-o", "--out", type=Path)
    asked = parser.parse_args()
    out: Path | None = asked.out
    found = json.loads(out.read_text()) if out is not None and out.exists() else {}
    for name in asked.measure or MEASURES:
        measure, frames = MEASURES[name]
        with tempfile.TemporaryDirectory() as folder:
            made = measure(Path(folder), max(10, round(frames * asked.share)))
        load = {"cores": usable_cores(), "load": os.getloadavg()[0]}  # of others too
        found[name] = {**about(), **load, **made}
        print(json.dumps(found[name], indent=1), flush=True)
        if out is not None:
            out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
