"""Tables of what passes and skipping save, from records.

`plans.json` is what `python -m lab plans examples/*.nsg` wrote, and `passes.json` what
`python -m tests.compiler.prove` did.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from lab import RESULTS
from lab.parsimony import WAYS

Record = Mapping[str, Any]


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(head)} |", "|---|" + "--:|" * (len(head) - 1)]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def read(name: str) -> Record | None:
    """A record, or None where it was not made yet."""
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text("utf-8")) if path.exists() else None


def passes_text(proof: Record, plans: Record) -> str:
    """Effect of each pass in random scenes and in the examples."""
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
    """Proof of the passes, in one paragraph."""
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
    """Reduction by a pass over all examples, and the number of examples that it changed."""
    saved = dict.fromkeys(("examples", "objects", "matrices", "folds"), 0)
    for plan in plans:
        rows = plan["stages"]
        at = next(i for i, row in enumerate(rows) if row["stage"] == name)
        saved["examples"] += rows[at]["changed"]
        for key in ("objects", "matrices", "folds"):
            saved[key] += rows[at - 1][key] - rows[at][key]
    return saved


def ways_text(plans: Record) -> str:
    """Savings of skipping and adaptive sampling, over all examples together."""
    result = [plan["ways"] for plan in plans["plans"] if plan["ways"]]
    shipped = _way(result, "as shipped")
    rows = []
    for name in WAYS:
        meetings, ms, error, worst = _way(result, name)
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
    about = f"All {len(result)} examples together, one thread, one run on {plans['machine']}."
    return f"{markdown(head, rows)}\n\n{about}"


def _way(found: Sequence[Record], name: str) -> tuple[float, float, float, float]:
    """Meetings and milliseconds in all, mean and lowest PSNR."""
    of = [ways[name] for ways in found]
    errors = [w["psnr"] for w in of]
    return sum(w["meetings"] for w in of), sum(w["ms"] for w in of), sum(errors) / len(errors), min(errors)


def _told(text: Callable[..., str], *names: str) -> Callable[[], str]:
    return lambda: text(*(read(name) for name in names))


BLOCKS: dict[str, Callable[[], str]] = {
    "ways": _told(ways_text, "plans"),
    "passes": _told(passes_text, "passes", "plans"),
    "passes-proof": _told(proof_text, "passes"),
}
