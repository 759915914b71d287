"""Figures in docs/proof.md."""

from lab.docs.figures import Figure, read

SETS = read("proof")["sets"]
SCENES = Figure(sum(row["scenes"] for row in SETS))
PIXELS = Figure(sum(row["pixels"] for row in SETS) / 1e6)
BROKEN = Figure(sum(row["broken"] for row in SETS))
OPEN = Figure(sum(row["proved_again"] < 1 for row in SETS))
CLAIMS = [
    f"{SCENES} scenes of {Figure(len(SETS))} sets at 256², {PIXELS:.0f} million pixels: "
    f"**{BROKEN} pixels are farther from the exact one than they are proved to be**",
    f"in {OPEN} of the sets a pixel is left that is not proved right to 1/255",
]
GIVEN = {"128 × 128 cells": "the grid of the proof"}
