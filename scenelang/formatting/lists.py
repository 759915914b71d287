"""Lists: what stands between brackets, and the comments and blank lines between items."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from scenelang.formatting.documents import (
    BLANK,
    LINE,
    SOFT,
    Comments,
    Concat,
    Doc,
    Fill,
    Group,
    Indent,
    Part,
    Word,
    after_of,
    before_of,
    own_after_first,
)
from scenelang.formatting.trivia import Comment

_NUMBER = re.compile(r"[-+]?\.?[0-9]")


class Item(NamedTuple):
    """An item of a list, and what stands around the comma after it."""

    part: Part
    behind: str = ""  # block comments after the comma, each with a space before it
    after: Sequence[Comment] = ()  # comments behind the comma, less the item's own, that end the line


class Bracketed(Group):
    """A vector or a block: as a call's only argument it opens on the call's line."""

    __slots__ = ()


def inline(items: Sequence[Item]) -> list[Part]:
    """Items on one line; what follows the last comma stays, the comma does not."""
    parts: list[Part] = []
    unbreakable = Doc(None)
    for index, (part, behind, after) in enumerate(items):
        if after or after_of(part) or before_of(part):
            return [unbreakable]
        parts += [part, behind if index == len(items) - 1 else f",{behind} "]
    return parts


def broken(left: Part, items: Sequence[Item], right: Part, comma: str = ",") -> Part:
    """A list on several lines: an item a line, numbers as many as fit, a lone vector on the same line."""
    dangling = before_of(right)
    opened = after_of(left)
    inside: list[Part] = [Comments(opened)] if opened else []
    if not (opened or dangling):
        if not items:
            return Concat(None, [left, right])
        part, behind, after = items[0]
        alone = len(items) == 1 and isinstance(part, Bracketed)
        if alone and not (behind or after or before_of(part) or after_of(part)):
            return Concat(None, [left, part, right])
        if numbers := _numbers(items):
            return Concat(None, [left, Indent(Concat(None, [SOFT, Fill(numbers)])), SOFT, right])
    for index, (part, behind, after) in enumerate(items):
        inside.append(BLANK if index and blank_before(part) else SOFT)
        inside += comments_before(part)
        inside += [part, comma + behind]
        if behindmost := [*after_of(part), *after]:
            inside.append(Comments(own_after_first(behindmost)))
    inside += comment_lines(dangling, begun=bool(items))
    return Concat(None, [left, Indent(Concat(None, inside)), SOFT, right])


def _numbers(items: Sequence[Item]) -> list[str]:
    """The items, if they are several plain numbers without comments or blank lines between; else nothing."""
    texts: list[str] = []
    for index, (part, behind, after) in enumerate(items):
        if index == 0 and isinstance(part, Word) and not (part.before or part.after):
            part = part.flat  # a blank line before the first item means nothing
        if not isinstance(part, str) or behind or after or not _NUMBER.match(part):
            return []
        texts.append(part)
    return texts if len(texts) > 1 else []


def blank_before(part: Part) -> bool:
    """Whether a blank line stands before a part and its comments."""
    if isinstance(part, str):
        return False
    return part.before[0].blank if part.before else part.blank


def comments_before(part: Part) -> list[Part]:
    """The comments on lines of their own before a part, at the beginning of a line."""
    if isinstance(part, str) or not part.before:
        return []
    return [*comment_lines(part.before, begun=False)[1:], BLANK if part.blank else LINE]


def comment_lines(comments: Sequence[Comment], begun: bool) -> list[Part]:
    """Comments, each on a new line; ``begun`` says that something stands above the first."""
    parts: list[Part] = []
    for comment in comments:
        parts.append(BLANK if comment.blank and begun else SOFT)
        parts.append(Comments([comment]))
        begun = True
    return parts
