"""Diagnostics as text for people, with marked source lines, and for machines; the exception with them.

Nothing in a scene may move the cursor or colour a terminal: what does not print is shown as U+FFFD. Words
stand beside the last mark of a line, those of others below it, each under its own mark; of a mark over
several lines the first is underlined. Tabs are widened and wide characters take two cells.

For machines there are JSON, SARIF 2.1.0, GitHub annotations and one line each; there lines and columns count
from 1, in code points, and ends are exclusive.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any
from unicodedata import category, east_asian_width

from scenelang.language.diagnostics import Diagnostic, Edit, Fix, SourceFile, Span, plural

_TAB = 4
_LONGEST = 4000
"""Code points of a line that are laid out at most: a file of one line may have 10 MB and 200 mistakes."""
_BEFORE = 500  # of these so many, about, before what is shown
_LEAST_WIDTH = 30

STYLES = {
    "error": "\x1b[1;31m",
    "warning": "\x1b[1;33m",
    "frame": "\x1b[1;34m",
    "bold": "\x1b[1m",
    "added": "\x1b[32m",
    "removed": "\x1b[31m",
    "off": "\x1b[0m",
}


def printable(text: str) -> str:
    """Text without control characters and invisible ones that reorder it."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else "\N{REPLACEMENT CHARACTER}" for char in text)


def paint(style: str, text: str, color: bool) -> str:
    return f"{STYLES[style]}{text}{STYLES['off']}" if color and style and text else text


