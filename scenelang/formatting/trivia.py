"""Comments and blank lines: which token each of them belongs to.

The rules are chosen so that text laid out by this package reads back the same way: whatever a comment is
attached to, it is printed where the same rule attaches it again. That is what makes formatting idempotent.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import field
from typing import NamedTuple

from scenelang.records import Record
from scenelang.syntax.lexer import Tokens
from scenelang.syntax.tables import tables

_COMMENT = re.compile(r"//[^\n]*|/\*(?:[\s\S]*?\*/|[\s\S]*)")


class Comment(NamedTuple):
    """One comment."""

    text: str  # from its first sign to its last, trailing white space of its lines taken off
    column: int | None  # code points before it on its line, if it has several lines and no tabs stand there
    ends_line: bool  # nothing may follow it on its last line: it is a line comment or has several lines
    own_line: bool = False  # it stands on lines of its own
    blank: bool = False  # a blank line stands before it


def texts_of(comments: Iterable[Comment]) -> list[str]:
    return [comment.text for comment in comments]


class Notes(Record, frozen=False):
    """What stands around one token."""

    before: list[Comment] = field(default_factory=list)  # comments on lines of their own before it
    leading: Sequence[Comment] = ()  # block comments before it on its line
    trailing: Sequence[Comment] = ()  # block comments after it on its line, which need not end there
    after: list[Comment] = field(default_factory=list)  # comments behind it after which its line must end
    blank: bool = False  # a blank line stands right before it, or before its leading comments


def attach(tokens: Tokens) -> dict[int, Notes]:
    """The notes of every token that has any, by index; those of the end of the text go with the last one."""
    text = tokens.source.text
    notes: dict[int, Notes] = {}
    end = 0
    for index, start in enumerate(tokens.starts):
        if start - end > 1:
            gap = text[end:start]
            if "/" in gap or gap.count("\n") > 1:
                _attach(tokens, notes, index, *_read(text, end, start))
        end = tokens.ends[index]
    return notes


def comments_of(tokens: Tokens) -> list[str]:
    """The texts of all comments, in order, without the white space at the ends of their lines."""
    text = tokens.source.text
    found: list[str] = []
    end = 0
    for start, stop in zip(tokens.starts, tokens.ends, strict=True):
        if start - end > 1:
            found += ["\n".join(map(str.strip, c.split("\n"))) for c in _COMMENT.findall(text, end, start)]
        end = stop
    return found


def _attach(
    tokens: Tokens, notes: dict[int, Notes], index: int, comments: list[Comment], newlines: list[int]
) -> None:
    """Note what stands between the token before ``index`` and that token."""
    before, kind = (tables().kinds[tokens.kinds[at]] for at in (index - 1, index))
    closes = kind in ("$END", ")", "]", "}", ",", ";")
    here = notes.setdefault(index, Notes())
    behind = 0  # so many stand on the line of the token before
    while index and behind < len(comments) and not newlines[behind]:
        behind += 1
        if comments[behind - 1].ends_line:
            break
    ahead = len(comments)  # the first of those on the line of the token
    while not closes and ahead > behind and not newlines[ahead] and not comments[ahead - 1].ends_line:
        ahead -= 1
    here.blank = newlines[ahead] > 1
    for comment, lines in zip(comments[behind:ahead], newlines[behind:], strict=False):
        here.before.append(comment._replace(own_line=True, blank=lines > 1))
    here.leading = comments[ahead:]
    if last := comments[:behind]:
        if last[-1].ends_line or ahead > behind:
            notes.setdefault(index - 1, Notes()).after += last
        elif closes or (newlines[behind] and before in (",", ";", "{", "}")):
            notes.setdefault(index - 1, Notes()).trailing = last
        else:
            here.leading = [*last, *here.leading]
            here.blank = False


def _read(text: str, start: int, end: int) -> tuple[list[Comment], list[int]]:
    """The comments between two places, and how many newlines stand before each and after the last."""
    comments: list[Comment] = []
    newlines: list[int] = []
    at = start
    for match in _COMMENT.finditer(text, start, end):
        begins = match.start()
        newlines.append(text.count("\n", at, begins))
        at = match.end()
        words = "\n".join(line.rstrip() for line in match[0].split("\n"))
        several = "\n" in words
        line = text[text.rfind("\n", 0, begins) + 1 : begins]
        column = len(line) if several and "\t" not in line else None
        comments.append(Comment(words, column, several or words.startswith("//")))
    newlines.append(text.count("\n", at, end))
    return comments, newlines
