"""The command line: ``scenelang COMMAND``. Exit codes: 0 good, 1 a scene has errors, 2 usage or I/O."""

from __future__ import annotations

import importlib
import io
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from keyword import iskeyword
from typing import Any, Final

import click

from scenelang.backend.errors import RenderError
from scenelang.files import NotWritten

# Command -> what `--help` says. Each lies in `scenelang/cli/<command>.py` as `command`, imported when called;
# a keyword's file ends in an underscore, and a dash is one.
COMMANDS: Final = {
    "render": "Draw scenes or compiled programs.",
    "check": "Report what is wrong with scenes.",
    "fmt": "Lay scenes out in the one canonical way.",
    "compile": "Compile a scene to a program.",
    "compare": "Draw a scene beside its exact picture.",
    "models": "List models, or tell about one.",
    "eval": "Measure a model on unseen scenes.",
    "frontier": "Measure speed against error of every way to draw.",
    "stability": "Measure a model far beyond its training.",
    "train": "Train a model's weights.",
    "experiment": "Train several designs alike and compare them.",
    "chart": "Draw tables and charts of experiments.",
    "watch": "Draw a scene again whenever it is saved.",
    "lsp": "Serve editors over the Language Server Protocol.",
    "explain": "Say what a diagnostic's code means.",
    "convert": "Write a scene as text, JSON or Python.",
    "import": "Make a scene of a glTF file's nodes.",
    "dump": "Show what a scene is after each stage.",
    "graph": "Draw the graph of a scene.",
    "explain-plan": "Say what drawing a scene takes.",
    "schema": "Print the JSON Schema of scenes.",
}
INTERRUPTED: Final = 130  # as shells report it


class Trouble(click.ClickException):
    """What is neither a scene's mistake nor a bug: files that cannot be read or written, a missing device."""

    exit_code = 2


class _Commands(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = f"scenelang.cli.{cmd_name.replace('-', '_')}{'_' if iskeyword(cmd_name) else ''}"
        command: click.Command = importlib.import_module(module).command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from difflib import get_close_matches

            near = get_close_matches(args[0], COMMANDS, 1)
            advice = f" Did you mean '{near[0]}'?" if near else ""
            ctx.fail(f"No such command '{args[0]}'.{advice}")
        return super().resolve_command(ctx, args)

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        with _told():
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> object:
        with _told():
            return super().invoke(ctx)


@contextmanager
def _told() -> Iterator[None]:
    """What goes wrong without being a bug, told in a line."""
    try:
        yield
    except KeyboardInterrupt:
        raise click.exceptions.Exit(INTERRUPTED) from None
    except BrokenPipeError:
        raise  # whoever reads our output has enough; click ends the process quietly
    except OSError as error:
        raise Trouble(describe(error)) from None
    except RenderError as error:
        raise Trouble(str(error)) from None
    except (click.ClickException, click.exceptions.Exit, click.exceptions.Abort):
        raise
    except Exception as error:
        from scenelang.models.weights import ModelError

        if isinstance(error, ModelError):
            raise Trouble(str(error)) from None
        raise


def describe(error: OSError) -> str:
    """A system error in a line."""
    reason = (error.strerror or str(error) or "unreadable").lower()
    if isinstance(error, NotWritten):
        return f"cannot write '{error.filename}': {reason}"
    return f"{error.filename}: {reason}" if error.filename else reason


@click.group(
    cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(package_name="scenelang", message="%(prog)s %(version)s")
def cli() -> None:
    """Render 2D scenes, written as text, with a trained neural network.

    Try: scenelang render examples/chain.nsg -o chain.png
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and exit.

    Args:
        arguments: as after ``scenelang``; by default the process's.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a scene's text may not fit the terminal's encoding
            stream.reconfigure(errors="backslashreplace")
    try:
        cli.main(args=None if arguments is None else list(arguments), prog_name="scenelang")
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None
