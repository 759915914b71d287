"""Figures in docs/architecture.md."""

from lab.docs.figures import Figure, read
from scenelang.backend.options import THREAD_PIXELS
from scenelang.backend.small import MOST_MS

SEARCH = read("fit-search")
OURS, CMA = (SEARCH["ways"][way] for way in ("ours", "cma"))
CLAIMS = [
    f"Measured on {Figure(SEARCH['scenes'])} scenes of six params with as many small pictures, ours found "
    f"{Figure(OURS['found'])} and CMA-ES {Figure(CMA['found'])}, in "
    f"{Figure(OURS['median']['frames'] / CMA['median']['frames']):.1f} of its pictures",
    f"one thread for each {Figure(THREAD_PIXELS):,.0f} pixels",
    f"numpy draws up to {Figure(MOST_MS)} ms",
]
GIVEN = dict.fromkeys(
    (
        "g (32 numbers)",
        "m (32 numbers)",
        "frames of 12 numbers",
        "where it is not 0.15",
        "all alive 15 s",
        "all objects eight times",
        "a thousand times what a blend wants",
        "736 numbers where",
        "four times where no outline",
        "narrower than 16 pixels are sampled four times",
        "blocks of 8 × 8 pixels",
        "compute capability 7.5 to 10.0",
        "up to 0.009 further",
        "8 to 24 points",
        "at least 0.002",
        "6 or 12 numbers",
        "GLSL ES 3.00",
        "longer than 33 ms",
    ),
    "how it is built",
)
