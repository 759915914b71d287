"""Tables of what frames, proofs, pages and commands cost, from what `benchmarks` recorded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lab import RESULTS
from lab.docs.figures import read
from lab.docs.tables import markdown


def measured(name: str, told: Callable[[Any], str]) -> Callable[[], str]:
    """A block of a record, and the command that made it."""

    def block() -> str:
        if not (RESULTS / f"{name}.json").exists():
            return "*Not measured yet.*"
        result = read(name)
        source = f"`{result['command']}`, revision `{result['revision'][:8]}`, {result['machine']}"
        return f"{told(result)}\n\n{source}"

    return block


def startup(found: Any) -> str:
    """Whole commands beside what Python and its libraries take."""
    torch = found["median_s"]["import torch"]
    rows = [[what, f"{s:.2f}", f"{s / torch:.2f}"] for what, s in found["median_s"].items()]
    return markdown(("process", f"median of {found['rounds']}, s", "× `import torch`"), rows)


def viewer(found: Any) -> str:
    """Frames of pages in software GL."""
    rows = [
        [name, f"{row['operations']:,.0f}", f"{row['least']:,.0f}", f"{row['first']:,.0f}"]
        for name, row in found["scenes"].items()
    ]
    heads = ("scene", "operations a pixel", "frame in software GL, ms", "the first, with compiling")
    return markdown(heads, rows)


def proof(found: Any) -> str:
    """Proved shares of the pictures of each set, and their cost."""
    heads = ("set", "proved, %", "right, %", "largest bound", "largest error", "proof", "drawn again")
    rows = []
    for row in found["sets"]:
        shares = [
            f"{100 * row['proved']:.2f} ± {100 * row['proved_interval']:.2f}",
            f"{100 * row['right']:.2f}",
        ]
        costs = [f"{row[f'x_{way}']:.1f}" for way in ("proof", "redraw")]
        largest = [f"{row[key]:.2f}" for key in ("bound", "off")]
        rows.append([f"`{row['set']}`", *shares, *largest, *costs])
    return markdown(heads, rows)


BLOCKS = {told.__name__: measured(told.__name__, told) for told in (startup, viewer, proof)}
