"""Figures in the prose of pages: each comes from a record, or is given with a reason.

A module of lab/docs/claims/ holds, for the page of its name, CLAIMS, pieces of its text as f-strings whose
figures come from records (``f"the worst of {scenes} at {worst:.1f} dB"``), and GIVEN, pieces of text with
numbers that nothing measured: definitions, caps, sizes. Where a record changes, the page's text is written
again around its words (``python -m lab docs claims``); a figure that neither names is found by a test.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from lab import RESULTS, ROOT

PACKAGE = ROOT / "scenelang/compiler"
OPEN, CLOSE = "\x02", "\x03"  # around what a claim's f-string shows of a record


class Figure(float):
    """A number of a record, which an f-string shows as one that may change."""

    def __format__(self, spec: str) -> str:
        return f"{OPEN}{float(self):{spec or 'g'}}{CLOSE}"

    def __truediv__(self, other: float) -> Figure:
        return Figure(float(self) / other)

    def __mul__(self, other: float) -> Figure:
        return Figure(float(self) * other)

    def __sub__(self, other: float) -> Figure:
        return Figure(float(self) - other)


class Phrase(str):
    """Text of a record, such as a command."""

    def __format__(self, spec: str) -> str:
        return f"{OPEN}{self!s}{CLOSE}"


@cache
def read(name: str) -> Any:
    """A record of docs/results, or one that is shipped (``models/…``), named without its ending."""
    folder = PACKAGE if name.startswith("models/") else RESULTS
    return json.loads((folder / f"{name}.json").read_text("utf-8"))


def at(name: str, keys: str = "", /, **where: object) -> Any:
    """Value in a record at keys joined by slashes; of a list the entry in which ``where`` holds."""
    result = read(name)
    for key in filter(None, keys.split("/")):
        if isinstance(result, list):
            result = next(row for row in result if all(row[k] == v for k, v in where.items()))
        result = result[key]
    if isinstance(result, int | float):
        return Figure(result)
    return Phrase(result) if isinstance(result, str) else result


def kilobytes(name: str) -> Figure:
    """Size of a file of the package, named without its ending."""
    return Figure(_file(name).stat().st_size / 1000)


def numbers(name: str) -> Figure:
    """Count of numbers in a file of the package, named without its ending."""
    return Figure(sum(math.prod(e["shape"]) for key, e in _header(name).items() if key != "__metadata__"))


def told(name: str) -> Any:
    """Facts about training in the header of a model's weights."""
    return json.loads(_header(f"models/{name}/weights")["__metadata__"]["scenelang"])


def _file(name: str) -> Path:
    folder = ROOT / "scenelang/language" if name.startswith("std/") else PACKAGE
    return folder / f"{name}.safetensors"


def _header(name: str) -> Any:
    with open(_file(name), "rb") as file:
        return json.loads(file.read(int.from_bytes(file.read(8), "little")))


def _pattern(claim: str) -> re.Pattern[str]:
    """Pattern of a claim in a page, for any figures and line breaks."""
    parts = re.split(f"{OPEN}(.*?){CLOSE}", claim)
    result = []
    for index, part in enumerate(parts):
        if index % 2 == 0:
            result.append(r"\s+".join(map(re.escape, re.split(r"\s+", part))))
        else:
            number = re.fullmatch(r"[-+−]?[\d.,]+(?:e[-+]?\d+)?", part)
            result.append(r"([-+−]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?)" if number else "(.+?)")
    return re.compile("".join(result))


def _match(claim: str, text: str) -> re.Match[str]:
    result = list(_pattern(claim).finditer(text))
    if len(result) != 1:
        shown = re.sub(f"[{OPEN}{CLOSE}]", "", claim)
        raise LookupError(f"claimed {len(result)} times where once is meant: {shown}")
    return result[0]


def filled(text: str, claims: Iterable[str]) -> str:
    """The page with every claim's figures as records have them; LookupError unless each is there once."""
    for claim in claims:
        match = _match(claim, text)
        shown = re.findall(f"{OPEN}(.*?){CLOSE}", claim)
        for index in range(len(shown), 0, -1):
            start, end = match.span(index)
            text = text[:start] + shown[index - 1] + text[end:]
    return text


_WORDS = "two three four five six seven eight nine ten eleven twelve fifteen twenty thirty forty fifty sixty"
_UNITS = (
    "dB|ms|s|µs|min|minutes?|hours?|seconds?|%|percent|×|times|KB|MB|GB|[MG]FLOP|bytes|scenes|seeds|sets"
    "|frames|pictures|images|parameters|numbers|weights|samples|pixels|steps|points|evaluations|levels"
)
_NUMBER = r"(?<![\w.])[-+−]?\d[\d,]*(?:\.\d+)?(?![\w.]*\d)"
_FIGURE = re.compile(
    rf"{_NUMBER}(?=(?:\s+(?:to|and|or|of)\s+{_NUMBER})?\s*(?:{_UNITS})(?!\w|\s*\d))"
    r"|(?<![\w.,])[-+−]?(?:\d[\d,]*\.\d+|\d{1,3}(?:,\d{3})+)(?![\d.])"
    rf"|\b(?:{_WORDS.replace(' ', '|')}|hundred|thousand|million)(?:[- ]\w+)?(?=\s+(?:times|dB|ms|percent)\b)"
    r"|\b(?:twice|half)(?=\s+as\b)",
    re.IGNORECASE,
)
_CELL = re.compile(rf"(?<=\|)\s*\**({_NUMBER})(?:\s*(?:±.*?|{_UNITS}))?\**\s*(?=\|)")
_NOT_PROSE = re.compile(
    r"^```.*?^```$"  # code
    r"|^ {4,}(?![-*|\d ]).*?$"  # indented code
    r"|`[^`\n]*`"
    r"|<!-- (?:begin )?([\w-]+)(?::[^\n]*)? -->.*?<!-- end (?:of )?\1 -->"  # tables and charts of scripts
    r"|^\#+ [^\n]*$"
    r"|\]\([^)]*\)|https?://\S+",
    re.MULTILINE | re.DOTALL,
)


def prose(text: str) -> str:
    """The page with blanks for all that is code, a heading, a link's target or written by a script."""
    return _NOT_PROSE.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)


def uncovered(text: str, claims: Iterable[str], given: Mapping[str, str]) -> Iterator[tuple[int, str]]:
    """(line, words) of every figure in prose that is neither claimed nor given; LookupError as `filled`."""
    covered = []
    for claim in claims:
        match = _match(claim, text)
        covered += [match.span(index) for index in range(1, (match.re.groups) + 1)]
    for piece in given:
        result = [match.span() for match in _pattern(piece).finditer(text)]
        if not result:
            raise LookupError(f"given and not in the page: {piece}")
        covered += result
    plain = prose(text)
    spans = {match.span() for match in _FIGURE.finditer(plain)}
    spans |= {match.span(1) for match in _CELL.finditer(plain)}
    for start, end in sorted(spans):
        if not any(first <= start and end <= last for first, last in covered):
            words = f"{text[max(0, start - 40) : start]}[{text[start:end]}]{text[end : end + 30]}"
            yield text[:start].count("\n") + 1, re.sub(r"\s+", " ", words)
