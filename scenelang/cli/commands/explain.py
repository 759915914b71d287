"""``scenelang explain``: the page of a diagnostic's code."""

from __future__ import annotations

import json
import re
import shutil
import sys
from difflib import get_close_matches

import click

from scenelang.cli import options
from scenelang.cli.say import wants_color
from scenelang.language.pages import AREAS, CODES, Page, read_page
from scenelang.language.reports import paint

_WIDEST = 96


@click.command("explain")
@click.argument("code", required=False)
@click.option("--list", "listed", is_flag=True, help="List all codes, as without a CODE.")
@options.choice("--format", "kind", words="human json", help="Format of pages.")
@options.color
def command(code: str | None, listed: bool, kind: str, color: options.Color) -> None:
    """Say what CODE means, such as E0401, with an example and what to write instead.

    A word instead of a code lists the codes whose pages have it.
    """
    painted = wants_color(sys.stdout, color)
    if code is None or listed:
        _print_list(list(CODES), kind, painted)
        return
    result = re.search(r"[EWew]\d{4}", code)
    wanted = result.group().upper() if result else code.strip()
    if wanted in CODES:
        _print_page(read_page(wanted), kind, painted)
        return
    word, about = _plain(wanted), []
    if len(word) >= 3:
        about = [code for code in CODES if word in _plain(read_page(code).text)]
    if not about:
        near = get_close_matches(wanted.upper(), list(CODES), 3, 0.7)
        advice = "Codes look like E0401 and W0501; `scenelang explain --list` shows all."
        if near:
            advice = f"Did you mean {' or '.join(near)}?"
        raise click.UsageError(f"No code `{code}`. {advice}")
    _print_list(about, kind, painted)


def _plain(text: str) -> str:
    """Lower case, in American spelling."""
    return text.lower().replace("colour", "color").replace("grey", "gray")


def _print_list(codes: list[str], kind: str, painted: bool) -> None:
    if kind == "json":
        data = [{"code": p.code, "severity": p.severity, "title": p.title} for p in map(read_page, codes)]
        click.echo(json.dumps({"version": 1, "codes": data}, indent=2))
        return
    sections = []
    for area, name in AREAS.items():
        pages = [read_page(code) for code in codes if code[1:3] == area]
        if own := [f"  {paint(page.severity, page.code, painted)}  {page.title}" for page in pages]:
            sections.append("\n".join([paint("bold", name, painted), *own]))
    click.echo("\n\n".join(sections), color=True)


def _print_page(page: Page, kind: str, painted: bool) -> None:
    if kind == "json":
        examples = [
            {"kind": e.kind, "language": e.language, "text": e.text, "options": list(e.options)}
            for e in page.examples
        ]
        data = {key: getattr(page, key) for key in ("code", "severity", "area", "title", "text")}
        data = {"version": 1, **data, "examples": examples, "files": dict(page.files)}
        click.echo(json.dumps(data, indent=2, ensure_ascii=False))
        return
    width = min(shutil.get_terminal_size((_WIDEST, 24)).columns, _WIDEST)
    text = page.plain(max(width, 40), lambda text, style: paint(style, text, painted))
    click.echo(text, nl=False, color=True)
