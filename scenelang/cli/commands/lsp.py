"""``scenelang lsp``: the language server."""

from __future__ import annotations

import logging
import socket
import sys

import click

from scenelang.assets.element import Element
from scenelang.cli import options
from scenelang.cli.main import Trouble


@click.command("lsp")
@click.option("--stdio", is_flag=True, help="Speak over standard input and output; the default.")
@options.count("--tcp", high=65535, metavar="PORT", help="Serve one client on a port of this machine.")
@click.option("--log", type=click.Path(dir_okay=False), metavar="FILE", help="Write a log to a file.")
def command(stdio: bool, tcp: int | None, log: str | None) -> None:
    """Serve an editor over the Language Server Protocol.

    Editors start it themselves; docs/editors.md says how.
    """
    if stdio and tcp is not None:
        raise click.UsageError("--stdio and --tcp exclude each other.")
    try:
        from scenelang.editors.server import make_server
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("pygls", "lsprotocol"):
            raise
        raise Trouble("the language server needs pygls: pip install 'scenelang[lsp]'") from None
    handler = logging.FileHandler(log, encoding="utf-8") if log else logging.StreamHandler()
    logging.basicConfig(
        level=logging.INFO if log else logging.ERROR,
        handlers=[handler],
        format="%(asctime)s %(name)s %(levelname)s %(message)s",
    )
    if not log:  # requests that are refused are answered as such; the library would print a trace
        logging.getLogger("pygls").setLevel(logging.CRITICAL)
    server = make_server(_thumbnail)
    if tcp is None:
        server.start_io(sys.stdin.buffer, sys.stdout.buffer)
    else:
        with socket.create_server(("127.0.0.1", tcp)) as listener:
            connection, _ = listener.accept()
        with connection, connection.makefile("rb") as source, connection.makefile("wb") as answers:
            server.start_io(source, answers)
    if not server.was_shut_down:  # the protocol: an exit that was not announced is a failure
        raise click.exceptions.Exit(1)


def _thumbnail(element: Element) -> bytes:
    """A small PNG; numpy and the rest are imported when the first is asked for."""
    from scenelang.drawing.small import thumbnail

    return thumbnail(element, 96).encode()
