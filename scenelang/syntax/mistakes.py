"""Repairs in words: the diagnostic for each kind of mistake that recovery finds."""

from __future__ import annotations

import re
from collections.abc import Sequence

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.syntax.repairs import MAX_REPLAY, REPLACEMENTS, Repair
from scenelang.syntax.spelling import keywords_near, word_for
from scenelang.syntax.tables import END, tables
from scenelang.syntax.tokens import Report, Tokens

DEFINITIONS = ("let", "param", "fn")
_ENDS = ("`}`", "the end of the file")
_OPERATORS = ("+", "-", "*", "/", "%", "^", "<", "<=", ">", ">=", "==", "!=", "&&", "||", "?", "..", "..<")
_DIVISION = re.compile(r"[ \t]*//[ \t]*[\w.()]{1,40}[ \t]*;[ \t]*(?=\n)")
"""What is taken for a comment and was meant for a division."""

_KEYWORD_HELP = "choose another name"


def report_repair(
    tokens: Tokens, report: Report, repair: Repair, open_brackets: Sequence[int], sure: bool = True
) -> None:
    """Report the mistake that a repair mends.

    Args:
        tokens: the tokens before the repair.
        report: takes the diagnostic.
        repair: what is going to be done.
        open_brackets: indices of the brackets open before it.
        sure: what is inserted can stand nowhere else.
    """
    touched = range(repair.at, repair.end)
    if any(tokens.starts[index] in tokens.reported for index in touched):
        return  # a slip that has been reported already
    if touched and tokens.starts[repair.at] == tokens.ends[repair.end - 1]:
        return  # what recovery put in itself, at a mistake that has been reported
    gap = range(tokens.end_before(repair.at), tokens.starts[repair.at])
    if not touched and any(at in tokens.reported for at in gap):
        return  # what belongs here was read as something illegal
    names = [tables().kinds[kind] for kind in repair.insert]
    if not repair.delete:
        _report_insertion(tokens, report, repair.at, names, open_brackets, sure)
    elif not names:
        _report_deletion(tokens, report, repair)
    else:
        _report_replacement(tokens, report, repair, names)


def report_braces(tokens: Tokens, report: Report, statements: Sequence[tuple[int, int]]) -> None:
    """Report braces that are missing around statements, each the tokens ``[first, stop)``."""
    edits = []
    for first, stop in statements:
        edits.append(Edit(_empty(tokens, tokens.starts[first]), "{ "))
        edits.append(Edit(_empty(tokens, tokens.ends[stop - 1]), " }"))
    first = statements[0][0]
    at = tokens.end_before(first) if tokens.on_new_line(first) else tokens.starts[first]
    fix = None if _goes_on(tokens, *statements[-1]) else Fix("put braces around it", tuple(edits))
    report.add("E0106", "missing braces", at, at, help="braces are mandatory here", fix=fix)


def report_broken_off(tokens: Tokens, report: Report, at: int, names: Sequence[str]) -> None:
    """Report a statement that breaks off before a token, and what it lacks."""
    end = tokens.end_before(at)
    codes = {
        ")": "E0103",
        "]": "E0103",
        "BAD_EXPRESSION": "E0108",
        "NAME": "E0109",
        "(": "E0107",
        ";": "E0102",
    }
    report.add(
        codes.get(names[0], "E0126"),
        f"unfinished statement: missing {_listed(names)}",
        end,
        end,
        help="the line breaks off here",
    )


def report_instead(tokens: Tokens, report: Report, at: int, names: Sequence[str]) -> None:
    """Report a token that stands where another belongs."""
    start, end = tokens.starts[at], tokens.ends[at]
    found, first = _shown(tokens, at), names[0]
    if first == "BAD_EXPRESSION":
        report.add("E0108", f"expected an expression, found {found}", start, end)
    elif first == "NAME":
        report.add("E0109", f"expected a name, found {found}", start, end)
    elif first == "STRING":
        report.add("E0126", f"expected a string, found {found}", start, end)
    else:
        report.add("E0130", f"{found} where {_listed(names)} belongs", start, end)


def report_misspelt(tokens: Tokens, report: Report, at: int, word: str) -> None:
    """Report a word where a keyword was meant."""
    start, end = tokens.starts[at], tokens.ends[at]
    report.add(
        "E0132", f"unknown word `{tokens.text(at)}`", start, end, help=f"did you mean `{word}`?", fix=word
    )


def report_unexpected(tokens: Tokens, report: Report, at: int) -> None:
    """Report a token that nothing could make sense of."""
    if tokens.starts[at] in tokens.reported:
        return
    start, end = tokens.starts[at], tokens.ends[at]
    if tokens.kinds[at] == END:
        start = end = tokens.end_before(at)
    report.add("E0122", f"this is not a statement: unexpected {_shown(tokens, at)}", start, end)


