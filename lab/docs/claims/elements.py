"""Figures in docs/elements.md."""

from lab.docs.figures import Figure, at, kilobytes
from scenelang.fitting import apart, colours, picture

SPEED = at("element-speed", "ratios").values()
TIMES = {
    mist: [
        Figure(times)
        for scenes in SPEED
        for name, row in scenes.items()
        for what, times in row.items()
        if (name == "mist") == mist and what != "torus_ms"
    ]
    for mist in (False, True)
}
LOAD = Figure(max(at("element-speed", "load_ms").values()))
SMALL, LARGE = "solids3d/meshes3d", "solids3d-256/meshes3d"
CLAIMS = [
    f"at most {Figure(apart.READ_S)} s of processor time, and {Figure(apart.MEGABYTE_S)} s more for each MB "
    f"of it up to {Figure(apart.MOST_READ_S)}, with {Figure(apart.READ / (1 << 30))} GiB of memory and "
    f"{Figure(apart.TIMES)} times its size; it measures it in {Figure(apart.CPU_S)} s "
    f"(or twice the budget) and {Figure(apart.MEMORY / (1 << 30))} GiB",
    f"at most `--max-error`, {Figure(picture.NEAR_COLOUR)}, which",
    f"at most `--color-error`, {Figure(colours.NEAR)}, up",
    f"about {Figure(colours.MOST_BYTES / 1000)} KB. A part",
    f"takes {min(TIMES[False]):.1f} to {max(TIMES[False]):.1f} times as long as with a torus in its place "
    f"(the least of several drawings of each, in turn); of mist {min(TIMES[True]):.1f} "
    f"to {max(TIMES[True]):.1f} times",
    f"Loading one takes {LOAD:.0f} ms",
    f"They take {kilobytes('std/meshes'):.0f} KB",
    f"at {at(SMALL, 'psnr/mean'):.1f} dB and FLIP {at(SMALL, 'flip/mean'):.4f} on average, the worst of "
    f"{at(SMALL, 'scenes')} at {at(SMALL, 'psnr/worst'):.1f} (128²; {at(LARGE, 'psnr/mean'):.1f} and "
    f"{at(LARGE, 'flip/mean'):.4f} at 256²",
]
GIVEN = {
    "0.00015 of solids, 0.0001 of flat shapes": "errors that are asked for",
    "faces of more than 1,000 corners, 10,000 pieces of a mesh or 50,000 elements of a drawing": "limits",
    "drawn 960 wide": "a size to speak of",
    "which is 40 dB": "the same in another unit",
    "no inside within a cell of more than 2 % of a surface": "where the report warns",
    "twice as many of its own radii": "a rule",
    "where it is half as large": "a rule",
    "1,025 in the plane": "the largest grid",
    "CC0 1.0": "a license",
}
