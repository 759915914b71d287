"""``scenelang lab COMMAND``: what measures models, compares them and trains for comparison."""

from __future__ import annotations

from typing import Final

import click

from scenelang.cli.main import Commands

TABLE: Final = {
    "eval": "Measure a model on unseen scenes.",
    "stability": "Measure a model far beyond its training.",
    "codes": "Measure how many numbers a texture or a mesh needs.",
    "shadows": "Measure the error inside the shadows of media.",
    "frontier": "Measure speed against error of every way to draw.",
    "plans": "Measure what drawing scenes takes, and what leaving less out would cost.",
    "fit": "Measure how often a scene's params are found from a picture.",
    "experiment": "Train several designs alike and compare them.",
    "chart": "Draw tables and charts of experiments.",
    "train": "Train the weights of another renderer or lifting.",
    "all": "Measure everything that the documentation reports.",
}


@click.group("lab", cls=Commands, package="scenelang.lab.commands", table=TABLE)
def command() -> None:
    """Measure models and compare designs: what the figures in the documentation come from."""
