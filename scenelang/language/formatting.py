"""Scene text in one canonical layout: `format_text`, and `format_range` for editors.

The parser runs with callbacks that build documents in the place of a tree: a token comes as its index,
everything else as the part that another callback has returned.

Which blocks may stand on one line:

- that of an object, a material or a call, if its statements are calls and such blocks themselves;
- that of a `module`, `for`, `if`, `group`, `chain` or boolean node, if no statement in it has a block, or
  if its only statement has one without further blocks.

A comment that ends its line, or a blank line inside, opens a block; so does a line that would be too long.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.documents import (
    BLANK,
    LINE,
    SOFT,
    Comment,
    Comments,
    Concat,
    Doc,
    DocGroup,
    DocText,
    Fill,
    Indent,
    Notes,
    Part,
    after_of,
    attach,
    before_of,
    comments_of,
    ends_of,
    flat_of,
    joined,
    own_after_first,
    plain,
    render,
    sequence,
    texts_of,
)
from scenelang.language.lexer import Report, Tokens, run, scan
from scenelang.language.parser import limit_nesting, parse
from scenelang.language.reports import SceneError
from scenelang.language.tables import tables

_NUMBER = re.compile(r"[-+]?\.?[0-9]")


class Item(NamedTuple):
    """An item of a list, and what stands around the comma after it."""

    part: Part
    behind: str = ""  # block comments after the comma, each with a space before it
    after: Sequence[Comment] = ()  # comments behind the comma, less the item's own, that end the line


class Bracketed(DocGroup):
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
        if index == 0 and isinstance(part, DocText) and not (part.before or part.after):
            part = part.flat  # a blank line before the first item means nothing
        if not isinstance(part, str) or behind or after or not _NUMBER.match(part):
            return []
        texts.append(part)
    return texts if len(texts) > 1 else []


def blank_before(part: Part) -> bool:
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


_PATH = re.compile(r"\w+(\.\w+)*")
_NUMBER_LAST = re.compile(r"(?:^|\s)\.?[0-9][\w.+-]*$")  # comments may stand before it
_SURE_DIGITS = 300
"""A number of so many signs without an exponent is finite."""
_LONGEST_OPERATOR = 2
_UNIT_LETTERS = "adegmnrstu"
_LEVELS = {"*": 5, "/": 5, "%": 5, "+": 4, "-": 4, "<": 3, "<=": 3, ">": 3, ">=": 3, "==": 2, "!=": 2}
_LEVELS |= {"&&": 1, "||": 0}


class Operation(DocGroup):
    """Operands with operators of one level between them; those of the same level on the left are taken in."""

    __slots__ = ("level", "operands", "operators")

    def __init__(self, flat: str | None, operands: list[Part], operators: list[Part], level: int) -> None:
        super().__init__(flat, self._lines)
        self.operands = operands
        self.operators = operators
        self.level = level

    def _lines(self) -> Part:
        first = self.operands[0]
        parts: list[Part] = [first]
        after = [*after_of(first)]
        for operator, operand in zip(self.operators, self.operands[1:], strict=True):
            bare = len(flat_of(operator) or "") <= _LONGEST_OPERATOR
            after += before_of(operator)
            if bare:
                # The operator will begin the next line: what stands behind it belongs to the line before.
                after += [*after_of(operator), *before_of(operand)]
            if after:
                parts.append(Comments(own_after_first(after)))
            parts.append(LINE)
            if bare:
                parts += [operator, " ", operand]
            else:  # comments before the operator must not be overtaken
                parts.append(sequence([plain(operator, after=True), " ", operand]))
            after = [*after_of(operand)]
        return Concat(None, parts)


class Ternary(DocGroup):
    """``c ? a : b``, with the choices in its last place taken in."""

    __slots__ = ("clauses",)

    def __init__(self, flat: str | None, clauses: list[tuple[Part, ...]]) -> None:
        super().__init__(flat, self._lines)
        self.clauses = clauses  # (condition, ?, value, :) each, and (value,) as the last one

    def _lines(self) -> Part:
        *chosen, (otherwise,) = self.clauses
        if len(chosen) == 1:
            condition, mark, value, colon = chosen[0]
            tail = [LINE, mark, " ", value, LINE, colon, " ", otherwise]
            return sequence([condition, Indent(sequence(tail))])
        parts: list[Part] = []
        lead: list[Part] = []
        for condition, mark, value, colon in chosen:
            parts += [*lead, condition, " ", mark, " ", value]
            lead = [LINE, colon, " "]
        return sequence([*parts, *lead, otherwise])


class Statement(DocGroup):
    """A statement with ``depth`` blocks within each other; a simple one may stand in a block on one line."""

    __slots__ = ("depth", "simple")

    def __init__(self, flat: str | None, maker: Callable[[], Part], depth: int, simple: bool) -> None:
        super().__init__(flat, maker)
        self.depth = depth
        self.simple = simple


class Braced:
    """``{ … }``, whose place in a line is for the statement around it to say."""

    __slots__ = ("closing", "depth", "flat", "opening", "statements")

    def __init__(self, opening: Part, statements: Sequence[Item], closing: Part) -> None:
        self.opening = opening
        self.closing = closing
        self.statements = statements
        self.depth = 1
        self.flat: str | None = None
        simple = not (before_of(opening) or after_of(opening) or before_of(closing))
        for index, item in enumerate(statements):
            stmt = item.part
            assert isinstance(stmt, Statement)
            self.depth = max(self.depth, stmt.depth + 1)
            simple = simple and stmt.simple and not (stmt.before or stmt.after or (index and stmt.blank))
        if simple and not statements and flat_of(opening) == "{":
            self.flat = f"{{{flat_of(closing)}"
        elif simple:
            spaced = [part for item in statements for part in (" ", item.part)]
            self.flat = joined([opening, *spaced, " ", closing])

    def structural(self) -> str | None:
        """Its one line where it is the block of something that is not an object."""
        few = self.depth <= 1 or (self.depth == 2 and len(self.statements) == 1)
        return self.flat if few else None

    def open(self, behind: Sequence[Comment] = ()) -> list[Part]:
        """The block on lines of its own; ``behind`` are comments that stood before its opening brace."""
        opened = [*behind, *before_of(self.opening)]
        head: list[Part] = [plain(self.opening)]
        first: list[Part] = []
        if opened and flat_of(self.opening) != "{":  # comments before the brace must not be overtaken
            head = [Comments(opened, inside=True), plain(self.opening, after=True)]
        elif opened := [*opened, *after_of(self.opening)]:
            first = [Comments(own_after_first(opened))]
        if not (inside := entries(self.statements, before_of(self.closing))) and not opened:
            return [self.flat or "{}"]
        return [*head, Indent(Concat(None, [*first, *inside])), LINE, plain(self.closing)]


def entries(statements: Sequence[Item], dangling: Sequence[Comment]) -> list[Part]:
    """Statements and the comments between them, each on a new line, blank lines kept."""
    parts: list[Part] = []
    for item in statements:
        stmt = item.part
        parts.append(BLANK if parts and blank_before(stmt) else LINE)
        parts += comments_before(stmt)
        parts.append(stmt)
        if after := after_of(stmt):
            parts.append(Comments(own_after_first(after)))
    return [*parts, *comment_lines(dangling, begun=bool(parts))]


def _lined(parts: Sequence[Part], flat: str | None) -> DocGroup:
    """Document on the same line or, where that is too long, on a line of its own."""
    return DocGroup(None if flat is None else " " + flat, lambda: Indent(Concat(None, [LINE, *parts])))


class FileLayout:
    """Lays out one file that was read without mistakes."""

    def __init__(self, tokens: Tokens, notes: Mapping[int, Notes]) -> None:
        self.tokens = tokens
        self.notes = notes
        self.text = tokens.source.text
        self.starts = tokens.starts
        self.ends = tokens.ends
        self.doubtful = False  # at what only the builder of the tree can refuse

    def word(self, token: int) -> Part:
        text = self.text[self.starts[token] : self.ends[token]]
        if (note := self.notes.get(token)) is None:
            return text
        if note.leading or note.trailing:
            gap = "" if text in ("(", "[") else " "
            text += "".join(gap + comment for comment in texts_of(note.trailing))
            text = " ".join([*texts_of(note.leading), text])
        if not (note.before or note.after or note.blank):
            return text
        word = DocText(text)
        word.before, word.after, word.blank = note.before, note.after, note.blank
        return word

    def first(self, item: Part) -> list[Item]:
        return [Item(item)]

    def listed(self, items: list[Item], comma: int, item: Part) -> list[Item]:
        self._comma(items, comma)
        items.append(Item(item))
        return items

    def _comma(self, items: list[Item], comma: int) -> None:
        if comma in self.notes:
            note = self.notes[comma]
            item = items[-1].part
            after = [*note.before, *note.after]
            if after_of(item) or after:
                items[-1] = Item(item, "", [*after, *note.trailing])
            else:
                items[-1] = Item(item, "".join(f" {text}" for text in texts_of(note.trailing)))

    def enclosed(self, opening: int, *rest: Any) -> Part:
        return self._bracketed(DocGroup, opening, rest)

    def _bracketed(self, form: type[DocGroup], opening: int, rest: Sequence[Any]) -> Part:
        items: list[Item] = rest[0] if rest[1:] else []
        left, right = self.word(opening), self.word(rest[-1])
        if rest[2:]:
            self._comma(items, rest[1])
        flat: str | None = None
        if not (after_of(left) or before_of(right)):
            flat = joined([left, *inline(items), right])
        return ends_of(form(flat, lambda: broken(left, items, right)), left, right)

    name = keyword = word

    def path(self, left: Part, dot: int, right: Part) -> Part:
        return self._glued(left, self.word(dot), right)

    def _glued(self, *parts: Part) -> Part:
        """Parts without space between them; one word if they are words without comments around them."""
        text = ""
        for part in parts:
            if isinstance(part, str):
                text += part
            elif isinstance(part, DocText) and not (part.before or part.after):
                text += part.flat
            else:
                return sequence(parts)
        word = DocText(text)
        word.blank = not isinstance(parts[0], str) and parts[0].blank
        return word if word.blank else text

    # ------------------------------------------------------------ expressions

    def argument(self, *parts: Any) -> Part:
        value: Part = parts[-1]
        if not parts[1:]:
            return value
        name, equal = parts[:2]
        named = sequence([name, " ", self.word(equal), " ", value])
        if isinstance(value, Bracketed) and isinstance(named, Concat):
            # Keeps being told apart as something that opens on the line of a call it is alone in.
            return ends_of(Bracketed(named.flat, lambda: Concat(None, named.parts)), named, named)
        return named

    def range(self, start: Part, dots: int, stop: Part, *rest: Any) -> Part:
        loose = isinstance(start, (Operation, Ternary)) or isinstance(stop, (Operation, Ternary))
        left = flat_of(start)
        space = " " if loose or (left is not None and left.endswith(".")) else ""
        step = [" ", self.word(rest[0]), " ", rest[1]] if rest else []
        return sequence([start, space, self.word(dots), " " if loose else "", stop, *step])

    def conditional(self, condition: Part, mark: int, then: Part, colon: int, otherwise: Part) -> Part:
        head = (condition, self.word(mark), then, self.word(colon))
        flat = joined([condition, " ", head[1], " ", then, " ", head[3], " ", otherwise])
        tail = otherwise.clauses if isinstance(otherwise, Ternary) else [(otherwise,)]
        return ends_of(Ternary(flat, [head, *tail]), condition, otherwise)

    def binary(self, left: Part, op: int, right: Part) -> Part:
        operator = self.word(op)
        flat = joined([left, " ", operator, " ", right])
        level = _LEVELS.get(self.text[self.starts[op] : self.ends[op]], -1)
        if isinstance(left, Operation) and left.level == level >= 0:
            operands, operators = left.operands, left.operators
        else:
            operands, operators = [left], []
        operands.append(right)
        operators.append(operator)
        return ends_of(Operation(flat, operands, operators, level), left, right)

    def unary(self, op: int, operand: Part) -> Part:
        return self._glued(self.word(op), operand)

    def index(self, value: Part, opening: int, index: Part, closing: int) -> Part:
        left, right = self.word(opening), self.word(closing)
        if isinstance(index, str):
            return self._glued(value, left, index, right)
        return sequence([value, self._enclosed(left, index, right)])

    def member(self, value: Part, dot: int, name: Part) -> Part:
        # A dot right behind a number may be taken for its decimal point.
        space = " " if _NUMBER_LAST.search(flat_of(value) or "") else ""
        return self._glued(value, space, self.word(dot), name)

    def method(self, value: Part, dot: int, name: Part, args: Part) -> Part:
        if not _PATH.fullmatch(flat_of(value) or ""):
            self.doubtful = True
        return sequence([value, self.word(dot), name, args])

    def call_expr(self, name: Part, args: Part) -> Part:
        return sequence([name, args])

    def parenthesised(self, opening: int, value: Part, closing: int) -> Part:
        return self._enclosed(self.word(opening), value, self.word(closing))

    def _enclosed(self, left: Part, value: Part, right: Part) -> Part:
        inside = [Item(value)]
        doc = DocGroup(joined([left, value, right]), lambda: broken(left, inside, right, comma=""))
        return ends_of(doc, left, right)

    def vector(self, opening: int, *rest: Any) -> Part:
        return self._bracketed(Bracketed, opening, rest)

    def for_item(
        self, word: int, opening: int, variable: Part, within: int, iterable: Part, closing: int, item: Part
    ) -> Part:
        inside = sequence([variable, " ", self.word(within), " ", iterable])
        return self.if_item(word, opening, inside, closing, item)

    def if_item(self, word: int, opening: int, inside: Part, closing: int, item: Part) -> Part:
        return sequence([self.word(word), " ", self.parenthesised(opening, inside, closing), " ", item])

    def name_ref(self, name: Part) -> Part:
        return name

    def number(self, token: int) -> Part:
        text = self.text[self.starts[token] : self.ends[token]]
        if len(text) > _SURE_DIGITS or "E" in text or "e" in text.rstrip(_UNIT_LETTERS):
            self.doubtful = True
        return self.word(token)

    def string(self, token: int) -> Part:
        if self.text.find("\\", self.starts[token], self.ends[token]) >= 0:
            self.doubtful = True
        return self.word(token)

    color = true = false = word

    def callbacks(self) -> list[Callable[..., Any] | None]:
        """The callback of every rule, as `run` takes them; rules that only recovery uses have none."""
        names = (name for _, _, name in tables().rules)
        return [None if not name or name.startswith("bad_") else getattr(self, name) for name in names]

    def file(self, statements: list[Item] | None = None) -> Part:
        last = self.notes.get(len(self.tokens.kinds) - 1)
        return Concat(None, entries(statements or [], last.before if last else [])[1:])

    def following(self, items: list[Item], item: Part) -> list[Item]:
        items.append(Item(item))
        return items

    # ------------------------------------------------------------ statements without a block

    def _ended(self, parts: Sequence[Part], last: int, simple: bool = False) -> Statement:
        """A statement that ends with ``;``; comments before that go behind it."""
        semicolon = self.word(last)
        after = [*after_of(parts[-1]), *before_of(semicolon), *after_of(semicolon)]
        if after and last in self.notes:
            after += self.notes[last].trailing
            semicolon = ";"
        whole = [*parts[:-1], plain(parts[-1], before=len(parts) > 1), plain(semicolon)]
        stmt = Statement(joined(whole), lambda: sequence(whole), 0, simple)
        ends_of(stmt, parts[0], "")
        stmt.after = after
        return stmt

    def _assigned(self, equal: int, value: Part) -> list[Part]:
        """``=`` and what follows: operations go to a line of their own before they are broken."""
        sign = self.word(equal)
        commented = after_of(sign) or before_of(value)
        if not commented and not isinstance(value, (Operation, Ternary)):
            return [" ", sign, " ", value]
        doc = _lined([*comments_before(value), value], None if commented else flat_of(value))
        doc.after = after_of(value)
        return [" ", sign, doc]

    def version(self, word: int, number: int, last: int) -> Part:
        return self._ended([self.word(word), " ", self.number(number)], last)

    def model(self, word: int, name: Part, last: int) -> Part:
        return self._ended([self.word(word), " ", name], last)

    def param(self, word: int, name: Part, equal: int, default: Part, *rest: Any) -> Part:
        head = [self.word(word), " ", name, *self._assigned(equal, default)]
        if rest[1:]:
            limits = sequence([self.word(rest[0]), " ", rest[1]])
            head.append(ends_of(_lined([limits], flat_of(limits)), limits, limits))
        return self._ended(head, rest[-1])

    def let(self, word: int, *rest: Any) -> Part:
        *named, equal, value, last = rest
        return self._ended([self.word(word), " ", *named, *self._assigned(equal, value)], last)

    fn = let

    def import_(self, word: int, path: int, as_: int, alias: Part, last: int) -> Part:
        return self._ended([self.word(word), " ", self.string(path), " ", self.word(as_), " ", alias], last)

    def material_use(self, word: int, *rest: Any) -> Part:
        return self._use(self._material(word, rest[:-1]), rest[-1])

    def _material(self, word: int, names: Sequence[Part]) -> list[Part]:
        return [self.word(word), *[part for name in names for part in (" ", name)]]

    def call(self, name: Part, *rest: Any) -> Part:
        return self._use([name, *rest[:-1]], rest[-1])

    def _use(self, head: list[Part], last: int | Braced) -> Part:
        if isinstance(last, Braced):
            return self._blocked(head, last, structure=False)
        return self._ended(head, last, simple=True)

    def parameter(self, name: Part, *default: Any) -> Part:
        return sequence([name, " ", self.word(default[0]), " ", default[1]]) if default else name

    # ------------------------------------------------------------ statements with a block

    def block(self, opening: int, *rest: Any) -> Braced:
        return Braced(self.word(opening), rest[0] if rest[1:] else [], self.word(rest[-1]))

    def _blocked(self, head: Sequence[Part], body: Braced, structure: bool = True) -> Statement:
        """A statement that ends with a block; that of an object stands on one line with what holds it."""
        one_line = body.structural() if structure else body.flat
        begun = [*head[:-1], plain(head[-1], before=len(head) > 1)]
        flat = None if one_line is None or after_of(head[-1]) else joined([*begun, " ", one_line])
        stmt = Statement(
            flat,
            lambda: sequence([*begun, " ", *body.open(after_of(head[-1]))]),
            body.depth,
            simple=not structure and one_line is not None,
        )
        return ends_of(stmt, head[0], body.closing)

    def module(self, word: int, name: Part, params: Part, body: Braced) -> Part:
        return self._blocked([self.word(word), " ", name, params], body)

    def for_(
        self, word: int, opening: int, variable: Part, within: int, iterable: Part, closing: int, body: Braced
    ) -> Part:
        inside = sequence([variable, " ", self.word(within), " ", iterable])
        return self._blocked([self.word(word), " ", self.parenthesised(opening, inside, closing)], body)

    def if_(self, word: int, opening: int, condition: Part, closing: int, then: Braced, *rest: Any) -> Part:
        begun = self._blocked([self.word(word), " ", self.parenthesised(opening, condition, closing)], then)
        if not rest:
            return begun
        otherwise: Braced | Statement = rest[1]
        turn = self.word(rest[0])
        between = [*after_of(then.closing), *before_of(turn)]
        first = otherwise.opening if isinstance(otherwise, Braced) else otherwise
        inline = otherwise.structural() if isinstance(otherwise, Braced) else otherwise.flat
        flat = None
        if inline is not None and not (between or after_of(turn) or before_of(first)):
            flat = joined([begun, " ", turn, " ", inline])

        def broken() -> Part:
            parts = [begun.broken(), *([Comments(own_after_first(between)), LINE] if between else [" "])]
            if isinstance(otherwise, Braced):
                return sequence([*parts, plain(turn), " ", *otherwise.open(after_of(turn))])
            return sequence([*parts, plain(turn, after=True), " ", otherwise.broken()])

        last = otherwise.closing if isinstance(otherwise, Braced) else otherwise
        depth = max(then.depth, otherwise.depth)
        return ends_of(Statement(flat, broken, depth, simple=False), begun, last)

    def node(self, kind: Part, *rest: Any) -> Part:
        return self._blocked([kind, *rest[:-1]], rest[-1])

    def combined(self, op: Part, *rest: Any) -> Part:
        child: Statement = rest[-1]
        parts = [op, *rest[:-1], " ", child]
        stmt = Statement(joined(parts), lambda: sequence(parts), child.depth, child.simple)
        return ends_of(stmt, op, child)

    def material(self, word: int, *rest: Any) -> Part:
        body = rest[-1]
        if not isinstance(body, Braced):
            return sequence(self._material(word, rest))
        stmt = self._blocked(self._material(word, rest[:-1]), body, structure=False)
        return ends_of(Bracketed(stmt.flat, stmt.maker), stmt, stmt)


_BOM = "\ufeff"


def format_text(text: str, *, name: str = "<text>") -> str:
    """Lay a scene's text out in the canonical way.

    Args:
        text: the whole text of a file. A byte order mark at its beginning is kept; all lines end as the
            first one does, in LF or CRLF.
        name: what errors call it.

    Returns:
        The same tokens and comments in the canonical layout, but for stray semicolons, which go; equal to
        ``text`` if it has that already.

    Raises:
        SceneError: the text has syntax errors.
    """
    mark = _BOM if text.startswith(_BOM) else ""
    first = text.find("\n")
    newline = "\r\n" if first > 0 and text[first - 1] == "\r" else "\n"
    source = SourceFile(name, text.replace("\r\n", "\n"))
    report = Report(source)
    tokens = scan(source, report)
    limit_nesting(tokens, report)
    layout = FileLayout(tokens, attach(tokens))
    document: Part | None = None
    if not report.found:  # read as the parser reads it; None at a mistake
        document = run(tokens.kinds, layout.callbacks(), lambda states, values, at: None)
    if document is None or layout.doubtful:
        diagnostics = Diagnostics()
        parse(SourceFile(name, text), diagnostics)
        if diagnostics.errors:
            raise SceneError(diagnostics)
        if diagnostics.items:  # all of them of semicolons that stand for nothing
            for d in sorted(diagnostics, key=lambda d: -d.span.start if d.span is not None else 0):
                assert d.code == "W0101", "a warning about more than stray semicolons"
                assert d.span is not None
                text = text[: d.span.start] + text[d.span.end :]
            return format_text(text, name=name)
    assert document is not None, "a text without mistakes that the tables do not read"
    result = "".join(line + "\n" for line in render(document))
    source = SourceFile("", result)
    after = scan(source, Report(source))
    if _significant(tokens) != _significant(after) or comments_of(tokens) != comments_of(after):
        raise AssertionError("formatting changed the text's tokens or comments")  # and no file is to suffer
    return mark + result.replace("\n", newline)


def _significant(tokens: Tokens) -> list[str]:
    """The texts of the tokens but for commas before a closing bracket, which make no difference."""
    texts = [tokens.source.text[s:e] for s, e in zip(tokens.starts, tokens.ends, strict=True)]
    pairs = zip(texts, [*texts[1:], ""], strict=True)
    return [word for word, following in pairs if word != "," or following not in (")", "]")]


# ---------------------------------------------------------------- parts of a text


def format_range(text: str, start: int, end: int, *, name: str = "<text>") -> tuple[int, int, str]:
    """Lay out the statements of the file's top level that a range, in code points, touches.

    Returns start and end of what to replace, and the text to put there: an empty range where nothing changes.
    Raises `SceneError` for syntax errors anywhere; they call the text ``name``.
    """
    result = format_text(text, name=name)
    strays = Diagnostics()
    before, after = _statements(text, strays), _statements(result, Diagnostics())
    gone = [d.span.start for d in strays if d.span is not None]  # semicolons that stand for nothing
    if not all(any(first < at < last for first, last in before) for at in gone):
        return 0, len(text), result
    touched = [k for k, (first, last) in enumerate(before) if first < max(end, start + 1) and last > start]
    if not touched:
        return start, start, ""
    low, high = touched[0], touched[-1]
    place, there = slice(before[low][0], before[high][1]), slice(after[low][0], after[high][1])
    if _comments(text[place]) != _comments(result[there]):
        # A comment has gone behind the last semicolon: what stands up to the next statement goes along.
        place = slice(place.start, [*(first for first, _ in before), len(text)][high + 1])
        there = slice(there.start, [*(first for first, _ in after), len(result)][high + 1])
    if text[place] == result[there]:
        return start, start, ""
    return place.start, place.stop, result[there]


def _comments(text: str) -> list[str]:
    source = SourceFile("", text)
    return comments_of(scan(source, Report(source)))


def _statements(text: str, diagnostics: Diagnostics) -> list[tuple[int, int]]:
    return [(s.span.start, s.span.end) for s in parse(SourceFile("", text), diagnostics).statements]
