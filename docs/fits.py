"""The table of docs/fit.md: how often params are found from a picture."""

from __future__ import annotations

import math
from collections.abc import Callable

from figures import RESULTS, read

from scenelang.lab.experiments.tables import markdown

RECORDS = ("fit", "fit-six", "fit-solids")


def _between(found: int, scenes: int) -> str:
    """Wilson's interval of a share, which is none of no width where all were found."""
    z, share = 1.96, found / scenes
    middle, scale = share + z * z / (2 * scenes), 1 + z * z / scenes
    half = z * math.sqrt(share * (1 - share) / scenes + (z / (2 * scenes)) ** 2)
    return f"{100 * (middle - half) / scale:.0f} to {100 * (middle + half) / scale:.0f} %"


def fits() -> str:
    """A row for each record and number of params, and the commands."""
    heads = ("model", "params", "scenes", "found", "median picture, dB", "median seconds", "median pictures")
    rows, commands = [], []
    for name in RECORDS:
        if not (RESULTS / f"{name}.json").exists():
            continue
        record = read(name)
        dbs = sorted(case["db"] for case in record["cases"])
        rows.append(
            [
                f"`{record['model']}`",
                ", ".join(str(count) for count in record["params"]),
                str(record["scenes"]),
                f"{record['found']} ({_between(record['found'], record['scenes'])})",
                f"{dbs[len(dbs) // 2]:.1f}",
                f"{record['median_seconds']:.1f}",
                str(record["median_frames"]),
            ]
        )
        made = f"revision `{record['revision'][:7]}`, seed {record['seed']}"
        commands.append(f"`{record['command']}` ({made})")
    told = (
        "Seconds are of the processor, one thread. In brackets the 95 % interval of the share (Wilson 1927). "
        + "; ".join(commands)
        + "."
    )
    return f"{markdown(heads, rows)}\n\n{told}"


BLOCKS: dict[str, Callable[[], str]] = {"fits": fits}
