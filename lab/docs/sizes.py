"""Tables of what textures and meshes come to at so many numbers or bytes, from records."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from lab.docs import paper
from lab.docs.figures import RESULTS, read
from lab.docs.tables import markdown, theirs

PAPER = {"textures": paper.MATERIAL_SIZES, "meshes": paper.GEOMETRY_SIZES}
HEADS = (
    "numbers",
    *("codes: PSNR, dB", "SSIM", "LPIPS", "FLIP"),
    *("forms: PSNR, dB", "SSIM", "LPIPS", "FLIP"),
)


def _cells(row: Mapping[str, Any] | None) -> list[str]:
    if row is None:
        return ["–"] * 4
    lpips = "–" if row["lpips"] is None else f"{row['lpips']['mean']:.3f}"
    psnr = f"{row['psnr']['mean']:.2f} ± {row['psnr']['interval']:.2f}"
    return [psnr, f"{row['ssim']['mean']:.3f}", lpips, f"{row['flip']['mean']:.3f}"]


def table(what: str) -> str:
    """Codes, forms and the paper at every size, then elements by their bytes, with the command."""
    if not (RESULTS / f"codes-{what}.json").exists():
        return "*Not measured yet.*"
    found = read(f"codes-{what}")
    of = {(row["kind"], row["d"], row.get("seed", 1)): row for row in found["rows"]}
    sizes = dict.fromkeys(d for kind, d, _ in of if kind == "forms")
    lines = [
        [f"{d:,}", *_cells(of.get(("codes", d, 1))), *_cells(of["forms", d, 1]), *theirs(PAPER[what].get(d))]
        for d in sizes
    ]
    for row in found["rows"]:
        if row["kind"] == "elements":
            made = "that ship" if row["shipped"] else f"`--max-error {row['max_error']:g}`"
            lines.append([f"{row['d']:,} bytes: elements {made}", *_cells(None), *_cells(row), *theirs(None)])
    again = [
        f"{row['psnr']['mean']:.2f} dB at {row['d']}"
        for row in found["rows"]
        if row["kind"] == "codes" and row["seed"] > 1
    ]
    other = f"; another seed of theirs gives {', '.join(again)}" if again else ""
    shared = next(row["shared"] for row in found["rows"] if row["kind"] == "codes")
    said = (
        f"`{found['command']}`: {found['scenes']} scenes of `{found['set']}` at {found['canvas'][0]}² "
        f"(LPIPS {found['scenes_lpips']}), seed {found['seed']}, ± 95 %; decoders of {shared:,} numbers and "
        f"more, {found['seconds']:g} s each{other}; revision `{found['revision'][:8]}`"
    )
    return f"{markdown((*HEADS, 'paper: PSNR', 'SSIM', 'LPIPS', 'FLIP'), lines)}\n\n{said}"


def by_bytes() -> str:
    """The best of each form at so many bytes, of meshes and of pictures."""
    if not (RESULTS / "element-bytes.json").exists():
        return "*Not measured yet.*"
    found, tables = read("element-bytes"), []
    for kind, what, digits in (
        ("meshes", "mean distance off, radii", 4),
        ("pictures", "PSNR of texels, dB", 1),
    ):
        cells = {
            (row["form"], row["bytes"]): f"{row['mean']:.{digits}f} ± {row['interval']:.{digits}f}"
            for row in found[kind]["rows"]
        }
        forms = dict.fromkeys(form for form, _ in cells)
        rows = [
            [f"{size:,}", *(cells.get((form, size), "–") for form in forms)]
            for size in sorted({size for _, size in cells})
        ]
        tables.append(
            f"{found[kind]['files']} {kind}, {what}:\n\n{markdown(('bytes at most', *forms), rows)}"
        )
    said = f"`{found['command']}`, ± 95 % over files, revision `{found['revision'][:8]}`"
    return "\n\n".join([*tables, said])


BLOCKS: dict[str, Callable[[], str]] = {
    **{f"codes-{what}": partial(table, what) for what in PAPER},
    "element-bytes": by_bytes,
}
