"""The stages of the compiler, for the commands that show what a scene is after them."""

from __future__ import annotations

from collections.abc import Collection
from difflib import get_close_matches

import click

from scenelang.passes import PASSES

STAGES = ("syntax", "scene", "lower", *(step.name for step in PASSES), "program")
"""In order: the syntax tree, the scene, the graph after each pass, the program."""


def check_stages(wanted: Collection[str], known: Collection[str] = STAGES) -> None:
    """Refuse names that are none of the stages.

    Raises:
        click.UsageError: one is not.
    """
    for name in wanted:
        if name not in known:
            near = get_close_matches(name, known, 1)
            advice = f" Did you mean `{near[0]}`?" if near else ""
            raise click.UsageError(f"No stage `{name}`.{advice} There are {', '.join(known)}.")
