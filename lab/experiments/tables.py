"""Tables in Markdown out of the JSON files of experiments, the paper's figures beside ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lab.experiments import paper

Result = Mapping[str, Any]
HEAD = ("PSNR, dB", "worst", "SSIM", "LPIPS", "FLIP")
PAPER_HEAD = ("paper: PSNR", "SSIM", "LPIPS", "FLIP")


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def figures(run: Result) -> list[str]:
    """A run's cells under `HEAD`."""
    lpips = run["lpips"]
    return [
        f"{run['psnr']['mean']:.2f}",
        f"{run['psnr']['worst']:.2f}",
        f"{run['ssim']['mean']:.3f}",
        "–" if lpips is None else f"{lpips['mean']:.3f}",
        f"{run['flip']['mean']:.3f}",
    ]


def theirs(line: paper.Figures | None) -> list[str]:
    """The paper's cells under `PAPER_HEAD`."""
    if line is None:
        return ["–"] * 4
    return [f"{line.psnr:.2f}", f"{line.ssim:.3f}", f"{line.lpips:.3f}", f"{line.flip:.3f}"]


def _effort(run: Result) -> list[str]:
    return [f"{run['seconds']:.0f} s", f"{run['steps']:,}", f"{run['parameters']:,}"]


NOTHING = "*a white picture*"
EFFORT = ("processor time", "steps", "parameters")


def plain(found: Result) -> str:
    """A line a run."""
    rows = [[run["name"], run["group"], *_effort(run), *figures(run)] for run in found["runs"]]
    if "white" in found and not any(run["config"]["fixed"] for run in found["runs"]):
        rows.append([NOTHING, "", "–", "–", "–", *figures(found["white"])])
    return markdown(("what", "", *EFFORT, *HEAD), rows)


def compare(found: Result) -> str:
    """Renderers and liftings, a column for each budget."""
    runs: dict[str, dict[str, Result]] = {}
    for run in found["runs"]:
        runs.setdefault(run["name"], {})[run["group"]] = run
    groups = list(dict.fromkeys(run["group"] for run in found["runs"]))
    best = [max(at[g]["psnr"]["mean"] for at in runs.values()) for g in groups]
    rows = []
    for name, at in runs.items():
        cells = [name, f"{next(iter(at.values()))['parameters']:,}"]
        for group, most in zip(groups, best, strict=True):
            value = at[group]["psnr"]["mean"]
            mark = "**" if value == most else ""
            cells += [f"{mark}{value:.2f}{mark}", f"{at[group]['flip']['mean']:.3f}"]
        slope = at[groups[-1]]["psnr"]["mean"] - at[groups[0]]["psnr"]["mean"]
        rows.append([*cells, f"{slope:+.2f}"])
    if "white" in found:
        blank = [f"{found['white']['psnr']['mean']:.2f}", f"{found['white']['flip']['mean']:.3f}"]
        rows.append([NOTHING, "0", *blank * len(groups), "0"])
    head = ["renderer + lifting", "parameters"]
    for group in groups:
        head += [f"{group}: PSNR, dB", "FLIP"]
    return markdown((*head, "gain, dB"), rows)


def _beside(published: Mapping[str, paper.Figures]) -> Any:
    def table(found: Result) -> str:
        rows = [
            [run["name"], *_effort(run), *figures(run), *theirs(published.get(run["name"]))]
            for run in found["runs"]
        ]
        if "white" in found:
            rows.append([NOTHING, "–", "–", "–", *figures(found["white"]), *theirs(None)])
        return markdown(("", *EFFORT, *HEAD, *PAPER_HEAD), rows)

    return table


def seeds(found: Result) -> str:
    """Mean and spread over seeds."""
    groups: dict[str, list[Result]] = {}
    for run in found["runs"]:
        groups.setdefault(run["name"], []).append(run)
    rows = []
    for name, runs in groups.items():
        values = [run["psnr"]["mean"] for run in runs]
        rows.append(
            [
                name,
                ", ".join(f"{v:.2f}" for v in values),
                f"{sum(values) / len(values):.2f}",
                f"{max(values) - min(values):.2f}",
                "no" if all(run["finite"] for run in runs) else "YES",
            ]
        )
    return markdown(("", "PSNR of each seed, dB", "mean", "spread", "diverged"), rows)


TABLES: dict[str, Any] = {
    "compare": compare,
    "table2": _beside({"streaming+learned": paper.SHAPES}),
    "table4": _beside({"streaming+learned": paper.STREAMING, "reading+learned": paper.READING}),
    "seeds": seeds,
}


def table_of(found: Result) -> str:
    """The table of an experiment."""
    table: str = TABLES.get(found["experiment"], plain)(found)
    return table
