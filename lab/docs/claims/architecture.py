"""Figures in docs/architecture.md."""

from lab.docs.figures import Figure
from scenelang.drawing.how import THREAD_PIXELS

CLAIMS = [
    f"one thread for each {Figure(THREAD_PIXELS):,.0f} pixels",
]
GIVEN = dict.fromkeys(
    (
        "g (32 numbers)",
        "m (32 numbers)",
        "frames of 12 numbers",
        "all objects eight times",
        "looked up, four times where no",
        "up to 0.009 further",
        "at least 0.002",
        "6 or 12 numbers",
        "GLSL ES 3.00",
        "longer than 33 ms",
    ),
    "how it is built",
)
