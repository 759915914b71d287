"""Text to tokens, and the LALR automaton that reads them.

One regular expression, made from the terminals of the grammar and the shapes of common slips, eats
white space and comments and then one token. A slip is reported once and stands in the token list as what
was meant. Unlike Lark's own loop, the automaton's can resume after a mistake.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any
from unicodedata import category

from scenelang.language.diagnostics import (
    Diagnostic,
    Diagnostics,
    Edit,
    Fix,
    Label,
    SourceFile,
    Span,
    removal,
)
from scenelang.language.foreign import SIGNS, UNIT_NAMES
from scenelang.language.tables import END, rows, tables
from scenelang.language.words import UNITS

MAX_MISTAKES = 200
"""After so many the rest of a file is not reported: it is not a scene."""

Token = tuple[int, int, int]
"""Kind, start and end."""

# Possessive throughout: a text that matches nothing must not be tried in every way of splitting it.
_SKIP = r"(?:[\s\ufeff]+|//[^\n]*+|/\*[\s\S]*?\*/)*+"
_SLIPS = {
    "open_comment": r"/\*",
    "close_comment": r"\*/",
    "open_string": r'"(?:\\[^\n]|[^\s;,(){}\[\]"\\])*+',
    "quotes": r"'[^'\n]*+'|[“”][^“”\n]*+[“”]",
    "number": r"\.?[0-9](?:[\w°]|\.(?!\.))*+",
    "variable": r"\$[A-Za-z_]\w*+",
    "hash": r"#[ \t!#][^\n]*+|#(?=\n|\Z)|(?<![^\n])#\w++[ \t]++[A-Za-z0-9][^\n]*+",
    "colour": r"#\w*+",
    "name": r"[^\W\d]\w*+",
    "foreign": r"&(?!&)|\|(?!\|)|" + "|".join(re.escape(text) for text in SIGNS if text not in "&|"),
}
_SAID = {name: columns for name, *columns in rows("lexer", "slips")}
"""What stands in the place of each slip, code, message, help."""
_LENGTHS = ("px", "em", "rem", "pt", "mm", "cm", "in", "m", "vw", "vh")
_AFTER_STRING = re.compile(r"[ \t]*+(?:[;)]|as\b|$)", re.MULTILINE)
"""Text that may follow a string whose end is known though its quote is missing."""
_CONSTANT = re.compile(r"#(?:define|declare|local)[ \t]+([A-Za-z_]\w*)[ \t]*=?[ \t]*([^;/\n]+);?")
_ILLEGAL = r"[^\s\w\x21-\x7e]+|[@$\\~`]+|[\s\S]"


class Report:
    """The mistakes of one file, in the order of finding; at most `MAX_MISTAKES`."""

    def __init__(self, source: SourceFile) -> None:
        self.source = source
        self.found: list[Diagnostic] = []
        self.full = False

    def add(
        self,
        code: str,
        message: str,
        start: int,
        end: int,
        *,
        labels: Iterable[Label] = (),
        help: str | None = None,
        fix: Fix | str | None = None,
    ) -> None:
        """Record a mistake at ``[start, end)``; a fix that is text takes the place of what is there."""
        if self.full:
            return
        if len(self.found) == MAX_MISTAKES:
            self.full = True
            code, message, labels, fix = "E0121", f"more than {MAX_MISTAKES} syntax mistakes", (), None
            help = "the rest of the file was not checked"
        if isinstance(fix, str):
            fix = self.change(start, end, fix)
        self.found.append(Diagnostic(code, message, Span(self.source, start, end), tuple(labels), help, fix))

    def change(self, start: int, end: int, text: str, message: str | None = None) -> Fix:
        if not text:
            return removal(self.source, start, end)
        usual = f"{'insert' if start == end else 'write'} `{text.strip()}`"
        return Fix(message or usual, (Edit(Span(self.source, start, end), text),))

    def flush(self, diagnostics: Diagnostics) -> None:
        """Hand everything over, in the order of the text."""
        for d in sorted(self.found, key=lambda d: d.span.start if d.span is not None else 0):
            diagnostics.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)


class Tokens:
    """Tokens as parallel lists; the last one is the end of the text, those that recovery put in are empty."""

    __slots__ = ("cut", "ends", "kinds", "reported", "source", "starts")

    def __init__(self, source: SourceFile) -> None:
        self.source = source
        self.kinds: list[int] = []  # indices into `Tables.kinds`
        self.starts: list[int] = []  # offsets of first code points
        self.ends: list[int] = []  # offsets after the last ones
        self.reported: set[int] = set()  # where tokens and characters begin whose mistake is reported
        self.cut = False  # the text ends inside a comment, so what it lacks is not a further mistake

    def append(self, kind: int, start: int, end: int) -> None:
        self.kinds.append(kind)
        self.starts.append(start)
        self.ends.append(end)

    def text(self, index: int) -> str:
        return self.source.text[self.starts[index] : self.ends[index]]

    def name(self, index: int) -> str:
        """Name of a token's kind: the text itself of a literal."""
        return tables().kinds[self.kinds[index]]

    def head(self, index: int, most: int | None = None) -> int:
        """Index of the first token of the statement that ``index`` ends or goes on, at most so many back."""
        last = 0 if most is None else max(0, index - most)
        while index > last and self.name(index - 1) not in (";", "{", "}"):
            index -= 1
        return index

    def unmatched(self, stop: int, first: int = 0, pairs: str = "{}") -> tuple[list[int], list[int]]:
        """Indices of the brackets that are open before ``stop``, and of those that close nothing."""
        names, opening, closing = tables().kinds, (*pairs[::2],), (*pairs[1::2],)
        open_: list[int] = []
        stray: list[int] = []
        for index in range(first, stop):
            name = names[self.kinds[index]]
            if name in opening:
                open_.append(index)
            elif name in closing and open_:
                open_.pop()
            elif name in closing:
                stray.append(index)
        return open_, stray

    def place(self, first: int, stop: int = 0) -> tuple[int, int]:
        """Start and end of a token, or of those before ``stop``."""
        return self.starts[first], self.ends[(stop or first + 1) - 1]

    def end_before(self, index: int) -> int:
        """End of the token before ``index``, the place of something missing."""
        return self.ends[index - 1] if index else 0

    def on_new_line(self, index: int) -> bool:
        return index == 0 or "\n" in self.source.text[self.ends[index - 1] : self.starts[index]]

    def replace(self, index: int, count: int, kinds: Sequence[int]) -> None:
        """Put tokens of other kinds in the place of ``count``: empty ones, but for one in place of one."""
        if len(kinds) == count == 1:
            self.kinds[index] = kinds[0]
            return
        at = self.starts[index] if count else self.end_before(index)
        self.splice(index, index + count, [(kind, at, at) for kind in kinds])

    def part(self, first: int, stop: int) -> list[Token]:
        columns = (self.kinds[first:stop], self.starts[first:stop], self.ends[first:stop])
        return list(zip(*columns, strict=True))

    def splice(self, first: int, stop: int, new: Sequence[Token]) -> None:
        for number, column in enumerate((self.kinds, self.starts, self.ends)):
            column[first:stop] = [token[number] for token in new]

    def drop(self, indices: Sequence[int]) -> None:
        gone = set(indices)
        for column in (self.kinds, self.starts, self.ends):
            column[:] = [value for index, value in enumerate(column) if index not in gone]


