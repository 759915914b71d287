"""``scenelang learn``: elements from meshes, drawings and pictures, into a file that scenes import."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Literal

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble
from scenelang.cli.outputs import targets
from scenelang.cli.progress import Bar
from scenelang.cli.say import say_trouble
from scenelang.elements.element import MOST_PIXELS, TEXELS

if TYPE_CHECKING:
    from scenelang.fitting.mesh import Sign


@click.command("learn")
@click.argument("files", metavar="FILE…", nargs=-1, required=True)
@click.option(
    "-o", "--out", required=True, metavar="ZOO", help="A file of elements, .safetensors; it may exist."
)
@click.option("--name", metavar="NAME", help="Of the element, instead of the file's.")
@options.choice(
    "--as",
    "pictures",
    words="texture outline",
    help="What a picture becomes: a material, or the flat shape of its opaque or, without transparency, dark "
    "part.",
)
@click.option(
    "--texels",
    type=click.IntRange(1, MOST_PIXELS),
    default=TEXELS,
    show_default=True,
    help="Of a texture along its longer side, at most; larger pictures are made smaller.",
)
@options.choice(
    "--sign",
    words="auto winding closed",
    help="What tells inside: winding numbers, of any mesh, or normals, of a closed one that nowhere passes "
    "through itself; auto is winding.",
)
@click.option(
    "--parts/--together",
    default=None,
    help="Whether parts are elements of their own too: solids that a mesh file names, areas of one colour. "
    "Those of drawings are if this is left out.",
)
@click.option(
    "--color-error",
    type=click.FloatRange(0, min_open=True),
    metavar="SHARE",
    help="Root mean square off of a mesh's colours: 0.025.",
)
@click.option(
    "--max-error",
    type=click.FloatRange(0, min_open=True),
    metavar="SHARE",
    help="Mean distance off at the surface, in radii of the shape: 0.00015 of solids, 0.0001 of flat shapes; "
    "root mean square off of a texture's colours: 0.01.",
)
@click.option(
    "--budget",
    type=click.FloatRange(0, min_open=True),
    default=math.inf,
    metavar="SECONDS",
    help="Begin nothing new after this time, for each file.",
)
@click.option(
    "--steps", type=click.IntRange(1), metavar="N", help="Try so many forms at most, whatever the time."
)
@click.option("--license", metavar="TEXT", help="Of the originals; kept in the file.")
@click.option("--source", metavar="TEXT", help="Where they are from; kept in the file.")
@options.cluster
@click.option("--preview", metavar="OUT.png", help="A picture of all elements of the file.")
def command(
    files: tuple[str, ...],
    out: str,
    name: str | None,
    pictures: Literal["texture", "outline"],
    texels: int,
    sign: Sign,
    parts: bool | None,
    color_error: float | None,
    max_error: float | None,
    budget: float,
    steps: int | None,
    license: str | None,
    source: str | None,
    cluster: str | None,
    preview: str | None,
) -> None:
    """Make meshes and drawings elements, which scenes import.

    Meshes (.obj, .ply, .stl, .glb) become solids, what a drawing (.svg) paints a flat shape, and pictures
    (.png, .jpg) textures.

    What comes out is no network: a grid of distances, or a compressed picture, the smallest that is as near
    as asked. A shape lies in the unit ball or disc, the middle of its bounding box at the origin; a texture
    fills the square [-1, 1]², whatever its sides. A file of elements that exists
    gets the new ones beside its own, each when it is done. The same command again takes up what was
    interrupted.

    A scene says: import "zoo.safetensors" as zoo; zoo.cow { … }
    """
    from scenelang.elements.zoo import SUFFIX, load_zoo
    from scenelang.fitting.learn import learn, names_of
    from scenelang.fitting.making import Wish
    from scenelang.fitting.mesh import FitError

    if not out.endswith(SUFFIX):
        raise click.UsageError(f"`{out}` does not end in {SUFFIX}.")
    if preview is not None:
        targets(["preview"], preview)
    try:
        wish = Wish(sign, max_error, budget, steps, license, source, pictures, texels, parts, color_error)
        names_of(files, wish, name)
    except ValueError as error:
        raise click.UsageError(f"{error}.") from None
    try:
        with Bar() as bar:
            say = partial(click.echo, err=True)
            learn(files, out, wish, name=name, cluster=cluster, say=say, progress=bar)
    except FitError as error:
        for line in str(error).split("\n"):
            say_trouble(line)
        raise click.exceptions.Exit(Trouble.exit_code) from None
    if preview is not None:
        from scenelang.backend.thumbnail import sheet

        sheet(load_zoo(out).elements).save(preview)
