"""``scenelang learn``: elements from meshes, drawings, pictures and fonts, into a file that scenes import."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import click

from scenelang.assets.element import MOST_PIXELS, TEXELS
from scenelang.assets.element_file import SUFFIX, load_element_file
from scenelang.cli import options
from scenelang.cli.files import targets
from scenelang.cli.main import Trouble
from scenelang.cli.say import Bar


@click.command("learn")
@click.argument("files", metavar="FILE…", nargs=-1, required=True)
@options.writes("ZOO", "File of elements to write or to add to, .safetensors.")
@click.option("--name", metavar="NAME", help="Name of the element; by default the file's.")
@options.choice(
    "--as", "pictures", words="texture outline", help="Element to make of a picture: a material, or the "
    "flat shape of its opaque or, without transparency, dark part.",
)  # fmt: skip
@options.count(
    "--texels", high=MOST_PIXELS, default=TEXELS,
    help="Texels of a texture along its longer side, at most; larger pictures are made smaller.",
)  # fmt: skip
@options.choice(
    "--sign", words="auto winding closed", help="Test for the inside: winding numbers, of any mesh, or "
    "normals, of a closed one that nowhere passes through itself; auto is winding.",
)  # fmt: skip
@click.option(
    "--parts/--together", default=None, help="Make parts elements of their own too: solids that a mesh file "
    "names, areas of one colour; by default those of drawings.",
)  # fmt: skip
@options.positive(
    "--color-error", "SHARE", "Largest root mean square error of a mesh's colours; by default 0.025.", high=1
)
@options.positive(
    "--max-error", "SHARE", "Largest mean error of distances at the surface, in radii of the shape, by "
    "default 0.00015 for solids and 0.0001 for flat shapes; of a texture the root mean square error of its "
    "colours, by default 0.01.", high=1,
)  # fmt: skip
@click.option("--letters", metavar="RANGES", help="Letters to take of a font, U+20-7E,U+3B1; by default all.")
@click.option("--font", metavar="FONT.ttf", help="Font for texts of drawings; else std/letters.")
@options.positive("--budget", "SECONDS", "Time after which nothing new is begun, for each file.")
@options.count("--steps", help="Largest number of forms to try, whatever the time.")
@click.option("--license", metavar="TEXT", help="License of the originals, kept in the file.")
@click.option("--source", metavar="TEXT", help="Origin of the originals, kept in the file.")
@options.cluster
@click.option("--preview", metavar="OUT.png", help="Write a picture of all elements of the file.")
def command(
    files: tuple[str, ...],
    out: str,
    name: str | None,
    budget: float | None,
    cluster: str | None,
    preview: str | None,
    **given: Any,  # fields of `LearnOptions` by their names
) -> None:
    """Make meshes, drawings and fonts elements, which scenes import.

    Meshes (.obj, .ply, .stl, .glb) become solids, what a drawing (.svg) paints a flat shape, and pictures
    (.png, .jpg) textures. A font (.ttf, .otf) brings the file the module text and the function width.

    What comes out is no network: a grid of distances, or a compressed picture, the smallest that is as near
    as asked. A shape lies in the unit ball or disc, the middle of its bounding box at the origin; a texture
    fills the square [-1, 1]², whatever its sides. A file of elements that exists
    gets the new ones beside its own, each when it is done. The same command again takes up what was
    interrupted.

    A scene says: import "zoo.safetensors" as zoo; zoo.cow { … }
    """
    from scenelang.drawing.exact.mesh import FitError
    from scenelang.inverse.learn import LearnOptions, learn_files, names_of

    if not out.endswith(SUFFIX):
        raise click.UsageError(f"`{out}` does not end in {SUFFIX}.")
    if preview is not None:
        targets(["preview"], preview)
    try:
        wishes = LearnOptions(budget_s=budget or math.inf, **given)
        names_of(files, wishes, name)
    except ValueError as error:
        raise click.UsageError(f"{error}.") from None
    try:
        with Bar() as bar:
            say = partial(click.echo, err=True)
            learn_files(files, out, wishes, name=name, cluster=cluster, say=say, progress=bar)
    except FitError as error:
        raise Trouble(str(error).replace("\n", "\nError: ")) from None
    if preview is not None:
        from scenelang.drawing.small import sheet

        sheet(load_element_file(out).elements).save(preview)