# ---------------------------------------------------------------- reading


@cache
def _master() -> tuple[re.Pattern[str], list[int], list[str]]:
    """The expression; the kind of each of its groups, or -1; the name of each slip's group."""
    language = tables()
    words = [text for text in language.literals if text[0].isalpha()]
    signs = sorted((text for text in language.literals if text not in words), key=len, reverse=True)
    groups = {**language.patterns, **_SLIPS}
    groups |= {"sign": "|".join(map(re.escape, signs)), "illegal": _ILLEGAL}
    kinds = [-1, *(language.kind(name) if name in language.patterns else -1 for name in groups)]
    pattern = _SKIP + "(?:" + "|".join(f"({group})" for group in groups.values()) + r"|\Z)"
    return re.compile(pattern), kinds, ["", *groups]


def scan(source: SourceFile, report: Report, stop: int | None = None) -> Tokens:
    """All tokens of a text, or those before an offset between tokens; slips go to ``report``."""
    pattern, group_kinds, names = _master()
    literals = tables().literals
    name_group, sign_group = names.index("NAME"), names.index("sign")
    name_kind = group_kinds[name_group]
    tokens, text = Tokens(source), source.text
    kinds, starts, ends = tokens.kinds, tokens.starts, tokens.ends
    stop = len(text) if stop is None else stop
    keyword = literals.get
    for match in pattern.finditer(text, 0, stop):
        if (group := match.lastindex) is None:
            break
        start, end = match.span(group)
        if group == name_group:
            kind = keyword(text[start:end], name_kind)
        elif group == sign_group:
            kind = literals[text[start:end]]
        else:
            kind = group_kinds[group]
            if kind < 0:
                _read_slip(tokens, report, names[group], start, end)
                if tokens.cut:
                    break
                continue
        kinds.append(kind)
        starts.append(start)
        ends.append(end)
    tokens.append(END, stop, stop)
    return tokens