class _Row:
    """One source line in cells of a screen, cut to ``width`` around columns ``first`` to ``last``, from 0.

    ``words`` more cells behind them are shown where there is room.
    """

    def __init__(self, text: str, first: int, last: int, width: int, words: int = 0) -> None:
        self._cut = max(0, first - _BEFORE) // _BEFORE * _BEFORE if len(text) > _LONGEST else 0
        self._moved = 0
        text = text[self._cut : self._cut + _LONGEST]
        cells: Sequence[str]  # what stands in each; empty behind a wide character
        self._starts: Sequence[int]  # the cell of each code point, and after the last where the line ends
        if text.isascii() and text.isprintable():
            cells, self._starts = text, range(len(text) + 1)
        else:
            cells, self._starts = _cells(text)
        left, right = self.cell(first), self.cell(last)
        right += words if right + words - left < width else 0
        if len(cells) > width:
            start = 0
            if right >= width:
                spare = width - 2 - (right - left)
                start = left - 1 - (spare // 2 if spare > 0 else 4)
                start = max(0, min(start, max(len(cells), right + 1) - width))
            end = min(len(cells), start + width)
            shown = list(cells[start:end])
            # A cut may go through a wide character; the half that is left becomes a space.
            if start:
                shown[:2] = ["…", *(cell or " " for cell in shown[1:2])]
            if end < len(cells):
                shown[-2:] = [*(shown[-2:-1] if shown[-1] else " "), "…"]
            cells, self._moved = shown, start
        self.size = len(cells)
        self.text = "".join(cells).rstrip()

    def cell(self, column: int) -> int:
        """The cell of a column; past the end the line goes on in single cells."""
        index = max(column - self._cut, 0)
        beyond = max(index - len(self._starts) + 1, 0)
        return self._starts[index - beyond] + beyond - self._moved


def _cells(text: str) -> tuple[list[str], list[int]]:
    cells: list[str] = []
    starts = []
    for char in text:
        starts.append(len(cells))
        if char == "\t":
            cells += [" "] * _TAB
        elif category(char) in ("Mn", "Me") and char.isprintable():
            cells[-1:] = [cells[-1] + char] if cells else []
        else:
            cells += [printable(char), ""] if east_asian_width(char) in "WF" else [printable(char)]
    return cells, [*starts, len(cells)]


Mark = tuple[int, int, str, str]
"""Cells from and to which something is underlined, the sign and the style."""


def _underlines(marks: Iterable[Mark], color: bool) -> str:
    """One row of underlines, later ones over earlier ones."""
    row: list[tuple[str, str]] = []
    for start, stop, sign, style in marks:
        row += [(" ", "")] * (stop - len(row))
        row[start:stop] = [(sign, style)] * (stop - start)
    runs = groupby(row, key=lambda cell: cell[1])
    return "".join(paint(style, "".join(sign for sign, _ in run), color) for style, run in runs)


Note = tuple[Span, str, str]
"""A place in a text, what is said there, and the style: `frame` for all but the place of the mistake."""


def _draw(notes: Sequence[Note], gutter: int, width: int, color: bool) -> list[str]:
    """The notes of one diagnostic, that of the mistake first, file by file."""
    files: dict[SourceFile, dict[int, list[Note]]] = {}
    for note in notes:
        files.setdefault(note[0].source, {}).setdefault(note[0].locate()[0][0], []).append(note)
    bare = paint("frame", " " * gutter + " |", color)
    rows = []
    for index, (source, lines) in enumerate(files.items()):
        line, column = next(iter(lines.values()))[0][0].locate()[0]
        arrow = paint("frame", " " * gutter + (":::" if index else "-->"), color)
        rows += [bare] if index else []
        rows += [f"{arrow} {printable(source.name)}:{line}:{column}", bare]
        before = 0
        for number in sorted(lines | {n + 1: [] for n in lines if n + 2 in lines and n + 1 not in lines}):
            if before and number > before + 1:
                rows.append(paint("frame", "...", color))
            before = number
            head = paint("frame", f"{number:>{gutter}} |", color)
            for text in _line(source.line(number), number, lines.get(number, []), width, color):
                rows.append(f"{head} {text}" if text else head)
                head = bare
    return rows


def _line(text: str, number: int, notes: Sequence[Note], width: int, color: bool) -> list[str]:
    """One source line, its underlines, and words beside and below them."""
    places = []
    for note in notes:
        (_, first), (bottom, last) = note[0].locate()
        stop = last - 1 if bottom == number else len(text)
        places.append((first - 1, max(stop, first), note))
    places.sort(key=lambda place: place[:2])
    ends = max((stop for _, stop, _ in places), default=0)
    words = len(places[-1][2][1]) + 1 if places else 0
    row = _Row(text, min((start for start, _, _ in places), default=0), ends, width, words)
    marks = []
    for first, last, (_, said, style) in places:
        start = min(max(row.cell(first), 0), row.size)
        marks.append((start, max(min(row.cell(last), row.size), start + 1), said, style))
    order = sorted(marks, key=lambda mark: (mark[3] != "frame", mark[0] - mark[1]))
    under = _underlines([(a, b, "-" if style == "frame" else "^", style) for a, b, _, style in order], color)
    ends = max((stop for _, stop, _, _ in marks), default=0)
    below = []
    beside = ""
    for start, stop, said, style in reversed(marks):
        if said and stop == ends and not beside:
            beside = f" {paint(style, printable(said), color)}"
        elif said:
            below.append(" " * start + paint(style, printable(said), color))
    return [row.text, *([under + beside] if marks else []), *below]


WIDTH = 140
"""Cells of a line where no terminal says otherwise."""
_MOST_LINES = 6
"""Lines of a change that are shown at most."""


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """All diagnostics as every format gives them: by file, place and code; what has no place comes first."""

    def key(d: Diagnostic) -> tuple[str, int, int, str]:
        return (d.span.source.name, d.span.start, d.span.end, d.code) if d.span else ("", -1, -1, d.code)

    return sorted(diagnostics, key=key)


def render_text(
    diagnostics: Iterable[Diagnostic],
    color: bool = False,
    *,
    width: int = WIDTH,
    most: int | None = None,
    summary: bool = True,
    fixer: str = "scenelang check --fix",
    fixable: int | None = None,
) -> str:
    """Snippets with marks, and a line that counts the diagnostics; empty where there are none.

    Args:
        diagnostics: in any order.
        color: with ANSI colours.
        width: cells of the screen; longer source lines are shown around their marks only.
        most: show so many at most; the rest is only counted.
        summary: whether to count.
        fixer: the command that applies fixes, for the summary.
        fixable: how many it would apply; by default all that there are.
    """
    if not (ordered := in_order(diagnostics)):
        return ""
    blocks = [_block(diagnostic, width, color) for diagnostic in ordered[:most]]
    if most is not None and len(ordered) > most:
        left = len(ordered) - most
        blocks.append(paint("bold", f"… and {left:,} more", color))
    if summary:
        if fixable is None:
            fixable = sum(d.fix is not None for d in ordered)
        blocks.append(_count(ordered, fixer, fixable, color))
    return "\n\n".join(blocks) + "\n"


def _count(found: Sequence[Diagnostic], fixer: str, fixable: int, color: bool) -> str:
    errors = sum(d.severity == "error" for d in found)
    warnings = len(found) - errors
    parts = [plural(n, noun) for n, noun in ((errors, "error"), (warnings, "warning")) if n]
    text = paint("error" if errors else "warning", ", ".join(parts), color)
    return f"{text}; {fixable:,} fixable with `{fixer}`" if fixable else text


def _block(diagnostic: Diagnostic, width: int, color: bool) -> str:
    severity, fix = diagnostic.severity, diagnostic.fix
    head = paint(severity, f"{severity}[{diagnostic.code}]", color)
    lines = [head + paint("bold", f": {printable(diagnostic.message)}", color)]
    notes: list[Note] = [(diagnostic.span, "", severity)] if diagnostic.span is not None else []
    notes += [(label.span, label.message, "frame") for label in diagnostic.labels]
    rows = [1, *(span.locate()[1][0] for span, _, _ in notes)]
    edits = fix.edits if fix else ()
    rows += [e.span.locate()[0][0] + max(e.span.text.count("\n"), e.replacement.count("\n")) for e in edits]
    gutter = len(str(max(rows)))
    room = max(width - gutter - 3, _LEAST_WIDTH)
    lines += _draw(notes, gutter, room, color)
    said = (("help", diagnostic.help), ("fix", fix.message if fix else None))
    advice = [f"{paint('bold', word, color)}: {printable(text)}" for word, text in said if text is not None]
    if advice and notes:
        lines.append(paint("frame", " " * gutter + " |", color))
    lines += [paint("frame", " " * gutter + " =", color) + f" {text}" for text in advice]
    if fix is not None:
        lines += _preview(fix, gutter, room, color)
    return "\n".join(lines)


def _preview(fix: Fix, gutter: int, width: int, color: bool) -> list[str]:
    """Lines with what is inserted underlined by `+`; other changes as the lines before and after."""
    edits = sorted(fix.edits, key=lambda edit: (edit.span.start, edit.span.end))
    if not edits or any(edit.span.source is not edits[0].span.source for edit in edits):
        return []
    bare = paint("frame", " " * gutter + " |", color)
    rows = [bare]
    before = 0
    for first, last, own in _places(edits):
        if before and first > before + 1:
            rows.append(paint("frame", "...", color))
        before = last
        source, start = own[0].span.source, own[0].span.start - own[0].span.locate()[0][1] + 1
        stop = start
        for _ in range(first, last + 1):
            stop = source.text.find("\n", stop) + 1 or len(source.text) + 1
        old = source.text[start:stop]
        new, at = "", 0
        marks: list[tuple[int, int]] = []  # columns of what is inserted, without spaces at its ends
        for edit in own:
            new += old[at : edit.span.start - start]
            text = edit.replacement
            marks.append((len(new) + len(text) - len(text.lstrip()), len(new) + len(text.rstrip())))
            new += text
            at = edit.span.end - start
        new += old[at:]
        if all(edit.span.start == edit.span.end and "\n" not in edit.replacement for edit in own):
            row = _Row(new.removesuffix("\n").removesuffix("\r"), marks[0][0], marks[-1][1], width)
            places = [(max(row.cell(a), 0), min(row.cell(b), row.size), "+", "added") for a, b in marks]
            under = _underlines([place for place in places if place[0] < place[1]], color)
            head = paint("frame", f"{first:>{gutter}} |", color)
            rows += [f"{head} {row.text}", f"{bare} {under}".rstrip()]
            continue
        for sign, text, style in (("-", old, "removed"), ("+", new, "added")):
            lines = text.removesuffix("\n").split("\n") if text.strip() or sign == "-" else []
            for offset, line in enumerate(lines[:_MOST_LINES]):
                near = 0 if offset else own[0].span.start - start
                row = _Row(line.rstrip("\r"), near, near, width)
                shown = paint(style, f"{sign} {row.text}".rstrip(), color)
                rows.append(f"{paint('frame', f'{first + offset:>{gutter}}', color)} {shown}")
            rows += [paint("frame", "...", color)] * (len(lines) > _MOST_LINES)
    return rows


def _places(edits: list[Edit]) -> list[tuple[int, int, list[Edit]]]:
    """Edits together with those on the same lines: first line, last line, edits."""
    places: list[tuple[int, int, list[Edit]]] = []
    for edit in edits:
        (first, _), (last, column) = edit.span.locate()
        if last > first and column == 1 and (not edit.replacement or edit.replacement.endswith("\n")):
            last -= 1  # it takes whole lines
        if places and places[-1][1] >= first:
            places[-1] = (places[-1][0], max(last, places[-1][1]), [*places[-1][2], edit])
        else:
            places.append((first, last, [edit]))
    return places


class SceneError(Exception):
    """Raised by the library where a scene has errors; ``diagnostics`` is all that was found."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)

        super().__init__(render_text(self.diagnostics, fixable=0))


def render_json(diagnostics: Iterable[Diagnostic]) -> str:
    """``{"version": 1, "diagnostics": […]}``; places are null where a diagnostic has none."""
    data = {"version": 1, "diagnostics": [_plain(d) for d in in_order(diagnostics)]}
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


def _plain(diagnostic: Diagnostic) -> dict[str, Any]:
    fix = diagnostic.fix
    edits = [{**_place(edit.span), "replacement": edit.replacement} for edit in fix.edits] if fix else []
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "message": diagnostic.message,
        **_place(diagnostic.span),
        "labels": [{"message": label.message, **_place(label.span)} for label in diagnostic.labels],
        "help": diagnostic.help,
        "fix": {"message": fix.message, "edits": edits} if fix else None,
    }


def _place(span: Span | None) -> dict[str, Any]:
    if span is None:
        return {"file": None, "start": None, "end": None}
    start, end = ({"line": line, "column": column} for line, column in span.locate())
    return {"file": span.source.name, "start": start, "end": end}


def render_concise(diagnostics: Iterable[Diagnostic]) -> str:
    """``file:line:column: severity[CODE] message``, a line each."""
    lines = []
    for d in in_order(diagnostics):
        place = ""
        if d.span is not None:
            line, column = d.span.locate()[0]
            place = f"{printable(d.span.source.name)}:{line}:{column}: "
        lines.append(f"{place}{d.severity}[{d.code}] {printable(d.message)}\n")
    return "".join(lines)


def render_github(diagnostics: Iterable[Diagnostic]) -> str:
    """Workflow commands that GitHub shows beside the lines of a pull request."""
    lines = []
    for d in in_order(diagnostics):
        fields: dict[str, str] = {}
        if d.span is not None:
            (line, column), (end_line, end_column) = d.span.locate()
            fields = {"file": _relative(d.span.source.name), "line": str(line), "col": str(column)}
            if end_line != line:
                fields["endLine"] = str(end_line)
            elif end_column > column:
                fields["endColumn"] = str(end_column)
        fields["title"] = d.code
        text = d.message if d.help is None else f"{d.message}\nhelp: {d.help}"
        joined = ",".join(f"{key}={_escaped(value, ':,')}" for key, value in fields.items())
        lines.append(f"::{d.severity} {joined}::{_escaped(text)}\n")
    return "".join(lines)


def _escaped(text: str, further: str = "") -> str:
    """Text with the characters encoded that GitHub's runner decodes, and no others."""
    for char in "%\r\n" + further:
        text = text.replace(char, f"%{ord(char):02X}")
    return text


def render_sarif(diagnostics: Iterable[Diagnostic], version: str | None = None) -> str:
    """A SARIF 2.1.0 log with one run, its rules with the pages that explain them; states a ``version``."""
    ordered = in_order(diagnostics)
    severities = {d.code: d.severity for d in ordered}
    used = sorted(severities)
    rules = [_rule(code, severities[code]) for code in used]
    driver: dict[str, Any] = {"name": "scenelang", "rules": rules}
    if version is not None:
        driver["version"] = version
    errors = sum(d.severity == "error" for d in ordered)
    counts = {"errors": errors, "warnings": len(ordered) - errors}
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(d, used.index(d.code)) for d in ordered],
        "properties": {**counts, "fixable": sum(d.fix is not None for d in ordered)},
    }
    log = {"$schema": "https://json.schemastore.org/sarif-2.1.0.json", "version": "2.1.0", "runs": [run]}
    return json.dumps(log, indent=2, ensure_ascii=False) + "\n"


