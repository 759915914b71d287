"""The tables of docs/fit.md: how often params are found from a picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from statistics import median
from typing import Any

from figures import RESULTS, read

from scenelang.lab.experiments.tables import markdown

RECORDS = ("fit", "fit-six", "fit-solids")


def _between(found: int, scenes: int) -> str:
    """A share and Wilson's interval of it, which is none of no width where all were found."""
    z, share = 1.96, found / scenes
    middle, scale = share + z * z / (2 * scenes), 1 + z * z / scenes
    half = z * math.sqrt(share * (1 - share) / scenes + (z / (2 * scenes)) ** 2)
    low, high = (max(0.0, min(1.0, end / scale)) for end in (middle - half, middle + half))
    return f"{found} ({100 * low:.0f} to {100 * high:.0f} %)"


def _row(record: dict[str, Any], params: str, cases: list[dict[str, Any]]) -> list[str]:
    medians = {key: median(case[key] for case in cases) for key in ("db", "seconds", "frames")}
    return [
        f"`{record['model']}`",
        params,
        str(len(cases)),
        _between(sum(case["found"] for case in cases), len(cases)),
        str(sum(case["off"] <= record.get("near", 0.01) for case in cases)),
        f"{medians['db']:.1f}",
        f"{medians['seconds']:.1f}",
        f"{medians['frames']:.0f}",
    ]


def _made(record: dict[str, Any]) -> str:
    return f"`{record['command']}` (revision `{record['revision'][:7]}`, seed {record['seed']})"


def fits() -> str:
    """A row for each record and number of params, and the commands."""
    heads = (
        "model", "params", "scenes", "found", "values alone", "median picture, dB", "median seconds",
        "median pictures",
    )  # fmt: skip
    rows, commands = [], []
    for name in RECORDS:
        if not (RESULTS / f"{name}.json").exists():
            continue
        record = read(name)
        for count in record["params"]:
            cases = [case for case in record["cases"] if case["params"] == count]
            rows.append(_row(record, str(count), cases))
        if len(record["params"]) > 1:
            rows.append(_row(record, "all of these", record["cases"]))
        commands.append(_made(record))
    told = (
        "*Values alone* counts what is within 1 % of every range, whatever the picture. Seconds are of the "
        "processor, one thread. In brackets the 95 % interval of the share (Wilson 1927). "
    )
    return f"{markdown(heads, rows)}\n\n{told}{'; '.join(commands)}."


def searches() -> str:
    """The look around beside CMA-ES."""
    record = read("fit-search")
    heads = ("looks by", "found", "median picture, dB", "median seconds", "median pictures")
    rows = []
    for way, name in (("ours", "sequence and descents"), ("cma", "CMA-ES and descents")):
        found, of = record["ways"][way]["found"], record["ways"][way]["median"]
        rows.append(
            [
                name, _between(found, record["scenes"]), f"{of['db']:.1f}", f"{of['seconds']:.1f}",
                f"{of['frames']:.0f}",
            ]
        )  # fmt: skip
    told = f"{record['scenes']} scenes of {record['params']} params, cma {record['cma']}. {_made(record)}."
    return f"{markdown(heads, rows)}\n\n{told}"


def targets() -> str:
    """Targets that other programs made."""
    record = read("fit-targets")
    heads = ("target", "at 40 dB against what can be reached", "mean of that, dB", "lowest, dB",
        "picture to target, dB", "what can be reached, dB", "median seconds")  # fmt: skip
    rows = []
    for way, name in (("resvg", "SVG by resvg"), ("photograph", "blurred, noisy")):
        of = record["targets"][way]
        figures = [f"{of['mean_db']:.1f} ± {of['interval_db']:.1f}", f"{of['lowest_db']:.1f}"]
        figures += [f"{of['median'][key]:.1f}" for key in ("db", "reach_db", "seconds")]
        rows.append([name, _between(of["reached"], record["scenes"]), *figures])
    return f"{markdown(heads, rows)}\n\n{record['scenes']} scenes each. {_made(record)}."


def photographs() -> str:
    """Photographs that are ever worse."""
    record = read("fit-stability")
    parts = []
    for name, head in (("blur", "blur, pixels"), ("noise", "noise, % of white")):
        heads = (head, "at 40 dB", "mean, dB", "lowest, dB", "blur found, pixels", "median seconds")
        rows = [
            [
                f"{row['value'] if name == 'blur' else 100 * row['value']:g}",
                f"{row['reached']} of {record['scenes']}",
                f"{row['mean_db']:.1f} ± {row['interval_db']:.1f}",
                f"{row['lowest_db']:.1f}",
                f"{row['blur']:.2f}",
                f"{row['seconds']:.0f}",
            ]
            for row in record[name]
        ]
        parts.append(markdown(heads, rows))
    told = "PSNR is against what can be reached; noise has a blur of one pixel beside it, blur noise of 2 %. "
    return "\n\n".join([*parts, told + _made(record) + "."])


def gradients() -> str:
    """Descents by reverse passes beside those by differences."""
    heads = (
        "model", "params", "scenes", "seconds by differences", "by reverse passes", "times as fast",
        "end, dB, by differences", "by reverse passes",
    )  # fmt: skip
    record, rows = read("fit-gradients"), []
    for of in record["rows"]:
        low, high = of["interval"]
        rows.append(
            [
                f"`{record['model']}`", str(of["params"]), str(record["scenes"]),
                *(f"{of[way]['seconds']:.2f}" for way in ("differences", "reverse")),
                f"{of['faster']:.2f} ({low:.2f} to {high:.2f})",
                *(f"{of[way]['db']:.1f}" for way in ("differences", "reverse")),
            ]
        )  # fmt: skip
    told = (
        "Medians of descents from starts within 5 % of each range of the true values, in pictures of 64 "
        "pixels. Seconds are of the processor; *times as fast* is a geometric mean with its 95 % interval. "
    )
    return f"{markdown(heads, rows)}\n\n{told}{_made(record)}."


BLOCKS: dict[str, Callable[[], str]] = {
    "fits": fits,
    "fit-searches": searches,
    "fit-targets": targets,
    "fit-stability": photographs,
    "fit-gradients": gradients,
}
