"""``scenelang import``: a glTF node hierarchy as scene text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble
from scenelang.cli.say import put_out, say_diagnostics

if TYPE_CHECKING:
    from scenelang.interchange.gltf import Imported

_MOST_SHOWN: Final = 20
_SUFFIXES: Final = (".gltf", ".glb")


@click.command("import")
@click.argument("file", metavar="FILE")
@click.option("-o", "--out", metavar="OUT", help="File to write instead of standard output, .nsg or .json.")
@options.choice(
    "--plane",
    words="xy xz",
    help="Plane that a 2D model draws of 3D: xy from the front, or xz, the ground, from above.",
)
@options.model
@click.option("--strict", is_flag=True, help="Write nothing if anything of the file would be left out.")
@click.pass_context
def command(
    ctx: click.Context,
    file: str,
    out: str | None,
    plane: Literal["xy", "xz"],
    model: str | None,
    strict: bool,
) -> None:
    """Make a scene of the nodes of a glTF 2.0 file (.gltf or .glb).

    Nodes become groups with their transforms. A node becomes an object where its name or its mesh's is
    that of a geometry of the model; case and endings such as .001 do not count. It gets the base colour of
    its material. 3D scenes have the file's first perspective camera and its first point light. What is left
    out is said, with the path of its node.
    """
    from scenelang.diagnostics.diagnostic import Diagnostics
    from scenelang.interchange.gltf import load_gltf
    from scenelang.interchange.gltf_file import GltfError
    from scenelang.models.manifest import load_manifest
    from scenelang.passes import check_scene

    if not file.lower().endswith(_SUFFIXES):
        raise click.UsageError(f"`{file}` is not a .gltf or .glb file.")
    try:
        made = load_gltf(file, model=model, plane=plane)
    except GltfError as error:
        raise Trouble(f"{file}: {error}") from None
    more = len(made.left_out) - _MOST_SHOWN
    for line in (*made.left_out[:_MOST_SHOWN], *([f"{more:,} more"] if more > 0 else ())):
        click.echo(f"left out: {line}", err=True)
    if not made.objects:
        raise Trouble(f"{file}: no node is named like a geometry of {made.scene.model}")
    if strict and made.left_out:
        ctx.exit(1)
    found = Diagnostics()
    check_scene(made.scene, None, found, load_manifest(made.scene.model or ""))
    say_diagnostics(found)
    put_out(_written(made, out), out)
    ctx.exit(int(bool(found.errors)))


def _written(made: Imported, out: str | None) -> str:
    from scenelang.scene.json import to_readable_json
    from scenelang.scene.text import to_nsg

    if out is not None and out.endswith(".json"):
        return to_readable_json(made.scene)
    return to_nsg(made.scene, {key: path.rpartition("/")[2] for key, path in made.names.items()})
