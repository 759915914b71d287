"""``scenelang play``: a page of this machine that edits scenes and shows them."""

from __future__ import annotations

from pathlib import Path

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble

NEW = "nsg 1;\n\nsquare { scale(0.6); material flat { color(#2a6f97); } }\n"  # as the page's own
_PARTS = ("starlette", "uvicorn", "websockets", "watchfiles", "pygls", "lsprotocol")


@click.command("play")
@click.argument("path", default=".", metavar="[SCENE | FOLDER]", type=click.Path(path_type=Path))
@options.count("--port", high=65535, help="Port to listen on; by default 8766 or a free one.")
@click.option(
    "--host",
    default="127.0.0.1",
    metavar="H",
    help="Address to listen on; by default one that only this machine reaches.",
)
@click.option("--no-browser", is_flag=True, help="Only print the address.")
@click.option(
    "--root",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder that imports cannot leave; by default each scene's.",
)
def command(path: Path, port: int | None, host: str, no_browser: bool, root: Path | None) -> None:
    """Edit scenes in a browser and see them while typing.

    Opens a page with the scenes of a folder, by default this one. A SCENE that is not there is made. Nobody
    else reaches the page: it listens to this machine alone, and its address holds a token. Ctrl-C ends it,
    with exit code 130.
    """
    try:
        from scenelang.web.folder import Folder, fits
        from scenelang.web.live import Play
        from scenelang.web.server import is_loopback, serve
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in _PARTS:
            raise
        raise Trouble(f"play needs {error.name}: pip install 'scenelang[play]'") from None
    first = None
    if path.suffix == ".nsg" and path.parent.is_dir() and not path.exists() and fits(path.name):
        with path.open("x", encoding="utf-8") as file:
            file.write(NEW)
        click.echo(f"Made {path}.")
    if path.is_file():
        path, first = path.parent, path.name
        if not fits(first):
            raise click.UsageError(f"`{first}` is not the name of a scene, such as scene.nsg.")
    elif not path.is_dir():
        raise click.UsageError(f"there is neither a scene nor a folder `{path}`.")
    if not is_loopback(host):
        click.echo(
            f"Warning: other machines reach {host}. Who gets hold of the address below, which is sent "
            "unencrypted, can read and change the scenes of this folder and have this machine draw.",
            err=True,
        )
    folder = Folder(path, root)
    click.echo(f"Scenes of {folder.path}; Ctrl-C ends it.")
    serve(Play(folder, first), host, port, browser=not no_browser, say=click.echo)
