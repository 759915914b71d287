"""Invariants of trees and diagnostics, whatever the text."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import fields, is_dataclass
from itertools import pairwise
from typing import Any

from fuzz.target import Failure, hold
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import parse_program, program_bytes
from scenelang.language import reports
from scenelang.language import tree as nodes
from scenelang.language.diagnostics import Diagnostic, SourceFile, Span
from scenelang.language.pages import CODES
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene


def check_tree(tree: nodes.File, source: SourceFile) -> bool:
    """Spans nest and run forward inside the text; returns whether recovery left a node of its own."""
    hold(type(tree) is nodes.File, "parsing gives a tree", type(tree))
    hold((tree.span.start, tree.span.end) == (0, len(source.text)), "the tree spans the text", tree.span)
    bad = False
    todo: list[tuple[Any, Span]] = [(tree, tree.span)]
    while todo:
        node, around = todo.pop()
        if isinstance(node, tuple):
            todo += [(item, around) for item in node]
        elif isinstance(node, Span):
            hold(node.source is source, "spans are of the text", node)
            hold(around.start <= node.start <= node.end <= around.end, "spans nest", (node, around))
        elif is_dataclass(node):
            bad = bad or isinstance(node, nodes.BadStmt | nodes.BadExpr)
            own: Span = getattr(node, "span", around)
            todo.append((own, around))
            todo += [(getattr(node, field.name), own) for field in fields(node) if field.name != "span"]
    return bad


def check_diagnostics(found: Sequence[Diagnostic], texts: Iterable[SourceFile] | None) -> None:
    """Codes are known, places lie inside their ``texts``, edits do not overlap, and every format renders."""
    known = None if texts is None else list(texts)
    for d in found:
        hold(d.code in CODES, "codes are listed", d.code)
        hold(d.message, "every diagnostic says something", d.code)
        edits = d.fix.edits if d.fix is not None else ()
        spans = [d.span] if d.span is not None else []
        for span in [*spans, *(label.span for label in d.labels), *(edit.span for edit in edits)]:
            inside = 0 <= span.start <= span.end <= len(span.source.text)
            hold(inside, "diagnostics lie inside the text", (d.code, span))
            if known is not None:
                hold(any(span.source is text for text in known), "diagnostics are in the text", d.code)
        ordered = sorted(edits, key=lambda edit: (edit.span.start, edit.span.end))
        for one, other in pairwise(ordered):
            hold(one.span.end <= other.span.start, "edits of a fix do not overlap", d)
    check_rendering(found)


def check_compiling(scene: Scene) -> bytes | None:
    """The bytes of a Scene's Program, which reads back, or none if it is refused with sound diagnostics."""
    try:
        program = compile_scene(scene)
    except SceneError as error:
        check_diagnostics(error.diagnostics, None)
        return None
    written = program_bytes(program)
    hold(program_bytes(parse_program(written)) == written, "Program to bytes and back")
    return written


def check_rendering(found: Sequence[Diagnostic]) -> None:
    """Every format takes the diagnostics, says each once, and lets no text break out of its place."""
    plain = reports.render_text(found)
    hold(all(c.isprintable() or c == "\n" for c in plain), "text output has no control characters", plain)
    coloured = reports.render_text(found, color=True)
    hold("\x1b" not in plain and len(coloured) >= len(plain), "colours only where asked for")
    for name, text in (
        ("json", reports.render_json(found)),
        ("sarif", reports.render_sarif(found)),
    ):
        try:
            data = json.loads(text)
        except ValueError as error:
            raise Failure(f"{name} output is JSON", error) from None
        listed = data["diagnostics"] if name == "json" else data["runs"][0]["results"]
        hold(len(listed) == len(found), f"{name} output has every diagnostic", len(listed))
    concise = reports.render_concise(found)
    hold(concise.count("\n") == len(concise.splitlines()) == len(found), "a line each", concise)
    github = reports.render_github(found)
    hold(github.count("\n") == len(found) and github.count("\r") == 0, "a command each", github)
    starts = all(line.startswith(("::error ", "::warning ")) for line in github.split("\n")[:-1])
    hold(starts, "only commands of our own", github)


def same(one: Sequence[Diagnostic], other: Sequence[Diagnostic]) -> bool:
    """Whether two runs said the same."""
    return list(one) == list(other)
