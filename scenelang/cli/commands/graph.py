"""``scenelang graph``: a picture of a scene's tree, of the compiler's graph or of a program."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble
from scenelang.cli.say import put_out

if TYPE_CHECKING:
    from scenelang.cli.inputs import Request

_PATIENCE_S: Final = 60
_SUFFIXES: Final = (".mmd", ".dot", ".svg", ".png")


@click.command("graph")
@click.argument("file", metavar="FILE")
@click.option(
    "-o", "--out", metavar="OUT", help="File to write: .mmd (Mermaid), .dot, .svg or .png (Graphviz)."
)
@click.option(
    "--to",
    "kind",
    type=click.Choice(["mmd", "dot", "svg", "png"]),
    help="Format to write; by default the one of OUT's suffix, else mmd.",
)
@click.option(
    "--after",
    "stage",
    default="scene",
    show_default=True,
    metavar="STAGE",
    help="Stage to draw: scene, lower, a pass, or program.",
)
@click.option(
    "--most",
    type=click.IntRange(1, 10_000),
    metavar="N",
    default=200,
    show_default=True,
    help="Largest number of boxes to draw.",
)
@options.request
@click.pass_context
def command(
    ctx: click.Context, file: str, out: str | None, kind: str | None, stage: str, most: int, request: Request
) -> None:
    """Draw the graph of a scene: its tree with transforms, materials and booleans.

    FILE is a scene, or - for standard input. Mermaid and DOT are text; .svg and .png need the program `dot`
    of Graphviz. Large scenes are cut, and a box says how many nodes are left out.
    """
    from scenelang.cli.jobs import STAGES, check_stages, prepare_scene
    from scenelang.interchange.drawing import draw_graph, draw_program, draw_scene, to_dot, to_mermaid

    wanted = _kind(out, kind)
    check_stages((stage,), STAGES[1:])
    dot = _find_dot(wanted)
    job, source = prepare_scene(file, request)
    if job.failed() or source.scene is None or job.program is None:
        ctx.exit(1)
    if stage == "scene":
        drawing = draw_scene(source.scene, most)
    elif stage == "program":
        drawing = draw_program(job.program, most)
    else:
        drawing = draw_graph(job.graphs[stage], most)
    if wanted == "mmd":
        put_out(to_mermaid(drawing), out)
    else:
        text = to_dot(drawing)
        put_out(text if dot is None else _picture(dot, wanted, text), out)


def _kind(out: str | None, kind: str | None) -> str:
    if kind is not None:
        return kind
    if out is None or out == "-":
        return "mmd"
    if (suffix := Path(out).suffix.lower()) not in _SUFFIXES:
        raise click.UsageError(f"`{out}` has none of the suffixes {', '.join(_SUFFIXES)}; say one with --to.")
    return suffix[1:]


def _find_dot(kind: str) -> str | None:
    """The program that draws, where one is needed."""
    if kind in ("mmd", "dot"):
        return None
    found = shutil.which("dot")
    if found is None:
        raise click.UsageError(
            f".{kind} needs Graphviz, whose program `dot` is not here: install the package `graphviz`, "
            "or write .dot or .mmd, which need nothing."
        )
    return found


def _picture(dot: str, kind: str, text: str) -> bytes:
    try:
        done = subprocess.run(
            [dot, f"-T{kind}"], input=text.encode(), capture_output=True, timeout=_PATIENCE_S, check=False
        )
    except subprocess.TimeoutExpired:
        raise Trouble(f"dot took more than {_PATIENCE_S} seconds; draw fewer boxes with --most") from None
    if done.returncode != 0 or not done.stdout:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise Trouble(f"dot failed{f': {said[0]}' if said else ''}")
    return done.stdout
