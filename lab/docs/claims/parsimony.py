"""Figures in docs/parsimony.md."""

from lab.docs.figures import Figure, read
from lab.parsimony import verdict

PARTS = read("experiments/parts")
LOST = [
    Figure(-verdict(run, PARTS).blends)
    for run in PARTS["runs"]
    if run["name"] in ("no distance scale", "pictures alone")
]
CLAIMS = [f"and {min(LOST):.0f} to {max(LOST):.0f} dB where shapes blend"]
GIVEN = {"with 60 scenes": "a size that the test has"}
