"""What the laboratory's commands share: options, the model, files."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from scenelang.files import write_whole

if TYPE_CHECKING:
    from scenelang.models.load import Model

DEFAULT_SEED: Final = 2021

out = click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    default=Path("out"),
    show_default=True,
    metavar="FOLDER",
    help="Folder to write to.",
)
weights = click.option(
    "--weights",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Weights instead of the shipped ones.",
)
threads = click.option(
    "--threads",
    default=1,
    show_default=True,
    type=click.IntRange(1, 256),
    metavar="N",
    help="Number of threads on the CPU.",
)
seed = click.option(
    "--seed",
    default=DEFAULT_SEED,
    show_default=True,
    type=click.IntRange(0, 2**31 - 1),
    metavar="N",
    help="Seed of what is random.",
)

kept = click.option(
    "--kept",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Folder of exact pictures; those that are missing are drawn and kept there.",
)


def check_names(what: str, wanted: Iterable[str], known: Iterable[str]) -> None:
    """Refuse names that are not known.

    Raises:
        click.UsageError: one is not.
    """
    known = list(known)
    for name in wanted:
        if name not in known:
            raise click.UsageError(f"no {what} `{name}`; there are {', '.join(known)}")


def write_json(path: Path, value: Any) -> None:
    """Write a record whole, and its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, (json.dumps(value, indent=1) + "\n").encode())


def write_chart(path: Path, draw: Callable[[], bytes]) -> None:
    """Write a chart; says what is missing where none can be drawn."""
    try:
        write_whole(path, draw())
    except ImportError:
        click.echo("no chart: matplotlib is missing; pip install 'scenelang[charts]'", err=True)


def model_to_measure(name: str, weights: Path | None) -> Model:
    """A shipped model, or one with other weights."""
    from scenelang.models.load import load_model
    from scenelang.models.manifest import ALIASES, available

    check_names("model", [name], [*available(), *ALIASES])
    if weights is not None and name in ("shapes2d-streaming", "shapes2d-reading"):
        from scenelang.lab.designs.export import trained_model

        return trained_model(weights)
    return load_model(name, path=weights)