def _read_slip(tokens: Tokens, report: Report, name: str, start: int, end: int) -> None:
    """Report a slip and stand something sound in its place."""
    kind, code, message, *advice = _SAID[name]
    kind, help = kind.strip("-"), advice[0] if advice else None
    text = shown = tokens.source.text[start:end]
    fix: Fix | str | None = None
    stop = end
    if name == "open_comment":
        tokens.cut = True
    elif name == "close_comment":
        fix = ""
    elif name == "open_string" and end - start > 1 and _AFTER_STRING.match(tokens.source.text, end):
        fix = report.change(end, end, '"')
    elif name == "quotes" and not ('"' in text or "\\" in text):
        fix = f'"{text[1:-1]}"'
    elif name == "number" and re.fullmatch("0[xX][0-9a-fA-F]{6}", text):
        kind, help, fix = "COLOR", "this is a colour", f"#{text[2:]}"
    elif name == "number":
        message, help, fix = _number_advice(text)
    elif name == "colour" and re.fullmatch("#(?:[0-9a-fA-F]{4}){1,2}", text):
        help = f"colours have no alpha: write {text[: 1 + (len(text) - 1) * 3 // 4]}"
    elif text == "$t":
        help = "the share of an animation that has run is `u`, after animate(seconds = 2, fps = 24);"
    elif name == "hash" and (constant := _CONSTANT.fullmatch(text)):
        code, message, help = "E0133", "names are bound by `let`", None
        fix = f"let {constant[1]} = {constant[2].rstrip()};"
    elif name == "hash":
        stop = start + 1
        fix = None if text.rstrip().endswith((";", "{", "}")) else "//"  # OpenSCAD marks objects by it
    elif name == "foreign":
        kind = fix = SIGNS[text]
        help = f"`{kind}` is the sign for it"
    elif name == "illegal":
        tokens.reported.add(start)
        shown = text if text.isprintable() else " ".join(f"U+{ord(c):04X}" for c in text[:8])
        if all(category(c) in ("Cf", "Cc") for c in text):  # comes along when text is copied
            help, fix = "it cannot be seen", ""
    if kind:
        tokens.append(tables().kind(kind), start, end)
        tokens.reported.add(start)
    report.add(code, message.format(shown), start, stop, help=help, fix=fix)


def _number_advice(text: str) -> tuple[str, str, str | None]:
    """Message, help and fix for a number that is none, or has something behind its digits."""
    value, rest = re.findall(r"^([0-9]*\.?[0-9]*)(.*)", text)[0]
    message = f"`{text}` is not a number"
    if rest in ("f", "F"):
        return message, "numbers have no type", value
    if re.fullmatch("(?:_[0-9]+)+", rest):
        return message, "digits are not grouped", text.replace("_", "")
    if not rest or rest.startswith((".", "e", "E")):
        return message, "numbers look like `1`, `0.5` or `1e-3`", None
    message = f"`{rest}` is not a unit"
    if rest in UNIT_NAMES:
        return message, f"it is `{UNIT_NAMES[rest]}` here", value + UNIT_NAMES[rest]
    if rest in _LENGTHS:
        return (
            message,
            "lengths have no unit; the shorter side of a flat scene's canvas is 2, its middle 0",
            None,
        )
    if re.fullmatch("x[0-9]+", rest):
        return message, f"sides are separated by a comma: {value}, {rest[1:]}", None
    units = ", ".join(f"`{unit}`" for unit in UNITS)
    return message, f"units are {units}; a product is written with `*`", None


