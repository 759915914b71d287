"""Repairs in words: the diagnostic for each kind of mistake that recovery finds."""

from __future__ import annotations

import re
from collections.abc import Sequence

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.syntax.lexer import Report, Tokens
from scenelang.syntax.recovery.foreign import OPERATORS, keywords_near
from scenelang.syntax.recovery.repairs import MAX_REPLAY, REPLACEMENTS, Repair
from scenelang.syntax.tables import END, tables

DEFINITIONS = ("let", "param", "fn")
_OPERATORS = ("+", "-", "*", "/", "%", "^", "<", "<=", ">", ">=", "==", "!=", "&&", "||", "?", "..", "..<")
_DIVISION = re.compile(r"[ \t]*//[ \t]*[\w.()]{1,40}[ \t]*;[ \t]*(?=\n)")
"""What is taken for a comment and was meant for a division."""
_WORDS = {"BAD_EXPRESSION": "an expression", "NAME": "a name", "STRING": "a string", "NUMBER": "a number"}
_CODES = {")": "E0103", "]": "E0103", "BAD_EXPRESSION": "E0108", "NAME": "E0109", "(": "E0107", ";": "E0102"}
"""Codes of what is missing; anything else is E0126."""


def report_repair(
    tokens: Tokens, report: Report, repair: Repair, open_brackets: Sequence[int], sure: bool = True
) -> None:
    """Report the mistake that a repair is going to mend.

    Args:
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
        for at, brace in ((tokens.starts[first], "{ "), (tokens.ends[stop - 1], " }")):
            edits.append(Edit(Span(tokens.source, at, at), brace))
    first = statements[0][0]
    at = tokens.end_before(first) if tokens.on_new_line(first) else tokens.starts[first]
    fix = None if _goes_on(tokens, *statements[-1]) else Fix("put braces around it", tuple(edits))
    report.add("E0106", "missing braces", at, at, help="braces are mandatory here", fix=fix)


def report_broken_off(tokens: Tokens, report: Report, at: int, names: Sequence[str]) -> None:
    """Report a statement that breaks off before a token, and what it lacks."""
    end, code = tokens.end_before(at), _CODES.get(names[0], "E0126")
    message = f"unfinished statement: missing {_listed(names)}"
    report.add(code, message, end, end, help="the line breaks off here")


def report_instead(tokens: Tokens, report: Report, at: int, names: Sequence[str]) -> None:
    """Report a token that stands where another belongs."""
    found, first = _shown(tokens, at), names[0]
    if first in _WORDS:
        report.add(_CODES.get(first, "E0126"), f"expected {_WORDS[first]}, found {found}", *tokens.place(at))
    else:
        report.add("E0130", f"{found} where {_listed(names)} belongs", *tokens.place(at))


def report_misspelt(tokens: Tokens, report: Report, at: int, word: str) -> None:
    """Report a word where a keyword was meant."""
    message, help = f"unknown word `{tokens.text(at)}`", f"did you mean `{word}`?"
    report.add("E0132", message, *tokens.place(at), help=help, fix=word)


def report_unexpected(tokens: Tokens, report: Report, at: int) -> None:
    """Report a token that nothing could make sense of."""
    if tokens.starts[at] not in tokens.reported:
        place = (tokens.end_before(at),) * 2 if tokens.kinds[at] == END else tokens.place(at)
        report.add("E0122", f"this is not a statement: unexpected {_shown(tokens, at)}", *place)


def _report_insertion(
    tokens: Tokens, report: Report, at: int, names: list[str], open_brackets: Sequence[int], sure: bool
) -> None:
    end, next = tokens.end_before(at), tokens.starts[at]
    found, first, text = _shown(tokens, at), names[0], "".join(names)
    new_line, last = tokens.on_new_line(at), tokens.kinds[at] == END
    code, message, help = _CODES.get(first, "E0126"), f"missing `{text}`", None
    labels: list[Label] = []
    fix: str | Fix | None = None
    place = end, end
    ends = names[-1] == ";" or (names[-2:] == ["{", "}"] and names[2:])
    if ends and set(names) - {")", "]", ";"}:
        report_broken_off(tokens, report, at, names)
        return
    if first in (")", "]"):
        labels = [Label(Span(tokens.source, *tokens.place(open_brackets[-1])), "opened here")]
        fix = text if sure else None
    elif first == ";":
        help = "a `;` ends every statement without a block"
        # Inside a line an operator may be missing as well, or a brace.
        called = tokens.text(at - 1) == ")" and head(tokens, at) not in DEFINITIONS
        if not last and _DIVISION.match(tokens.source.text, end):
            help = "`//` begins a comment; the whole part of a / b is floor(a / b)"
        elif new_line or called or last or found == "`}`":
            fix = ";"
    elif first in _WORDS:
        message = f"expected {_WORDS[first]}, found {found}"
        if not (new_line or last):  # an operand is missed where the next token stands
            place = tokens.place(at)
    elif text == "{}":
        code, message, help = "E0106", "missing block", "braces are mandatory here, even around nothing"
    elif first == "(":
        gap = tokens.source.text[end:next] == " " and text == "("
        fix = report.change(end, next if gap else end, text, f"insert `{text}`")
    elif first == ",":
        literal = all(_is_literal(tokens, index) for index in (at - 1, at))
        code, message = "E0112", "missing `,`" if literal else f"missing `,` or operator before {found}"
        # Of equal ones, one may be too many; beside others an operator may be missing.
        if literal and tokens.text(at - 1) != tokens.text(at) and _are_items(tokens, at - 1, at + 1):
            fix = ","
    elif first == "*":
        code, message = "E0112", f"missing operator before {found}"
    elif names[1:]:
        message = f"missing `{first}` and {'a name' if names[1] == 'NAME' else 'a value'}"
    else:
        message = f"missing `{first}` before {found}"
        fix = f" {first}" if first in ("=", "in", "as") else None
        place = (next, next) if new_line else place
    report.add(code, message, *place, labels=labels, help=help, fix=fix)


def _report_deletion(tokens: Tokens, report: Report, repair: Repair) -> None:
    place = tokens.place(repair.at, repair.end)
    text = tokens.source.text[slice(*place)]
    if text in (")", "]"):
        # Beside operators it may be the opening one that is missing.
        fix = None if _has_operator(tokens, repair.at + 1) else ""
        report.add("E0105", f"unmatched `{text}`", *place, fix=fix)
        return
    # What stands twice in a row goes, unless it may be meant to.
    twice = text == tokens.text(repair.end) or (repair.at and text == tokens.text(repair.at - 1))
    fix = "" if twice and text != "," and not _is_literal(tokens, repair.at) else None
    report.add("E0101", f"unexpected {_quoted(text)}", *place, fix=fix)


def _report_replacement(tokens: Tokens, report: Report, repair: Repair, names: list[str]) -> None:
    at, (start, end) = repair.at, tokens.place(repair.at, repair.end)
    text, new = tokens.source.text[start:end], "".join(names)
    code, message, help = "E0130", f"`{text}` where `{new}` belongs", None
    fix: str | Fix | None = new
    if new == "=" and (tokens.end_before(at), tokens.starts[repair.end]) == (start, end + 1):
        fix = " ="  # as in `angle: 30deg`
    if repair.delete == 2:
        first, second = tokens.text(at), tokens.text(at + 1)
        gap = tokens.source.text[tokens.ends[at] : tokens.starts[at + 1]]
        code, message, fix = "E0131", f"`{first}` and `{second}` are in the wrong order", None
        if not ({first, second}.intersection("()[]") and _has_operator(tokens, at + 2)):
            fix = report.change(start, end, f"{second}{gap}{first}", "swap them")
    elif new == "NAME" and text.isalpha():
        code, message, fix = "E0110", f"`{text}` is a keyword, not a name", None
        help = "choose another name"
    elif new == "==":
        code, message, help = "E0111", "`=` does not compare", "equality is `==`"
        if head(tokens, at) in DEFINITIONS:
            fix = None  # two names for one value, more likely
    elif new == "{}":
        code, message, fix = "E0106", f"missing block, found `{text}`", None
    elif text in (")", "]") and new in (")", "]"):
        code = "E0105"
    elif OPERATORS.get(text) == new:
        code, message, help = "E0127", f"`{text}` is not used here", f"`{new}` is the sign for it"
        if new == "!" and tokens.text(repair.end) != "(":
            fix = None  # elsewhere it takes all of a comparison, here only what is next
    elif new.isalpha() and new.islower() and new in keywords_near(text):
        report_misspelt(tokens, report, at, new)
        return
    elif repair.delete > 1 or new not in REPLACEMENTS.get(text, ()):
        report_instead(tokens, report, at, names)
        return
    report.add(code, message, start, end, help=help, fix=fix)


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
    parts: list[str] = []
    for name in names:
        if name in _WORDS:
            parts.append(_WORDS[name])
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
