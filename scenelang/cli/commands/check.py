"""``scenelang check``: mistakes of scenes, and fixes; imports neither numpy nor torch."""

from __future__ import annotations

import os
import sys
from codecs import BOM_UTF8
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Literal

import click

from scenelang.assets.files import followed, write_whole
from scenelang.assets.records import Record
from scenelang.cli import options
from scenelang.cli.files import STDIN, scenes_of
from scenelang.cli.inputs import merged, read_input, read_text, unused_defines
from scenelang.cli.main import describe
from scenelang.cli.say import say_trouble, show_difference, wants_color, width_of
from scenelang.compiler.compile import Frames, check_evaluated
from scenelang.language import reports
from scenelang.language.diagnostics import Diagnostic, Diagnostics, Settled, SourceFile, plural, settle
from scenelang.language.reports import in_order, printable, render_text
from scenelang.language.session import Defines

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
@options.strict
@click.option("--select", multiple=True, metavar="CODES", callback=_codes, help="Report only these warnings.")
@click.option("--ignore", multiple=True, metavar="CODES", callback=_codes, help="Leave out these warnings.")
@options.choice("--format", "kind", words="human json sarif github concise", help="Format of diagnostics.")
@options.count("--max-diagnostics", "most", low=0, help="Largest number to write; all are counted.")
@click.option("-q", "--quiet", is_flag=True, help="Write diagnostics and no summary.")
@options.color
@click.option("--all-frames", is_flag=True, help="Look at all frames of the animation.")
@options.request()
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
    color: options.Color,
    all_frames: bool,
    request: options.Request,
) -> None:
    """Report what is wrong with scenes, without drawing them.

    PATH is a scene, a folder of scenes (*.nsg, also in folders inside; hidden ones and links are passed
    over), or - for standard input; with --fix its text then goes to standard output and everything else to
    standard error. CODES are codes of warnings or beginnings of them: W0501,W02.

    Of an animation the first, second, middle and last frame are looked at.

    Exits with 0 where there are no errors, 1 where there are (or a difference, with --diff), 2 where a file
    cannot be read or written.
    """
    if request.frame is not None and all_frames:
        raise click.UsageError("--frame and --all-frames exclude each other.")
    frames: Frames = "all" if all_frames else "some" if request.frame is None else "one"
    scenes = Scenes(request, select, ignore, frames)
    names, readable = scenes_of(files)
    for name in names:
        try:
            scenes.read(name)
        except OSError as error:
            say_trouble(describe(error))
            readable = False
    to_stderr = (fixes or diff) and STDIN in scenes.sources
    left: Sequence[Diagnostic]
    if not fixes and not diff:
        left = scenes.check().items if scenes.sources or scenes.unread.items else ()
    else:
        settled = scenes.fix()
        changed = {n: text for n, text in settled.texts.items() if text != scenes.sources[n].text}
        left = [d for _, d in settled.left]
        wrong = any(strict or d.severity == "error" for d in left)
        if diff:
            for name, text in changed.items():
                show_difference(scenes.sources[name].name, scenes.sources[name].text, text, color)
            lost = set()
        else:
            lost = _store(changed)
            if STDIN in scenes.sources:
                sys.stdout.buffer.write(settled.texts[STDIN].encode("utf-8"))
        if not quiet:
            _say_fixed(scenes, settled, "would fix" if diff else "fixed", lost)
        if diff:
            ctx.exit(2 if not readable else int(bool(changed) or wrong))
        readable &= not lost
    stream = sys.stderr if to_stderr else sys.stdout
    if kind == "human":
        text = _for_people(scenes, left, most, quiet, wants_color(stream, color), width_of(stream))
    else:
        from importlib.metadata import version

        render = getattr(reports, f"render_{kind}")
        text = render(in_order(left)[:most], *[version("scenelang")] * (kind == "sarif"))
    click.echo(text, nl=False, err=to_stderr, color=True)
    if all_frames and scenes.unseen:
        unseen = plural(scenes.unseen, "frame")
        click.echo(f"{unseen} left out: together they exceed the limits of one.", err=True)
    ctx.exit(2 if not readable else int(any(strict or d.severity == "error" for d in left)))