LOOKAHEAD = 8
"""Tokens past a mistake that a repair is followed for; more of them tell nothing more."""

# What brings a half-written statement to its end. What is tried first ends something; an operand or a name
# is taken only where nothing else will do.
_NEXT = (")", "]", "in", "=", ":", "BAD_EXPRESSION", "STRING", "NAME", "as", "(")
_LONGEST = 24

Mend = Callable[[list[int], list[Any], int], int | None]
"""Changes states, values and tokens at the index of one that does not fit, and says where reading goes on."""


def run(kinds: list[int], callbacks: Iterable[Callable[..., Any] | None], mend: Mend) -> Any:
    """Read tokens up to `END` and build what they stand for; None where ``mend`` gave up.

    ``callbacks`` build each rule's value from those of its parts, in the order of `Tables.rules`; None passes
    the only value on. The value of a token is its index.
    """
    language = tables()
    actions, gotos, final = language.actions, language.gotos, language.final
    rules = [(*rule[:2], call) for rule, call in zip(language.rules, callbacks, strict=True)]
    states = [language.start]
    values: list[Any] = []
    state = language.start
    at = 0
    kind = kinds[0]
    while True:
        if (action := actions[state].get(kind)) is None:
            if (resumed := mend(states, values, at)) is None:
                return None
            at = resumed
            kind = kinds[at]
            state = states[-1]
        elif action >= 0:
            states.append(action)
            values.append(at)
            state = action
            at += 1
            kind = kinds[at]
        else:
            length, origin, call = rules[~action]
            if call is None:
                states.pop()
            elif length == 1:
                states.pop()
                values[-1] = call(values[-1])
            elif length:
                parts = values[-length:]
                del values[-length:], states[-length:]
                values.append(call(*parts))
            else:
                values.append(call())
            state = gotos[states[-1]][origin]
            states.append(state)
            if state == final:
                return values[0]


def advance(stack: list[int], kind: int) -> bool:
    """Take one token, changing the stack; False where it does not fit."""
    language = tables()
    actions, gotos, rules = language.actions, language.gotos, language.rules
    while True:
        if (action := actions[stack[-1]].get(kind)) is None:
            return False
        if action >= 0:
            stack.append(action)
            return True
        length, origin, _ = rules[~action]
        if length:
            del stack[-length:]
        stack.append(gotos[stack[-1]][origin])
        if stack[-1] == language.final:
            return True


def fits(stack: list[int], kind: int) -> bool:
    return advance(stack.copy(), kind)


def reach(stack: list[int], kinds: list[int], start: int, stop: int) -> int:
    """Index of the first token that does not fit, or ``stop``, also at the text's end; changes the stack."""
    for at in range(start, min(stop, len(kinds))):
        if not advance(stack, kinds[at]):
            return at
        if kinds[at] == END:
            return stop
    return stop


def statement_depth(stack: list[int]) -> int:
    """Index of the innermost state in which a statement can begin; the last where one has just ended."""
    language = tables()
    bad_statement = language.kind("BAD_STATEMENT")
    at = len(stack) - 1
    if bad_statement in language.actions[stack[at]]:
        return at
    while language.actions[stack[at]].get(bad_statement, -1) < 0:
        at -= 1
    return at


def completion(stack: Sequence[int], goal: int) -> tuple[int, ...] | None:
    """Kinds of the few missing tokens after which ``goal``, a `;` or a brace, fits; None where none do."""
    kind = tables().kind
    trial = list(stack)
    missing: list[int] = []
    while not fits(trial, goal):
        following = next((k for k in map(kind, _NEXT) if fits(trial, k)), None)
        if following is None or len(missing) == _LONGEST:
            return None
        advance(trial, following)
        missing.append(following)
    return tuple(missing)
