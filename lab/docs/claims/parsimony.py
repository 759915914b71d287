"""Figures in docs/parsimony.md."""

CLAIMS: list[str] = []
GIVEN = {
    "with 60 scenes": "a size that the test has",
    "7 to 8 dB where shapes blend": "of a measurement that is not made again",
}
