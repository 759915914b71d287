"""Tables of network and exact field side by side, and taking over a frontier that was measured.

`python -m lab docs frontier --ship OUT` takes over what `python -m lab frontier` wrote into OUT:
frontier.json, which is shipped beside the models, frontier.html and, after --verify, verified.json, of the
plane or of solids; it draws the chart in docs/pictures anew.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from lab import DOCS, RESULTS, ROOT
from lab.frontier.record import FrameErrors, Frontier, Ratio
from lab.frontier.ways import FIELD, TITLES
from scenelang.output.frontier import frontier_path

BASES = {"shapes2d": "", "solids3d": "-solids"}  # models that sets are named after, and endings of names


def verified_path(base: str) -> Path:
    """Record of the verified promises of a set."""
    return RESULTS / f"frontier-verified{BASES[base]}.json"


def ship(out: Path) -> None:
    """Take over what was measured."""
    models = {p.model for p in Frontier.from_json((out / "frontier.json").read_bytes()).points}
    base = next(name for name in BASES if name in models)
    shutil.copyfile(out / "frontier.json", frontier_path(base))
    shutil.copyfile(out / "frontier.html", DOCS / f"frontier-chart{BASES[base]}.html")
    if (out / "verified.json").exists():
        shutil.copyfile(out / "verified.json", verified_path(base))
    picture = f"frontier{BASES[base]}.png"
    subprocess.run([sys.executable, "-m", "lab", "docs", "pictures", "--only", picture], cwd=ROOT, check=True)


SAVINGS = {
    "": "four samples near outlines",
    TITLES["four"]: "four samples everywhere",
    TITLES["one"]: "one sample",
    TITLES["quick"]: "long steps, four samples near outlines",
}


def savings_text(frontier: Frontier, base: str) -> str:
    """Network and exact field in the same renderer, each with the same samples."""
    lines = [
        "| samples | network, ms | exact field, ms | network's time over its | network's FLIP | its FLIP |",
        "|---|--:|--:|--:|--:|--:|",
    ]
    for ending, words in SAVINGS.items():
        network, field = frontier.point(base + ending), frontier.point(FIELD + ending)
        ratio = frontier.ratio(base + ending, FIELD + ending)
        if network is None or field is None or ratio is None:
            continue
        assert network.flip is not None
        assert field.flip is not None
        cells = [words, f"{network.ms.median:.3g}", f"{field.ms.median:.3g}", _ratio(ratio)]
        cells += [_mean(network.flip, 5), _mean(field.flip, 5)]
        lines.append(f"| {' | '.join(cells)} |")
    if len(lines) == 2:
        return "*Not measured yet.*"
    both = [
        (words, frontier.ratio(name + TITLES["four"], name))
        for words, name in (("network", base), (FIELD, FIELD))
    ]
    told = [f"{_ratio(result)} for the {name}" for name, result in both if result is not None]
    four = f" Four samples everywhere take so many times as long: {', '.join(told)}." if told else ""
    return (
        "\n".join(lines) + f"\n\nTimes are ratios of the same scene, ± the 95 % interval of their mean.{four}"
    )


def _mean(value: FrameErrors, digits: int) -> str:
    spread = f" ± {value.interval:.{digits}f}" if round(value.interval, digits) else ""
    return f"{value.mean:.{digits}f}{spread}"


def _ratio(found: Ratio) -> str:
    return (
        f"{found.mean:.2f} ± {found.interval:.2f}"
        if found.mean < 10
        else f"{found.mean:.0f} ± {found.interval:.0f}"
    )


def _told(base: str) -> Callable[[], str]:
    return lambda: savings_text(Frontier.from_json(frontier_path(base).read_bytes()), base)


BLOCKS: dict[str, Callable[[], str]] = {f"savings{ending}": _told(base) for base, ending in BASES.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ship", type=Path, metavar="OUT", required=True)
    ship(parser.parse_args().ship)


if __name__ == "__main__":
    main()
