"""Write the tables of docs/parsimony.md from the JSON files in docs/results/.

python -m lab docs parsimony

`plans.json` is what `python -m lab plans examples/*.nsg` wrote, and `passes.json` what
`python -m tests.passes.prove` did.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from lab import DOCS
from lab.docs.figures import read
from lab.parsimony import WAYS
from scenelang.files import write_whole

PAGE = DOCS / "parsimony.md"
Record = Mapping[str, Any]


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table, its first column to the left and all others to the right."""
    lines = [f"| {' | '.join(head)} |", "|---|" + "--:|" * (len(head) - 1)]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def passes_text(proof: Record, plans: Record) -> str:
    """What each pass does in random scenes and in the examples."""
    rows = []
    for name, tally in proof["passes"].items():
        if tally["changed"]:
            saved = _saved(plans["plans"], name)
            rows.append(
                [
                    f"`{name}`",
                    f"{tally['changed']:,}",
                    f"{tally['largest']:.0e}" if tally["largest"] else "0",
                    *(f"{saved[key]:,}" for key in ("examples", "objects", "matrices", "folds")),
                ]
            )
    head = ("pass", "scenes changed", "largest change of a colour", "examples changed")
    return markdown((*head, "objects taken away", "matrices", "folds"), rows)


def proof_text(proof: Record) -> str:
    """How the passes were proven, in one paragraph."""
    differing = sum(tally["differing"] for tally in proof["passes"].values())
    words = ", ".join(f"{number:,} {word}" for word, number in proof["words"].items())
    return (
        f"{proof['scenes']:,} random scenes of {proof['objects']:,} objects and {proof['matrices']:,} "
        f"transforms, {proof['samples']:,} samples, {proof['covered']:,} of them covered; in the streams "
        f"{words}, of these {proof['groups']:,} groups. "
        f"{proof['bare']:,} more showed too little. "
        f"Coverage differs at {differing} samples; {proof['aside']} lay within {proof['edge']:.0e} of an "
        "outline."
    )


def _saved(plans: Sequence[Record], name: str) -> dict[str, int]:
    """What a pass took away from all examples, and from how many."""
    saved = dict.fromkeys(("examples", "objects", "matrices", "folds"), 0)
    for plan in plans:
        rows = plan["stages"]
        at = next(i for i, row in enumerate(rows) if row["stage"] == name)
        saved["examples"] += rows[at]["changed"]
        for key in ("objects", "matrices", "folds"):
            saved[key] += rows[at - 1][key] - rows[at][key]
    return saved


def ways_text(plans: Record) -> str:
    """What skipping and adaptive sampling save, over all examples together."""
    found = [plan["ways"] for plan in plans["plans"] if plan["ways"]]
    shipped = _way(found, "as shipped")
    rows = []
    for name in WAYS:
        meetings, ms, error, worst = _way(found, name)
        rows.append(
            [
                name,
                f"{meetings:,.0f}",
                f"{meetings / shipped[0]:.1f} ×",
                f"{ms / shipped[1]:.1f} ×",
                f"{error:.2f}",
                f"{worst:.2f}",
            ]
        )
    head = ("how it is drawn", "meetings", "of those shipped", "time", "PSNR, dB", "worst")
    about = f"All {len(found)} examples together, one thread, one run on {plans['machine']}."
    return f"{markdown(head, rows)}\n\n{about}"


def _way(found: Sequence[Record], name: str) -> tuple[float, float, float, float]:
    """Meetings and milliseconds in all, mean and lowest PSNR."""
    of = [ways[name] for ways in found]
    errors = [w["psnr"] for w in of]
    return sum(w["meetings"] for w in of), sum(w["ms"] for w in of), sum(errors) / len(errors), min(errors)


def examples_text(plans: Record) -> str:
    """A line for every example, those of the plane before those of solids."""
    tables = []
    for solid, what, work in (
        (False, ("pixels evaluated", "sampled four times", "meetings"), _met),
        (True, ("pixels", "sampled four times", "rays", "near an object", "steps", "evaluations"), _traced),
    ):
        rows = [
            [*_size(plan), *work(plan["drawing"]), *_outcome(plan["drawing"])]
            for plan in plans["plans"]
            if ("rays" in plan["drawing"]) == solid
        ]
        head = ("scene", "objects", "matrices", "tokens", "model", "runner-up", "parameters")
        if rows:
            tables.append(markdown((*head, *what, "ms", "PSNR, dB", "FLIP"), rows))
    weights = ", ".join(f"`{name}` {digest[:8]}…" for name, digest in plans["weights"].items())
    about = f"One thread, {plans['machine']}, torch {plans['torch']}, one run; weights of {weights}."
    return "\n\n".join([*tables, about])


def _size(plan: Record) -> list[str]:
    """What is drawn, and by which model."""
    first, last = plan["stages"][0], plan["stages"][-1]
    return [
        f"[{plan['file'].removesuffix('.nsg')}](../examples/{plan['file']})",
        f"{first['objects']} → {last['objects']}",
        f"{first['matrices']} → {last['matrices']}",
        f"{sum(first['tokens'].values())} → {plan['rows']}",
        plan["model"],
        plan["runner_up"] or "–",
        f"{plan['drawing']['parameters']:,}",
    ]


def _met(cost: Record) -> list[str]:
    """What the network saw of a scene of the plane."""
    return [
        f"{_percent(cost['evaluated'], cost['pixels'])} of {cost['pixels']:,}",
        _percent(cost["refined"], cost["pixels"]),
        _percent(cost["meetings"], cost["meetings_unskipped"]),
    ]


def _traced(cost: Record) -> list[str]:
    """What the network was asked of a scene of solids."""
    rays = cost["rays"] + cost["light_rays"]
    return [
        f"{cost['pixels']:,}",
        _percent(cost["refined"], cost["pixels"]),
        f"{rays:,}",
        _percent(cost["near"], rays),
        f"{cost['steps']:,}",
        f"{cost['evaluations']:,}",
    ]


def _outcome(cost: Record) -> list[str]:
    """Time and error."""
    flip = "–" if cost["flip"] is None else f"{cost['flip']:.4f}"
    return [f"{cost['ms']:.0f}", f"{cost['psnr']:.1f}", flip]


def _percent(part: float, whole: float) -> str:
    return f"{100 * part / whole:.1f} %" if whole else "–"


def tables() -> dict[str, str]:
    """What stands in the page, by the names of its places."""
    plans, proof = read("plans"), read("passes")
    return {
        "ways": ways_text(plans),
        "passes": passes_text(proof, plans),
        "proof": proof_text(proof),
        "examples": examples_text(plans),
    }


def filled(page: str, made: Mapping[str, str]) -> str:
    """A page with its generated places written anew.

    Raises:
        ValueError: it lacks a place.
    """
    for name, text in made.items():
        begin, end = f"<!-- {name}: python -m lab docs parsimony -->", f"<!-- end of {name} -->"
        pattern = re.compile(re.escape(begin) + r".*?" + re.escape(end), re.DOTALL)
        if not pattern.search(page):
            raise ValueError(f"no place for {name}")
        page = pattern.sub(lambda _, t=f"{begin}\n{text}\n{end}": t, page)
    return page


def main() -> None:
    """Write the page."""
    write_whole(PAGE, filled(PAGE.read_text("utf-8"), tables()).encode())


if __name__ == "__main__":
    main()
