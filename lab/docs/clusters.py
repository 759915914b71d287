"""The figures of clusters in docs/measurements.md: what drawing on a cluster gives and costs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lab import RESULTS
from lab.docs.figures import read
from lab.docs.tables import markdown


def cluster() -> str:
    """A table of runs and a paragraph for what else was measured, with the commands."""
    if not (RESULTS / "cluster.json").exists():
        return "*Not measured yet.*"
    result = read("cluster")
    parts = {"compared": _compared, "many": _many, "gone": _gone}
    told = (part(result[name]) + _made(result[name]) for name, part in parts.items() if name in result)
    return "\n\n".join(told)


def _compared(found: dict[str, Any]) -> str:
    words = {
        "alone": "one process, no cluster",
        "two": f"{found['workers']} workers",
        "killed": f"{found['workers']} workers, of which {found['kills']} were killed on the way",
    }
    rows = []
    for name, what in words.items():
        alike = "" if name == "alone" else "yes" if found[f"{name}_same"] else "no"
        processor = "" if name == "killed" else f"{found[name]['processor_s']:.1f}"
        rows.append([what, f"{found[name]['seconds']:.1f}", processor, alike])
    heads = ("drawn by", "seconds", "processor seconds of all processes", "the same bytes")
    width, height = found["canvas"]
    said = f"{found['frames']} pictures of {width} × {height} pixels, {found['cores']} cores."
    if found["load"] > 0.5:
        said += f" The machine had other work meanwhile (load {found['load']:.1f}), so seconds say little."
    return f"{markdown(heads, rows)}\n\n{said}"


def _many(found: dict[str, Any]) -> str:
    ends = [found["memory_mib"][at] for at in (0, len(found["memory_mib"]) // 2, -1)]
    counts = ", ".join(f"{end['frames']:,}" for end in ends)
    client, scheduler = (", ".join(f"{end[name]:.0f}" for end in ends) for name in ("client", "scheduler"))
    return (
        f"{found['frames']:,} pictures of {found['canvas'][0]} × {found['canvas'][1]} pixels in "
        f"{found['batches']:,} tasks: each takes {found['client_ms']:.1f} ms of this process's processor, "
        f"{found['scheduler_ms']:.1f} ms of the scheduler's and {found['workers_ms']:.1f} ms of workers', "
        f"where without a cluster it is {found['alone_ms']:.1f} ms, drawn and written. Memory after {counts} "
        f"pictures: this process {client} MiB, the scheduler {scheduler} MiB."
    )


def _gone(found: dict[str, Any]) -> str:
    kept, drawn = found["kept"], found["drawn"]
    same = "the same bytes as" if found["same"] else "other bytes than"
    return (
        f"A scheduler that is killed halfway: {kept} of {kept + drawn} pictures are kept, the command ends "
        f"{found['told_s']:.1f} s later, the next draws {drawn}, and all have {same} those of one process."
    )


def _made(found: dict[str, Any]) -> str:
    return f" (`{found['command']}`, revision `{found['revision'][:7]}`)"


BLOCKS: dict[str, Callable[[], str]] = {"cluster": cluster}