def _report_insertion(
    tokens: Tokens, report: Report, at: int, names: list[str], open_brackets: Sequence[int], sure: bool
) -> None:
    end = tokens.end_before(at)
    found = _shown(tokens, at)
    first = names[0]
    ends = names[-1] == ";" or (names[-2:] == ["{", "}"] and names[2:])
    if ends and set(names) - {")", "]", ";"}:
        report_broken_off(tokens, report, at, names)
        return
    # An operand is missed where the next token stands, anything else where the last one ended.
    place = (
        (end, end)
        if tokens.on_new_line(at) or tokens.kinds[at] == END
        else (tokens.starts[at], tokens.ends[at])
    )
    if first in (")", "]"):
        text = "".join(names)
        labels = [Label(_span(tokens, open_brackets[-1]), "opened here")]
        report.add("E0103", f"missing `{text}`", end, end, labels=labels, fix=text if sure else None)
    elif first == ";":
        help = "a `;` ends every statement without a block"
        # Inside a line an operator may be missing as well, or a brace.
        called = tokens.text(at - 1) == ")" and head(tokens, at) not in DEFINITIONS
        sure = tokens.on_new_line(at) or called or found in _ENDS
        if tokens.kinds[at] != END and _DIVISION.match(tokens.source.text, end):
            help, sure = "`//` begins a comment; the whole part of a / b is floor(a / b)", False
        report.add("E0102", "missing `;`", end, end, help=help, fix=";" if sure else None)
    elif names == ["BAD_EXPRESSION"]:
        report.add("E0108", f"expected an expression, found {found}", *place)
    elif names == ["NAME"]:
        report.add("E0109", f"expected a name, found {found}", *place)
    elif names == ["STRING"]:
        report.add("E0126", f"expected a string, found {found}", *place)
    elif names == ["{", "}"]:
        report.add("E0106", "missing block", end, end, help="braces are mandatory here, even around nothing")
    elif first == "(":
        text, next = "".join(names), tokens.starts[at]
        gap = tokens.source.text[end:next] == " " and names == ["("]
        opening = report.change(end, next if gap else end, text, f"insert `{text}`")
        report.add("E0107", f"missing `{text}`", end, end, fix=opening)
    elif first == ",":
        literal = all(_is_literal(tokens, index) for index in (at - 1, at))
        message = "missing `,`" if literal else f"missing `,` or operator before {found}"
        # Of equal ones, one may be too many; beside others an operator may be missing.
        sure = literal and tokens.text(at - 1) != tokens.text(at) and _are_items(tokens, at - 1, at + 1)
        report.add("E0112", message, end, end, fix="," if sure else None)
    elif first == "*":
        report.add("E0112", f"missing operator before {found}", end, end)
    elif names[1:]:
        what = "a name" if names[1] == "NAME" else "a value"
        report.add("E0126", f"missing `{first}` and {what}", end, end)
    else:
        safe = first in ("=", "in", "as")
        fix = f" {first}" if safe else None
        start = end if not tokens.on_new_line(at) else tokens.starts[at]
        report.add("E0126", f"missing `{first}` before {found}", start, start, fix=fix)


def _report_deletion(tokens: Tokens, report: Report, repair: Repair) -> None:
    start, end = tokens.starts[repair.at], tokens.ends[repair.end - 1]
    text = tokens.source.text[start:end]
    if text in (")", "]"):
        # Beside operators it may be the opening one that is missing.
        fix = None if _has_operator(tokens, repair.at + 1) else ""
        report.add("E0105", f"unmatched `{text}`", start, end, fix=fix)
    else:
        report.add("E0101", f"unexpected {_quoted(text)}", start, end, fix=_once(tokens, repair, text))


def _once(tokens: Tokens, repair: Repair, text: str) -> str | None:
    """What to write for something that stands twice in a row: nothing, unless it may be meant to."""
    twice = text == tokens.text(repair.end) or (repair.at and text == tokens.text(repair.at - 1))
    return "" if twice and text != "," and not _is_literal(tokens, repair.at) else None