def _rule(code: str, severity: str) -> dict[str, Any]:
    """Rule of a code as viewers show it: title, meaning and page."""
    from scenelang.language.pages import read_page

    rule: dict[str, Any] = {"id": code, "defaultConfiguration": {"level": severity}}
    try:
        page = read_page(code)
    except KeyError:  # a diagnostic of somebody else's making
        return rule | {"shortDescription": {"text": code}}
    rule["shortDescription"] = {"text": page.title}
    rule["fullDescription"] = {"text": " ".join(page.meaning.split())}
    rule["help"] = {"text": page.plain(), "markdown": page.text}
    rule["properties"] = {"tags": [page.area]}
    return rule


def _result(diagnostic: Diagnostic, rule: int) -> dict[str, Any]:
    message = diagnostic.message if diagnostic.help is None else f"{diagnostic.message}; {diagnostic.help}"
    result: dict[str, Any] = {
        "ruleId": diagnostic.code,
        "ruleIndex": rule,
        "level": diagnostic.severity,
        "message": {"text": message},
    }
    if diagnostic.span is not None:
        result["locations"] = [_location(diagnostic.span)]
    if diagnostic.labels:
        result["relatedLocations"] = [
            {"id": number, **_location(label.span), "message": {"text": label.message}}
            for number, label in enumerate(diagnostic.labels)
        ]
    if diagnostic.fix is not None:
        changes: dict[str, list[dict[str, Any]]] = {}
        for edit in diagnostic.fix.edits:
            replacement = {"deletedRegion": _region(edit.span), "insertedContent": {"text": edit.replacement}}
            changes.setdefault(_uri(edit.span.source.name), []).append(replacement)
        files = [{"artifactLocation": {"uri": uri}, "replacements": own} for uri, own in changes.items()]
        result["fixes"] = [{"description": {"text": diagnostic.fix.message}, "artifactChanges": files}]
    return result


def _location(span: Span) -> dict[str, Any]:
    place = {"artifactLocation": {"uri": _uri(span.source.name)}, "region": _region(span)}
    return {"physicalLocation": place}


def _region(span: Span) -> dict[str, int]:
    (line, column), (end_line, end_column) = span.locate()
    return {"startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column}


def _relative(name: str) -> str:
    """A file name as seen from the working folder, with `/`; absolute where it lies outside."""
    if os.path.isabs(name):
        here = os.path.join(os.getcwd(), "")
        name = name[len(here) :] if name.startswith(here) else name
    return name.replace("\\", "/")


def _uri(name: str) -> str:
    from urllib.parse import quote

    path = _relative(name)
    try:
        path = quote(path.encode("utf-8", "surrogateescape"), safe="/~")  # names not in UTF-8
    except UnicodeEncodeError:
        path = quote(path.encode("utf-8", "surrogatepass"), safe="/~")
    return f"file://{path}" if path.startswith("/") else path
