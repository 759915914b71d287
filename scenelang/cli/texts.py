"""Text that a command makes: to standard output, or to a file whole or not at all."""

from __future__ import annotations

import click


def put_text(text: str, out: str | None) -> None:
    """Write text that ends in a newline; ``-`` is standard output.

    Raises:
        OSError: the file cannot be written; nothing is left behind.
    """
    if out is None or out == "-":
        click.echo(text, nl=False)
        return
    from scenelang.files import write_output

    write_output(out, text.encode())
