"""``scenelang learn``: elements from meshes and drawings, into a file that scenes import."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble

if TYPE_CHECKING:
    from scenelang.elements.zoo import Element


@click.command("learn")
@click.argument("files", metavar="FILE…", nargs=-1, required=True)
@click.option(
    "-o", "--out", required=True, metavar="ZOO", help="A file of elements, .safetensors; it may exist."
)
@click.option("--name", metavar="NAME", help="Of the element, instead of the file's.")
@options.choice(
    "--sign",
    words="winding closed",
    help="What tells inside: winding numbers, of any mesh, or normals, of a closed one that nowhere passes "
    "through itself.",
)
@click.option(
    "--max-error",
    type=click.FloatRange(0, min_open=True),
    metavar="SHARE",
    help="Mean distance off at the surface, in radii of the shape; 0.0005 of solids, 0.0001 of flat shapes.",
)
@click.option(
    "--budget",
    type=click.FloatRange(0, min_open=True),
    default=math.inf,
    metavar="SECONDS",
    help="Begin nothing new after this time.",
)
@click.option(
    "--steps", type=click.IntRange(1), metavar="N", help="Try so many grids at most, whatever the time."
)
@click.option("--license", metavar="TEXT", help="Of the originals; kept in the file.")
@click.option("--source", metavar="TEXT", help="Where they are from; kept in the file.")
@click.option("--preview", metavar="OUT.png", help="A picture of the new elements.")
def command(
    files: tuple[str, ...],
    out: str,
    name: str | None,
    sign: Literal["winding", "closed"],
    max_error: float | None,
    budget: float,
    steps: int | None,
    license: str | None,
    source: str | None,
    preview: str | None,
) -> None:
    """Make meshes and drawings elements, which scenes import.

    Meshes (.obj, .ply, .stl, .glb) become solids. What a drawing (.svg) paints and what is opaque or, without
    transparency, dark in a picture (.png) becomes a flat shape.

    What comes out is a grid of distances, no network: the smallest that is as near as asked. The shape lies
    in the unit ball or disc, the middle of its bounding box at the origin. A file of elements that exists
    gets the new ones beside its own.

    A scene says: import "zoo.safetensors" as zoo; zoo.cow { … }
    """
    from scenelang.elements.zoo import SUFFIX, zoo_bytes
    from scenelang.files import write_output
    from scenelang.fitting import outline
    from scenelang.fitting.ladder import NEAR, Rung, fit
    from scenelang.fitting.mesh import FitError, load_mesh

    if not out.endswith(SUFFIX):
        raise click.UsageError(f"`{out}` does not end in {SUFFIX}.")
    if name is not None and len(files) > 1:
        raise click.UsageError("--name is for one file.")
    names = [name or _word(Path(file).stem) for file in files]
    if len(set(names)) < len(names) or not all(n.isascii() and n.isidentifier() for n in names):
        raise click.UsageError(f"not names of elements, each once: {', '.join(names)}.")
    about: dict[str, str | float] = {
        key: text for key, text in (("license", license), ("source", source)) if text is not None
    }
    known, made = _known(out), []
    for file, called in zip(files, names, strict=True):

        def say(rung: Rung) -> None:
            click.echo(
                f"  {rung.side:>4} a side {rung.bytes:>8,} bytes  error {rung.error:.5f}  "
                f"1 in 100 {rung.worst:.4f}  normals {rung.normal_deg:.1f}°",
                err=True,
            )

        try:
            flat = file.lower().endswith(outline.SUFFIXES)
            shape = outline.load_outline(file) if flat else load_mesh(file, sign)
            click.echo(f"{called}: {', '.join(shape.notes)}", err=True)
            element, tried = fit(
                shape, called, max_error=max_error, budget_s=budget, steps=steps, about=about, report=say
            )
        except FitError as error:
            raise Trouble(f"{file}: {error}") from None
        made.append(element)
        off = float(element.about["error"])
        short = "" if off <= (asked := max_error or NEAR[shape.dimension]) else f", where {asked:g} was asked"
        shown = f"{element.sides[-1]} distances a side, {len(element.data):,} bytes, error {off:.5f}{short}"
        click.echo(f"{called}: {shown}; {len(tried)} grids tried")
    kept = [element for element in known if element.name not in names]
    write_output(out, zoo_bytes([*kept, *made]))
    if preview is not None:
        _preview(made, preview)


def _word(stem: str) -> str:
    """A file's name as an element's."""
    word = "".join(c if c.isascii() and c.isalnum() else "_" for c in stem).strip("_")
    return f"_{word}" if word[:1].isdigit() else word


def _known(out: str) -> list[Element]:
    """What a file of elements holds already."""
    from scenelang.elements.zoo import MOST_BYTES, read_zoo
    from scenelang.tensors import TensorError

    try:
        with open(out, "rb") as file:  # which is written again
            return list(read_zoo(file.read(MOST_BYTES + 1)).elements.values())
    except FileNotFoundError:
        return []
    except TensorError as error:
        raise Trouble(f"{out}: not a file of elements: {error}") from None


def _preview(made: list[Element], path: str) -> None:
    """A picture of elements in a row."""
    from scenelang.backend.render import render
    from scenelang.elements.zoo import Zoo
    from scenelang.scene.schema import Color, Elements, Material, Object, Rotate, Scale, Scene, Translate

    if len({element.dimension for element in made}) > 1:
        raise Trouble("--preview shows either flat or solid elements")
    zoo = Elements.of("zoo", "zoo.safetensors", Zoo({element.name: element for element in made}, "0" * 64))
    solid, count = made[0].dimension == 3, len(made)
    size = (1.8 if solid else 0.95) / max(1.8, count)
    turn = (Rotate.degrees(30, axis=(0, 1, 0)),) if solid else ()
    look = Material("diffuse" if solid else "flat", (Color("#c96" if solid else "#222"),))
    objects = tuple(
        Object(
            f"zoo.{element.name}",
            (*turn, Scale(size), Translate(2.05 * size * (at - (count - 1) / 2), 0)),
            look,
        )
        for at, element in enumerate(made)
    )
    render(Scene(elements=(zoo,), nodes=objects, canvas=(512, 512))).save(path)
