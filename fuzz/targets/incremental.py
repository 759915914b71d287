"""Any text, edited a few times: parsing again after each edit gives what parsing the whole text gives."""

from __future__ import annotations

import zlib
from random import Random

from fuzz import text
from fuzz.oracles import check_tree
from fuzz.target import Target, hold
from scenelang.deep import deep_stack
from scenelang.diagnostics.span import SourceFile
from scenelang.syntax.incremental import Edit, Parsed, parse_edited, parse_whole

EDITS = 4


def check(data: bytes) -> None:
    """Edit the text as its own checksum says, and compare each version with a parse of the whole."""
    scene = text.decode(data)
    generator = Random(zlib.crc32(data))
    versions: list[Parsed] = [parse_whole(SourceFile("fuzz.nsg", scene))]
    for _ in range(EDITS):
        scene, edit = change(scene, generator)
        source = SourceFile("fuzz.nsg", scene)
        versions.append(parse_edited(versions[-1], source, edit))
        _equal(versions[-1], parse_whole(SourceFile("fuzz.nsg", scene)))
        if generator.random() < 0.5:
            check_tree(versions[-1].file, source)
    for version in versions:  # also those that later edits took statements from
        _equal(version, parse_whole(SourceFile("fuzz.nsg", version.source.text)))


def change(scene: str, generator: Random) -> tuple[str, Edit]:
    """A text with one edit, as an editor makes them: typed, deleted, pasted."""
    start = generator.randint(0, len(scene))
    end = min(len(scene), start + generator.choice((0, 0, 0, 1, 1, 2, 5, 40)))
    new = generator.choice(
        ("", " ", "\n", ";", "{", "}", "(", ")", '"', "/", "*", "x", "1", generator.choice(text.words()),
         generator.choice(text.PIECES), scene[end : end + 30])
    )  # fmt: skip
    edited = scene[:start] + new + scene[end:]
    return edited, Edit(start, end, start + len(new))


def _equal(one: Parsed, other: Parsed) -> None:
    where = (other.source.text[:300],)
    with deep_stack():
        hold(one.file == other.file, "an edited tree is a parsed tree", where)
    hold(one.diagnostics == other.diagnostics, "mistakes after an edit are those of a parse", where)
    hold(
        (one.starts, one.ends) == (other.starts, other.ends), "statements stand where they are parsed", where
    )
    mine, whole = one.tokens, other.tokens
    same = (mine.kinds, mine.starts, mine.ends) == (whole.kinds, whole.starts, whole.ends)
    hold(same, "tokens after an edit are those of the text", where)


TARGET = Target(
    name="incremental",
    summary="after each of four edits of any text, tree, spans, tokens and diagnostics of the incremental "
    "parser are those of a whole parse, also for the versions before",
    check=check,
    seeds=text.seeds,
    mutate=text.mutate,
    dictionary=text.dictionary,
    most_bytes=1200,
    runs=13,
)
