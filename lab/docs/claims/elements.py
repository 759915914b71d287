"""Figures in docs/elements.md."""

from lab.docs.figures import Figure
from scenelang.drawing.exact import outline
from scenelang.inverse import grids, sandbox

CLAIMS = [
    f"at most {Figure(sandbox.READ_S)} s of processor time, and {Figure(sandbox.MEGABYTE_S)} s more for each "
    f"MB of it up to {Figure(sandbox.MOST_READ_S)}, with {Figure(sandbox.READ / (1 << 30))} GiB of memory "
    f"and {Figure(sandbox.TIMES)} times its size; it measures it in {Figure(sandbox.CPU_S)} s "
    f"(or twice the budget) and {Figure(sandbox.MEMORY / (1 << 30))} GiB",
    f"at most `--max-error`, {Figure(outline.NEAR_COLOUR)}, which",
    f"at most `--color-error`, {Figure(grids.NEAR_COLOURS)}, up",
    f"about {Figure(grids.MOST_BYTES / 1000)} KB.",
]
GIVEN = {
    "0.00015 of solids, 0.0001 of flat shapes": "errors that are asked for",
    "faces of more than 1,000 corners, 10,000 pieces of a mesh or 50,000 elements of a drawing": "limits",
    "drawn 960 wide": "a size to speak of",
    "which is 40 dB": "the same in another unit",
    "inside within a cell of more than 2 % of a surface": "where the report warns",
    "twice as many of its own radii": "a rule",
    "it is half as large": "a rule",
    "1,025 in the plane": "the largest grid",
    "CC0 1.0": "a license",
}
