"""``python -m lab COMMAND``: what measures models, compares them and trains them."""

from __future__ import annotations

import runpy
import sys
from typing import Final

import click

from lab import ROOT
from scenelang.cli.main import Reporting

TABLE: Final = {
    "train": "Train a model's weights.",
    "eval": "Measure a model on unseen scenes.",
    "stability": "Measure a model far beyond its training.",
    "shadows": "Measure the error inside the shadows of media.",
    "frontier": "Measure speed against error of every way to draw.",
    "plans": "Measure what drawing scenes takes, and what leaving less out would cost.",
    "fit": "Measure how often a scene's params are found from a picture.",
    "all": "Measure everything that the documentation reports.",
    "bench": "Run a benchmark.",
    "docs": "Write tables, pictures and files of the repository anew.",
}


@click.group("lab", cls=Reporting, package="lab.commands", table=TABLE)
def command() -> None:
    """Measure models, compare designs and train: what the figures in the documentation come from."""


def scripts(name: str, pattern: str, words: str) -> click.Command:
    """A command that runs a module of a folder of the laboratory, which reads the rest of the command line.

    Args:
        name: of the command and of the folder.
        pattern: of the module's name, with ``{}`` for the script's.
        words: for `--help`.
    """
    known = sorted(
        path.stem.removeprefix(pattern.format(""))
        for path in (ROOT / "lab" / name).glob(pattern.format("*") + ".py")
        if path.stem != "__init__"
    )

    @click.command(
        name,
        help=f"{words}: SCRIPT is one of {', '.join(known)}.",
        context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False},
    )
    @click.argument("script", type=click.Choice(known), metavar="SCRIPT")
    @click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
    def run(script: str, arguments: tuple[str, ...]) -> None:
        sys.argv = [f"python -m lab {name} {script}", *arguments]
        runpy.run_module(f"lab.{name}.{pattern.format(script)}", run_name="__main__")

    return run
