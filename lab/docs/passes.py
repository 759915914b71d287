"""Tables of what passes change, from `passes.json`, which `python -m tests.compiler.prove` wrote."""

from __future__ import annotations

from collections.abc import Callable

from lab.docs.figures import read
from lab.docs.tables import markdown


def passes_text() -> str:
    """Effect of each pass in random scenes."""
    rows = [
        [f"`{name}`", f"{tally['changed']:,}", f"{tally['largest']:.0e}" if tally["largest"] else "0"]
        for name, tally in read("passes")["passes"].items()
        if tally["changed"]
    ]
    return markdown(("pass", "scenes changed", "largest change of a colour"), rows)


def proof_text() -> str:
    """Proof of the passes, in one paragraph."""
    proof = read("passes")
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


BLOCKS: dict[str, Callable[[], str]] = {"passes": passes_text, "passes-proof": proof_text}