def _report_replacement(tokens: Tokens, report: Report, repair: Repair, names: list[str]) -> None:
    start, end = tokens.starts[repair.at], tokens.ends[repair.end - 1]
    text = tokens.source.text[start:end]
    new = "".join(names)
    fix: str | None = new
    if new == "=" and (tokens.end_before(repair.at), tokens.starts[repair.end]) == (start, end + 1):
        fix = " ="  # as in `angle: 30deg`
    if repair.delete == 2:
        first, second = tokens.text(repair.at), tokens.text(repair.at + 1)
        gap = tokens.source.text[tokens.ends[repair.at] : tokens.starts[repair.at + 1]]
        bracket = any(one in "()[]" for one in (first, second))
        sure = not (bracket and _has_operator(tokens, repair.at + 2))
        swap = report.change(start, end, f"{second}{gap}{first}", "swap them") if sure else None
        report.add("E0131", f"`{first}` and `{second}` are in the wrong order", start, end, fix=swap)
    elif new == "NAME" and text.isalpha():
        report.add("E0110", f"`{text}` is a keyword, not a name", start, end, help=_KEYWORD_HELP)
    elif new == "==":
        if head(tokens, repair.at) in DEFINITIONS:
            fix = None  # two names for one value, more likely
        report.add("E0111", "`=` does not compare", start, end, help="equality is `==`", fix=fix)
    elif new == "{}":
        report.add("E0106", f"missing block, found `{text}`", start, end)
    elif text in (")", "]") and new in (")", "]"):
        report.add("E0105", f"`{text}` where `{new}` belongs", start, end, fix=fix)
    elif word_for(text) == new:
        if new == "!" and tokens.text(repair.end) != "(":
            fix = None  # elsewhere it takes all of a comparison, here only what is next
        report.add(
            "E0127", f"`{text}` is not used here", start, end, help=f"`{new}` is the sign for it", fix=fix
        )
    elif new.isalpha() and new.islower() and new in keywords_near(text):
        report_misspelt(tokens, report, repair.at, new)
    elif repair.delete == 1 and text in REPLACEMENTS and new in REPLACEMENTS[text]:
        report.add("E0130", f"`{text}` where `{new}` belongs", start, end, fix=fix)
    else:
        report_instead(tokens, report, repair.at, names)


def head(tokens: Tokens, at: int) -> str:
    """The first word of the statement that the token at an index belongs to."""
    return (_statement(tokens, at) or [""])[-1]


def _statement(tokens: Tokens, at: int) -> list[str]:
    """The tokens of a statement before the one at an index, from the last to the first."""
    found: list[str] = []
    while at and len(found) < MAX_REPLAY:
        at -= 1
        text = tokens.text(at)
        if text in (";", "{", "}"):
            break
        found.append(text)
    return found


def _has_operator(tokens: Tokens, at: int) -> bool:
    """Whether brackets matter in what stands before a token in its statement."""
    return any(text in _OPERATORS for text in _statement(tokens, at))


def _are_items(tokens: Tokens, first: int, stop: int) -> bool:
    """Whether two literals are nothing but items of a list."""
    first -= tokens.text(first - 1) == "-"
    return tokens.text(first - 1) in ("(", "[", ",") and tokens.text(stop) in (")", "]", ",")


def _goes_on(tokens: Tokens, first: int, stop: int) -> bool:
    """Whether what follows a statement on a line of its own is laid out as its sibling."""
    text, starts = tokens.source.text, tokens.starts
    if not tokens.on_new_line(first) or not tokens.on_new_line(stop) or tokens.kinds[stop] == END:
        return False
    if tokens.text(stop) in ("}", "else"):
        return False
    first, stop = (starts[at] - text.rfind("\n", 0, starts[at]) for at in (first, stop))
    return first == stop


def _listed(names: Sequence[str]) -> str:
    """What is missing, in words: "an expression, `)` and `{`"."""
    words = {"BAD_EXPRESSION": "an expression", "NAME": "a name", "STRING": "a string", "NUMBER": "a number"}
    parts: list[str] = []
    for name in names:
        if name in words:
            parts.append(words[name])
        elif parts and parts[-1].endswith("`") and not name.isalpha() and not parts[-1][-2].isalpha():
            parts[-1] = f"{parts[-1][:-1]}{' ' * (name == '{')}{name}`"
        else:
            parts.append(f"`{name}`")
    return " and ".join((", ".join(parts[:-1]), parts[-1])) if parts[1:] else parts[0]


def _is_literal(tokens: Tokens, index: int) -> bool:
    return tables().kinds[tokens.kinds[index]] in ("NUMBER", "COLOR", "STRING")


def _shown(tokens: Tokens, at: int) -> str:
    return "the end of the file" if tokens.kinds[at] == END else _quoted(tokens.text(at))


def _quoted(text: str) -> str:
    text = " ".join(text.split())
    return f"`{text}`" if len(text) <= 40 else f"`{text[:37]}…`"


def _span(tokens: Tokens, index: int) -> Span:
    return Span(tokens.source, tokens.starts[index], tokens.ends[index])


def _empty(tokens: Tokens, at: int) -> Span:
    return Span(tokens.source, at, at)
