"""The table of what meshes and pictures come to at so many bytes, from a record."""

from __future__ import annotations

from collections.abc import Callable

from lab import RESULTS
from lab.docs.figures import read
from lab.docs.tables import markdown


def by_bytes() -> str:
    """The best of each form at so many bytes, of meshes and of pictures."""
    if not (RESULTS / "element-bytes.json").exists():
        return "*Not measured yet.*"
    result, tables = read("element-bytes"), []
    for kind, what, digits in (
        ("meshes", "mean distance off, radii", 4),
        ("pictures", "PSNR of texels, dB", 1),
    ):
        cells = {
            (row["form"], row["bytes"]): f"{row['mean']:.{digits}f} ± {row['interval']:.{digits}f}"
            for row in result[kind]["rows"]
        }
        forms = dict.fromkeys(form for form, _ in cells)
        rows = [
            [f"{size:,}", *(cells.get((form, size), "–") for form in forms)]
            for size in sorted({size for _, size in cells})
        ]
        tables.append(
            f"{result[kind]['files']} {kind}, {what}:\n\n{markdown(('bytes at most', *forms), rows)}"
        )
    said = f"`{result['command']}`, ± 95 % over files, revision `{result['revision'][:8]}`"
    return "\n\n".join([*tables, said])


BLOCKS: dict[str, Callable[[], str]] = {"element-bytes": by_bytes}