def _store(changed: Mapping[str, str]) -> set[str]:
    """Write files that changed; returns the names of those that cannot be written, after a report."""
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
    return lost


def _say_fixed(scenes: Scenes, settled: Settled[str], done: str, lost: set[str]) -> None:
    """Say what was fixed, file by file, but for files that could not be written."""
    for name, applied in settled.applied.items():
        if applied and name not in lost:
            codes = ", ".join(sorted({d.code for d in applied}))
            shown = printable(scenes.sources[name].name)
            click.echo(f"{shown}: {done} {plural(len(applied), 'mistake')} ({codes})", err=True)
    if not settled.stable:
        click.echo("Some fixes undo each other and were left out.", err=True)


def _for_people(
    scenes: Scenes, left: Sequence[Diagnostic], most: int | None, quiet: bool, paint: bool, width: int
) -> str:
    """Diagnostics with carets and a summary, or that there are none."""
    if not left:
        count = len(scenes.sources) + len(scenes.unread)
        return f"no mistakes in {plural(count, 'scene')}\n" if count and not quiet else ""
    fixable = sum(d.fix is not None and scenes.owner(d) is not None for d in left)
    text = render_text(left, paint, width=width, most=most, summary=not quiet, fixer="--fix", fixable=fixable)
    return text if quiet else f"{text}For more, try `scenelang explain {in_order(left)[0].code}`.\n"


class Scenes(Record, frozen=False):
    """Several scenes that are checked together."""

    request: options.Request  # what holds for all of them
    # codes, or beginnings of codes, of the warnings that are wanted, empty for all, and that are not
    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    frames: Frames = "some"  # those that are checked
    # their texts by the names that the user wrote
    sources: dict[str, SourceFile] = field(default_factory=dict)
    unread: Diagnostics = field(default_factory=Diagnostics)  # of files that are not text
    names: dict[str, str] = field(default_factory=dict)  # by the files' places on the disk
    unseen: int = 0  # frames that were left out, as they exceed the limits of one scene

    def read(self, name: str) -> None:
        """Read a scene, once under any name; raises `OSError` where it cannot be opened."""
        place = _place(name)
        if place not in self.names and (source := read_text(name, self.unread)) is not None:
            self.sources[name], self.names[place] = source, name

    def check(
        self, sources: Mapping[str, SourceFile] | None = None, texts: Mapping[Path, str] | None = None
    ) -> Diagnostics:
        """All diagnostics that are wanted; of other scenes, and imports by resolved paths, if given."""
        # `Defines` record the params that they were used for, so each round needs its own.
        given = self.request.source
        request = replace(self.request, source=replace(given, params=Defines(given.values), texts=texts))
        parts, self.unseen = [self.unread.items], 0
        for name, source in (self.sources if sources is None else sources).items():
            result = read_input(name, request, text=source)
            facts = result.tree, result.evaluation, result.scene, result.spans, result.diagnostics
            self.unseen += check_evaluated(*facts, frames=self.frames)
            parts.append(result.diagnostics.items)
        every = merged([*parts, unused_defines(request)])
        kept = ("E", *(self.select or "W"))
        every.items[:] = [d for d in every if d.code.startswith(kept) and not d.code.startswith(self.ignore)]
        return every

    def owner(self, diagnostic: Diagnostic) -> str | None:
        """The name of the scene that a diagnostic is in; None for an import that was not named."""
        if diagnostic.span is None:
            return None
        name = diagnostic.span.source.name
        return self.names.get(STDIN if name == "<stdin>" else _place(name))

    def fix(self) -> Settled[str]:
        """The texts after all fixes, by the names that the user wrote, and the diagnostics that are left.

        Of imported files only those change that were named too.
        """

        def check(texts: Mapping[str, str]) -> Iterable[tuple[str | None, Diagnostic]]:
            sources = {name: SourceFile(self.sources[name].name, text) for name, text in texts.items()}
            inside = {Path(_place(name)): text for name, text in texts.items() if name != STDIN}
            return [(self.owner(d), d) for d in self.check(sources, inside)]

        return settle({name: source.text for name, source in self.sources.items()}, check)


def _place(name: str) -> str:
    return name if name == STDIN else os.path.realpath(name)
