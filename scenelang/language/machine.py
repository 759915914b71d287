"""Diagnostics for machines: JSON, SARIF 2.1.0, GitHub annotations, one line each.

Lines and columns count from 1, in code points; ends are exclusive.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from typing import Any

from scenelang.language.diagnostics import Diagnostic, Span
from scenelang.language.reports import in_order, printable


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
