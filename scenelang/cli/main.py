"""The command line: ``scenelang COMMAND``. Exit codes: 0 good, 1 a scene has errors, 2 usage or I/O."""

from __future__ import annotations

import importlib
import io
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

import click

from scenelang.assets.files import NotWritten, inputs_kept, reason
from scenelang.cli.say import say_diagnostics
from scenelang.drawing.how import RenderError
from scenelang.language.reports import SceneError

# Command -> what `--help` says. Each is `command` in a file of its name, imported when it is called.
COMMANDS: Final = {
    "render": "Draw scenes or compiled programs.",
    "sweep": "Draw a scene with many values of its params.",
    "play": "Edit scenes in a browser and see them.",
    "export": "Write scenes as web pages that draw themselves.",
    "watch": "Draw a scene again whenever it is saved.",
    "check": "Report what is wrong with scenes.",
    "explain": "Say what a diagnostic's code means.",
    "fmt": "Lay scenes out in the one canonical way.",
    "lsp": "Serve editors over the Language Server Protocol.",
    "convert": "Write a scene as text or JSON.",
    "schema": "Print the JSON Schema of scenes.",
    "compile": "Compile a scene to a program.",
    "compare": "Draw a scene beside its exact picture.",
    "fit": "Find the params of a scene from a picture.",
    "dump": "Show or draw what a scene is after each stage, and what it costs.",
    "models": "List models, or tell about one.",
    "learn": "Make meshes and drawings elements of scenes.",
}
GROUPS: Final = {
    "Draw": "render sweep play export watch",
    "Write": "check fmt explain convert learn fit",
    "Measure": "compare dump models",
    "Develop": "compile schema lsp",
}
MOVED: Final = {
    "explain-plan": "is now `scenelang dump --costs`",
    "graph": "is now `scenelang dump --format mmd`",
    "import": "is gone: `scenelang learn --parts` makes elements of a glTF file's meshes",
    "lab": "is now `python -m lab`",
    **{name: f"is now `python -m lab {name}`" for name in ("train", "eval", "frontier", "stability")},
}
"""Answers to commands of earlier versions; the laboratory runs in a clone of the repository."""
INTERRUPTED: Final = 130  # as shells report it


class Trouble(click.ClickException):
    """An error that is neither a scene's mistake nor a bug: an unreadable file, a missing device."""

    exit_code = 2


class Reporting(click.Group):
    """Commands that report errors in one line, unless they are bugs."""

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        with _reporting():
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> object:
        with _reporting(), inputs_kept():
            return super().invoke(ctx)


@contextmanager
def _reporting() -> Iterator[None]:
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
    except SceneError as error:
        say_diagnostics(error.diagnostics)
        raise click.exceptions.Exit(1) from None
    except (click.ClickException, click.exceptions.Exit, click.exceptions.Abort):
        raise
    except Exception as error:
        from scenelang.compiler.weights import ModelError

        if isinstance(error, ModelError):
            raise Trouble(str(error)) from None
        if isinstance(error, ModuleNotFoundError) and error.name == "torch":
            raise Trouble("this needs torch, which is not installed; pip install torch") from None
        raise


class Commands(Reporting):
    """The commands of this package, each imported when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"scenelang.cli.commands.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        widest = max(map(len, COMMANDS))  # so that all groups have their words in one column
        for title, names in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(widest), COMMANDS[name]) for name in names.split()])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from difflib import get_close_matches

            if args[0] in MOVED:
                ctx.fail(f"`{args[0]}` {MOVED[args[0]]}.")
            near = get_close_matches(args[0], COMMANDS, 1)
            advice = f" Did you mean `{near[0]}`?" if near else ""
            ctx.fail(f"No such command `{args[0]}`.{advice}")
        return super().resolve_command(ctx, args)


def describe(error: OSError) -> str:
    """A system error in a line."""
    why = reason(error)
    if isinstance(error, NotWritten):
        return f"cannot write `{error.filename}`: {why}"
    return f"{error.filename}: {why}" if error.filename else why


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="scenelang", message="%(prog)s %(version)s")
def cli() -> None:
    """Draw 2D and 3D scenes, written as text, with trained neural networks.

    Try: scenelang render examples/chain.nsg -o chain.png
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command, by default with the process's arguments, and exit."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a scene's text may not fit the terminal's encoding
            stream.reconfigure(errors="backslashreplace")
    warnings.formatwarning = lambda message, *_, **__: f"Warning: {message}\n"
    try:
        cli.main(args=None if arguments is None else list(arguments), prog_name="scenelang")
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None
