"""Habits from OpenSCAD, GLSL, JavaScript and Python, as `habits.txt` has them: found, reported, mended."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator
from functools import cache, lru_cache
from math import inf
from pathlib import Path
from typing import Final

from scenelang.assets.records import Record
from scenelang.language.diagnostics import Fix, common_start, ranked
from scenelang.language.foreign import OPERATORS
from scenelang.language.lexer import Report, Token, Tokens, reach
from scenelang.language.tables import END, tables
from scenelang.language.words import GEOMETRIES, LEAVES, NODES, OPERATIONS, TRANSFORMS

MAX_REPLAY: Final = 400
"""A statement with more tokens before the mistake is not tried again from its start."""

_FOLLOWED: Final = 80  # tokens behind a habit that are read to see whether it was one
_LONGEST: Final = 1000  # letters of a habit, without its block
_BEHIND: Final = ("BODY", "BLOCK", "STMT")  # holes at the end of a pattern, which tokens tell
_MOST: Final = 100  # mistakes of a file among which habits are looked for

_TYPES: Final = ("float", "int", "bool", "double", "number", "string", *(f"vec{n}" for n in "234"), "color")
_ELSEWHERE: Final = ("mirror", "resize", "offset", "multmatrix", "linear_extrude", "rotate_extrude", "hull")
_MOVES: Final = (*TRANSFORMS, "color", *_ELSEWHERE)
_WORDS: Final[dict[str, tuple[str, ...]]] = {
    "type": _TYPES,
    "fn": ("fn", "function", "func", "fun", "def", *_TYPES),
    "let": ("let", "var", "const", *_TYPES),
    "node": tuple(NODES),
    "object": (*NODES, *GEOMETRIES),
    "call": (*(TRANSFORMS | OPERATIONS), "canvas", "background"),
    "move": tuple(TRANSFORMS),
    "before": _MOVES,
    "next": _MOVES,
    "block": (*NODES, "for", "if"),
}
"""Words that a hole of this name takes."""


def head_word(tokens: Tokens, at: int) -> str:
    """First word of the statement that a token is in."""
    return tokens.text(tokens.head(at, MAX_REPLAY))


def quoted(text: str) -> str:
    text = " ".join(text.split())
    return f"`{text}`" if len(text) <= 40 else f"`{text[:37]}…`"


@lru_cache(maxsize=256)
def keywords_near(text: str) -> tuple[str, ...]:
    """Keywords that a word may have been meant for, nearest first."""
    words = [word for word in tables().literals if word.isalpha()]
    return tuple(word for _, word in ranked(text, words, max(1, len(text) // 3)))


class Habit(Record):
    pattern: str  # what is written
    meant: str  # what is written here; also read in its place, so that the rest can be checked
    message: str  # the fact; words that the pattern has found may stand in it
    help: str | None
    code: str
    safe: bool  # whether ``meant`` is sure to mean the same, and so is a fix


def _read() -> Iterator[Habit]:
    fact: tuple[str, str | None, str, bool] = ("", None, "", True)
    for line in Path(__file__).with_suffix(".txt").read_text("utf-8").splitlines():
        if line.startswith(" "):
            pattern, _, meant = line.partition("→")
            yield Habit(pattern.strip(), meant.strip(), *fact)
        elif line and not line.startswith("#"):
            message, *more = line.split(" | ")
            code = next((part for part in more if re.fullmatch("E[0-9]{4}", part)), "E0133")
            help = next((part for part in more if part not in (code, "unsafe")), None)
            fact = message, help, code, "unsafe" not in more


HABITS: Final = tuple(_read())
_ONCE, _BOUND, _BEFORE = (
    next(habit for habit in HABITS if habit.pattern == pattern)
    for pattern in ("<n><++|-->;", "<n> = <LINE> <;?>", "<before>(<P>) <o>")
)

# ---------------------------------------------------------------- patterns over text

_PIECE: Final = re.compile(
    r"(?P<gap>\s*)(?:<(?P<hole>[^<>\s?]+)(?P<optional>\??)>"
    r"|(?P<text>\w+|\.\.<(?!\w+>)|\.\.|[<>=!]=|&&|\|\||\S))"
)
_TYPED: Final = re.compile(rf"\b(?:{'|'.join(_TYPES)})\s+(?=[A-Za-z_])|\s*:\s*[A-Za-z_]\w*")
"""The types that stand before or after the names of parameters."""

_FLAT, _SOLID = (re.compile(rf"(?<![.\w])(?:{'|'.join(LEAVES[n])})\b") for n in (2, 3))


def _balanced(besides: str = "", word: str = "", depth: int = 4) -> str:
    """Expression for text whose brackets match, without a `;`, a brace or some signs, up to a word."""
    inner = rf"[(\[](?:{_balanced(depth=depth - 1)})?[)\]]" if depth else r"[(\[][)\]]"
    before = rf"(?!\b{word}\b)" if word else ""
    return rf'(?:{before}(?:"[^"\n]*"|[^"(){{}}\[\];{re.escape(besides)}]|{inner}))++'


@cache
def _expression(pattern: str) -> re.Pattern[str]:
    """The expression of a pattern, with a group for each hole; a block or body at its end is left out."""
    keywords = "|".join(word for word in tables().literals if word.isalpha() and word not in ("step", "as"))
    pieces = [match for match in _PIECE.finditer(pattern) if match["hole"] not in _BEHIND]
    parts, seen = [], set()
    for number, piece in enumerate(pieces):
        hole, text = piece["hole"], piece["text"]
        following = next((p["text"] for p in pieces[number + 1 :] if not p["optional"]), None)
        words = _WORDS.get(hole or "", re.findall(r"[^|]+", hole) if hole and not hole.isidentifier() else ())
        if not hole or words:
            choice = sorted(words or (text,), key=len, reverse=True)
            part = "|".join(
                re.escape(w) + (r"(?!\w)" if w[-1].isalnum() else "(?!=)" * (w in "<=>")) for w in choice
            )
        elif hole.islower():
            others = f"{keywords}|{'|'.join(_MOVES)}" if hole == "o" else keywords
            part = f"(?P=g_{hole})" if hole in seen else rf"(?!(?:{others})\b)\$?[A-Za-z_]\w*+"
        elif hole == "LINE":
            part = r"[^\n;{}]++"
        else:
            word = following if following and following[0].isalpha() else ""
            sign = following[0] if following and not word else "," * (number + 1 == len(pieces))
            part = _balanced(sign, word)
            part = rf"(?=[\d.#\[]){part}" if hole == "VALUES" else rf"(?=\S){part}"
        name = re.sub(r"\W", "_", f"g_{hole}") if hole else ""
        part = f"(?P<{name}>{part})" if hole and hole not in seen else f"(?:{part})"
        seen.add(hole)
        parts.append(rf"\s*+{part}" + "?" * bool(piece["optional"]))
    return re.compile("".join(parts))


_Match = dict[str, tuple[int, int]]
"""Indices of the first token and past the last one of each hole, and of the whole at ``""``."""


def _text(tokens: Tokens, place: tuple[int, int]) -> str:
    return tokens.source.text[slice(*tokens.place(*place))]


def _find(pattern: str, tokens: Tokens, at: int) -> _Match | None:
    """The tokens from ``at`` on that a pattern describes; None where they are others."""
    begin = tokens.starts[at]
    if (matched := _expression(pattern).match(tokens.source.text, begin, begin + _LONGEST)) is None:
        return None

    def index(offset: int) -> int:
        return bisect_left(tokens.starts, offset, at, len(tokens.starts) - 1)

    holes, stop = {}, index(matched.end())
    for piece in _PIECE.finditer(pattern):
        hole = piece["hole"]
        if hole in _BEHIND:
            end = _extent(tokens, hole, stop, at)
            if end > stop:
                holes[hole], stop = (stop, end), end
                stop += hole == "BLOCK" and tokens.text(stop) == ";"
            elif not piece["optional"]:
                return None
        elif hole:
            start, end = matched.span(re.sub(r"\W", "_", f"g_{hole}"))
            if start < end:
                holes[hole] = (index(start), index(end))
    if stop <= at or any(first >= last for first, last in holes.values()):
        return None
    return {**holes, "": (at, stop)}


def _extent(tokens: Tokens, hole: str, at: int, head: int) -> int:
    """Index after what a hole of `_BEHIND` takes from ``at`` on, behind a head."""

    def column(index: int) -> int:
        return tokens.starts[index] - tokens.source.text.rfind("\n", 0, tokens.starts[index])

    level = column(head) if tokens.on_new_line(at) else inf
    depth, last = 0, min(at + 4000, len(tokens.kinds) - 1)
    for index in range(at, last):
        sign = tokens.name(index)
        ended = depth == 0 and tokens.on_new_line(index) and column(index) <= level
        if (hole == "BODY" and ended) or (hole == "BLOCK" and index == at and sign != "{"):
            return index
        depth += (sign in ("(", "[", "{")) - (sign in (")", "]", "}"))
        if depth < 0:
            return index
        if hole != "BODY" and depth == 0 and (sign == "}" or (sign == ";" and hole == "STMT")):
            return index + 1
    return last


def _replaced(tokens: Tokens, match: _Match, meant: str) -> tuple[str, list[Token]]:
    """Text and tokens of a replacement: holes in order keep their places, all else is empty."""
    language = tables()
    text, new, (at, close) = "", [], tokens.place(*match[""])
    for piece in _PIECE.finditer(meant):
        hole, word = piece["hole"], piece["text"]
        if hole and hole not in match and hole != "material":
            continue  # what may be missing
        text += " " * bool(piece["gap"] and text)
        if hole in match:
            begin, written = tokens.starts[match[hole][0]], _text(tokens, match[hole])
            types = [t.span() for t in _TYPED.finditer(written)] if hole == "PARAMS" else []
            text += _TYPED.sub("", written) if types else written
            if begin >= at:
                part = tokens.part(*match[hole])
                new += [one for one in part if not any(i <= one[1] - begin < j for i, j in types)]
                at = part[-1][2]
            else:
                new.append((language.kind("BAD_EXPRESSION" if hole.isupper() else "NAME"), at, at))
        elif word and word.startswith("BAD_"):
            new.append((language.kind(word), at, close))  # behind the holes before it, so that spans nest
            at = close
        else:
            if hole:
                solid, flat = (shapes.search(tokens.source.text) for shapes in (_SOLID, _FLAT))
                word = "…" if bool(solid) == bool(flat) else "diffuse" if solid else "flat"
            text += word
            new.append((language.literals.get(word, language.kind("NAME")), at, at))
    return text, new


# ---------------------------------------------------------------- looking one up


def mend_habit(tokens: Tokens, report: Report, stack: list[int], first: int, at: int) -> bool:
    """Report a habit in the statement from ``first`` on, in which token ``at`` does not fit, and mend it."""
    if len(report.found) > _MOST:
        return False
    anchors = _anchors(tokens, first, at)
    for habit in HABITS:
        lead = _PIECE.match(habit.pattern)
        assert lead is not None
        text = lead["text"] or lead["hole"]
        for start in anchors.get(text, anchors["word" if text[1:] else "name"]):
            if (match := _find(habit.pattern, tokens, start)) is None:
                continue
            written, new = _replaced(tokens, match, habit.meant)
            if written != _text(tokens, match[""]) and _reads_on(
                tokens, stack, first, at, match, new, habit.meant
            ):
                _tell(tokens, report, habit, match, written)
                tokens.splice(*match[""], new)
                return True
    return False


def _anchors(tokens: Tokens, first: int, at: int) -> dict[str, list[int]]:
    """Indices at which a pattern may begin, by its first word, sign or hole."""
    anchors: dict[str, list[int]] = {"(": [], "[": [], "<": [at], "A": [], "name": [first], "word": [first]}
    anchors["word"] += [at - 1] * (at - 1 > first)
    depth = 0
    for index in range(at - 1, max(first, at - 200), -1):
        text = tokens.text(index)
        depth += (text in (")", "]")) - (text in ("(", "["))
        if depth <= 0 and text in ("(", "[", ",", "=", "return") and not anchors["A"]:
            anchors["A"] = [index + 1]
        if depth < 0:
            before = tokens.text(index - 1)
            anchors |= {"for": [index - 1]} if before == "for" else {}
            operand = before in (")", "]") or (before.isidentifier() and before not in ("in", "return"))
            anchors[text] = [] if operand else [index]
            break
    anchors["material"] = [first, *anchors["A"]]
    anchors["rgb|srgb"] = [*anchors["word"], at]
    return anchors


def _reads_on(
    tokens: Tokens, stack: list[int], first: int, at: int, match: _Match, new: list[Token], meant: str
) -> bool:
    """Test whether a replacement lets the rest of the statement read, or the head of one with a block."""
    start, stop = match[""]
    if start > at:
        return False
    before, after = tokens.part(first, start), tokens.part(stop, stop + _FOLLOWED)

    def left(middle: list[Token]) -> int:
        """Number of tokens behind the first that does not fit; words for operators are mended later."""
        words = [(kind, OPERATORS.get(tokens.source.text[i:j])) for kind, i, j in before + middle + after]
        kinds = [tables().literals[sign] if sign else kind for kind, sign in words]
        return len(kinds) - reach(stack.copy(), kinds, 0, len(kinds))

    rest = left(new)
    read = len(after) - rest
    ends = [tables().literals[sign] for sign in ";{}"]
    end, whole = 0, meant[-1:] in (";", "}", "{", "") or "BAD_S" in meant
    while not whole and end < len(after) and after[end][0] != END:
        end += 1
        whole = after[end - 1][0] in ends
    head = "BODY" in meant or meant[:3] == "for"
    further = rest < left(tokens.part(start, stop))
    if "STMT" in meant:  # what is wrong in the statement itself is reported later
        return further
    return further and read >= max(meant[:3] != "for", at - stop + 1) and (read >= end or head)


def _tell(tokens: Tokens, report: Report, habit: Habit, match: _Match, new: str) -> None:
    def filled(words: str) -> str:
        return re.sub("<([a-z]+)>", lambda hole: _text(tokens, match[hole[1]]), words)

    start, end = tokens.place(*match[""])
    if start in tokens.reported:
        return
    text = tokens.source.text
    old = text[start:end]
    code, message, help = habit.code, filled(habit.message), habit.help and filled(habit.help)
    safe = habit.safe and "…" not in new and "//" not in old and "/*" not in old
    if habit is _BOUND:
        if re.search(rf"\b{_text(tokens, match['n'])}\b", text[:start]):
            code, message, help, safe = _ONCE.code, filled(_ONCE.message), _ONCE.help, False
        elif text.count("{", 0, start) > text.count("}", 0, start):  # perhaps a property
            help, safe = "in a block write material flat { color(…); }, translate(…); or scale(s);", False
    elif habit.message == _BEFORE.message and match[""][0] and head_word(tokens, match[""][0] - 1) in _MOVES:
        safe = False  # it may lack its `;`, and what follows be a material
    elif "STMT" in match and tokens.on_new_line(match["STMT"][0]):
        safe = False  # more of the lines below may be meant
    # What both have at their ends is not shown.
    lead = _alike(old, new)
    tail = _alike(old[lead:][::-1], new[lead:][::-1])
    lead += len(old[lead:]) - len(old[lead:].lstrip())
    place = (start + lead, end - tail) if lead + tail < len(old) else (start, end)
    fix: Fix | None = None
    if safe:
        fix = report.change(start, end, new, f"write {quoted(new)}" if new.strip() else "remove it")
    report.add(code, message, *place, help=help, fix=fix)


def _alike(one: str, other: str) -> int:
    """Number of letters that two texts have in common at their start, without half a word."""
    count = common_start(one, other)
    while count and re.match(r"\w\w", one[count - 1 : count + 1] + other[count : count + 1]):
        count -= 1
    return count
