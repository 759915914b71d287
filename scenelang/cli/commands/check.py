"""``scenelang check``: what is wrong with scenes, and fixes; imports neither numpy nor torch."""

from __future__ import annotations

import sys
from codecs import BOM_UTF8
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import click

from scenelang.assets.files import followed, write_whole
from scenelang.cli import inputs
from scenelang.cli.main import describe
from scenelang.cli.say import SUFFIX, named, say_trouble, show_difference, wants_color, width_of
from scenelang.language.diagnostics import plural
from scenelang.language.reports import printable

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from scenelang.cli.checking import Scenes
    from scenelang.cli.inputs import Request
    from scenelang.compiler.check import Frames
    from scenelang.language.diagnostics import Diagnostic, Settled


Format = Literal["human", "json", "sarif", "github", "concise"]


def _codes(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> tuple[str, ...]:
    """Codes of warnings, or beginnings of them, from ``W0501`` and ``W02,W05``."""
    if not values:
        return ()
    from scenelang.language.pages import CODES

    result = [code.strip().upper() for value in values for code in value.split(",") if code.strip()]
    for code in result:
        if not any(known.startswith(code) for known in CODES):
            raise click.BadParameter(f"no code begins with `{code}`", ctx, param)
        if not code.startswith("W"):
            raise click.BadParameter(f"`{code}` is an error, and errors always count", ctx, param)
    return tuple(result)


@click.command("check")
@click.argument("files", nargs=-1, required=True, metavar="PATH…")
@click.option("--fix", "fixes", is_flag=True, help="Apply the safe fixes; report what is left.")
@click.option("--diff", is_flag=True, help="Show what --fix would change, and change nothing.")
@inputs.strict
@click.option("--select", multiple=True, metavar="CODES", callback=_codes, help="Report only these warnings.")
@click.option("--ignore", multiple=True, metavar="CODES", callback=_codes, help="Leave out these warnings.")
@inputs.choice("--format", "kind", words="human json sarif github concise", help="Format of diagnostics.")
@click.option(
    "--max-diagnostics",
    "most",
    type=click.IntRange(0),
    metavar="N",
    help="Largest number to write; all are counted.",
)
@click.option("-q", "--quiet", is_flag=True, help="Write diagnostics and no summary.")
@inputs.color
@click.option("--all-frames", is_flag=True, help="Look at all frames of the animation.")
@inputs.request
@click.pass_context
def command(
    ctx: click.Context,
    files: tuple[str, ...],
    fixes: bool,
    diff: bool,
    strict: bool,
    select: tuple[str, ...],
    ignore: tuple[str, ...],
    kind: Format,
    most: int | None,
    quiet: bool,
    color: inputs.Color,
    all_frames: bool,
    request: Request,
) -> None:
    """Report what is wrong with scenes, without drawing them.

    PATH is a scene, a folder of scenes (*.nsg, also in folders inside; hidden ones and links are passed
    over), or - for standard input; with --fix its text then goes to standard output and everything else to
    standard error. CODES are codes of warnings or beginnings of them: W0501,W02.

    Of an animation the first, second, middle and last frame are looked at.

    Exits with 0 where there are no errors, 1 where there are (or a difference, with --diff), 2 where a file
    cannot be read or written.
    """
    from scenelang.cli.checking import Scenes, Selection
    from scenelang.cli.inputs import STDIN

    if request.frame is not None and all_frames:
        raise click.UsageError("--frame and --all-frames exclude each other.")
    frames: Frames = "all" if all_frames else "some" if request.frame is None else "one"
    scenes = Scenes(request, Selection(select, ignore), frames)
    unreadable = not _read(files, scenes)
    out = _Output(kind, most, quiet, color, (fixes or diff) and STDIN in scenes.sources, scenes)
    if not fixes and not diff:
        left: Sequence[Diagnostic] = scenes.check().items if scenes.sources or scenes.unread.items else ()
        out.write(left)
    else:
        settled = scenes.fix()
        changed = {n: text for n, text in settled.texts.items() if text != scenes.sources[n].text}
        left = [d for _, d in settled.left]
        if diff:
            for name, text in changed.items():
                show_difference(scenes.sources[name].name, scenes.sources[name].text, text, color)
            out.fixed(settled, "would fix")
            ctx.exit(2 if unreadable else int(bool(changed or _wrong(left, strict))))
        lost = _store(changed, settled, scenes)
        unreadable |= bool(lost)
        out.fixed(settled, "fixed", lost)
        out.write(left)
    if all_frames and scenes.unseen:
        click.echo(
            f"{plural(scenes.unseen, 'frame')} left out: together they exceed the limits of one.", err=True
        )
    ctx.exit(2 if unreadable else int(_wrong(left, strict)))


def _read(paths: tuple[str, ...], scenes: Scenes) -> bool:
    """Take in all scenes, folders' too; False where something cannot be read."""

    lost: list[OSError] = []
    names = list(named(paths, lost.append))
    for name in names:
        try:
            scenes.read(name)
        except OSError as error:
            lost.append(error)
    for trouble in lost:
        say_trouble(describe(trouble))
    if not lost and not names:
        say_trouble(f"no scenes (*{SUFFIX}) there")
    return bool(names) and not lost


def _wrong(left: Sequence[Diagnostic], strict: bool) -> bool:
    return any(strict or d.severity == "error" for d in left)


def _store(changed: dict[str, str], settled: Settled[str], scenes: Scenes) -> set[str]:
    """Write what changed, and standard input to standard output; returns what cannot be written."""
    from scenelang.cli.inputs import STDIN

    lost = set()
    for name, text in changed.items():
        if name == STDIN:
            continue
        try:
            with open(name, "rb") as file:
                mark = BOM_UTF8 if file.read(3) == BOM_UTF8 else b""
            write_whole(followed(name), mark + text.encode("utf-8"))
        except OSError as error:
            say_trouble(describe(error))
            lost.add(name)
    if STDIN in scenes.sources:
        sys.stdout.buffer.write(settled.texts[STDIN].encode("utf-8"))
    return lost


@dataclass(frozen=True, slots=True)
class _Output:
    """Writes diagnostics and a summary of scenes; to standard error where a scene goes to the output."""

    kind: Format
    most: int | None
    quiet: bool
    color: inputs.Color
    to_stderr: bool
    scenes: Scenes

    def write(self, found: Sequence[Diagnostic]) -> None:
        """Print diagnostics, or that there are none."""
        stream = sys.stderr if self.to_stderr else sys.stdout
        if self.kind != "human":
            text = _for_machines(found, self.kind, self.most)
        elif found:
            from scenelang.language.reports import in_order, render_text

            text = render_text(
                found,
                wants_color(stream, self.color),
                width=width_of(stream),
                most=self.most,
                summary=not self.quiet,
                fixer="--fix",
                fixable=sum(d.fix is not None and self.scenes.owner(d) is not None for d in found),
            )
            if not self.quiet:
                text += f"For more, try `scenelang explain {in_order(found)[0].code}`.\n"
        else:
            count = len(self.scenes.sources) + len(self.scenes.unread)
            scenes = plural(count, "scene")
            text = f"no mistakes in {scenes}\n" if count and not self.quiet else ""
        click.echo(text, nl=False, err=self.to_stderr, color=True)

    def fixed(self, settled: Settled[str], done: str, lost: Collection[str] = ()) -> None:
        """Say what was fixed, file by file, but for files that could not be written."""

        if self.quiet:
            return
        for name, applied in settled.applied.items():
            if applied and name not in lost:
                codes = ", ".join(sorted({d.code for d in applied}))
                shown = printable(self.scenes.sources[name].name)
                click.echo(f"{shown}: {done} {plural(len(applied), 'mistake')} ({codes})", err=True)
        if not settled.stable:
            click.echo("Some fixes undo each other and were left out.", err=True)


def _for_machines(found: Sequence[Diagnostic], kind: Format, most: int | None) -> str:
    from importlib.metadata import version

    from scenelang.language import machine
    from scenelang.language.reports import in_order

    shown = in_order(found)[:most]
    if kind == "sarif":
        return machine.render_sarif(shown, version("scenelang"))
    renderers = {
        "json": machine.render_json,
        "github": machine.render_github,
        "concise": machine.render_concise,
    }
    return renderers[kind](shown)
