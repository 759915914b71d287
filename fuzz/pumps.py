"""Pumps: texts that grow as far as wanted by a piece that is repeated, and the readers they are given to."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from random import Random
from typing import Final

from fuzz import text
from scenelang.assets.element_file import read_zoo
from scenelang.assets.tensors import TensorError
from scenelang.cli.commands.check import Scenes
from scenelang.cli.options import Request
from scenelang.compiler.program import ProgramError, parse_program
from scenelang.language.diagnostics import SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.formatting import format_text
from scenelang.language.reports import SceneError, render_github, render_json, render_sarif, render_text
from scenelang.language.session import Defines

NUMBER: Final = "¤"
"""Stands in a unit for the number of the repetition, so that pieces may differ."""


@dataclass(frozen=True, slots=True)
class Pump:
    """``head``, ``unit`` as often as it takes, ``close`` as often as that, ``tail``."""

    reader: str  # a key of `READERS`
    unit: str  # each `NUMBER` in it becomes a number that differs
    head: str = ""
    close: str = ""
    tail: str = ""

    def text(self, letters: int) -> str:
        """About so many letters."""
        parts, left, count = [self.head], letters - len(self.head) - len(self.tail), 0
        while left > 0 and self.unit:
            parts.append(self.unit.replace(NUMBER, str(count)))
            left -= len(parts[-1]) + len(self.close)
            count += 1
        return "".join([*parts, self.close * count, self.tail])

    def data(self) -> bytes:
        """As a file holds it."""
        return json.dumps(asdict(self), ensure_ascii=False).encode("utf-8", "surrogatepass")

    @classmethod
    def of(cls, data: bytes) -> Pump:
        """From such a file; raises ValueError for any other."""
        fields = json.loads(data.decode("utf-8", "surrogatepass"))
        if not isinstance(fields, dict) or not all(isinstance(value, str) for value in fields.values()):
            raise ValueError("not a pump")
        try:
            made = cls(**fields)
        except TypeError:
            raise ValueError("not a pump") from None
        if made.reader not in READERS:
            raise ValueError("no such reader")
        return made


# ---------------------------------------------------------------- readers


def _scenes(name: str, scene: str) -> Scenes:
    found = Scenes(Request(Source(params=Defines({}))))
    found.sources[name] = SourceFile(name, scene)
    return found


def _check(scene: str) -> None:
    """As `scenelang check` does, in every format."""
    found = _scenes("pump.nsg", scene).check().items
    for render in (render_text, render_json, render_sarif, render_github):
        render(found)


def _fix(scene: str) -> None:
    _scenes("pump.nsg", scene).fix()


def _json(scene: str) -> None:
    render_text(_scenes("pump.json", scene).check().items)


def _format(scene: str) -> None:
    with suppress(SceneError):
        format_text(scene)


def _edit(scene: str) -> None:
    """Requests of an editor when a document is opened, and again when a letter is typed in it."""
    from lsprotocol import types

    from scenelang.editors import completion, context, navigation
    from scenelang.editors import completion as tokens
    from scenelang.editors.workspace import Workspace

    docs = Workspace()
    document = docs.put("untitled:pump", scene, 1)
    offset = len(scene) // 2
    middle = document.lines.position(offset)
    list(navigation.symbols(document, document.file.statements))
    navigation.folding(document)
    navigation.selection(document, offset)
    navigation.workspace_symbols(docs, "aaaaaaaab")
    navigation.hover(docs, document, offset)
    document.change(types.TextDocumentContentChangePartial(types.Range(middle, middle), "x"))
    for place in (offset, len(document.text)):
        tokens.semantic_tokens(docs, document)
        completion.complete(docs, document, place, snippets=True)
        context.signature_help(docs, document, place)


def _program(header: str) -> None:
    data = header.encode("utf-8", "replace")
    with suppress(ProgramError):
        parse_program(struct.pack("<Q", len(data)) + data + bytes(64))


def _zoo(header: str) -> None:
    """The text stands as the outer header, and as ours inside one."""
    for outer in (header, json.dumps({"__metadata__": {"scenelang": header}})):
        data = outer.encode("utf-8", "replace")
        with suppress(TensorError):
            read_zoo(struct.pack("<Q", len(data)) + data + bytes(64))


READERS: Final[dict[str, Callable[[str], None]]] = {
    "check": _check,
    "fix": _fix,
    "fmt": _format,
    "edit": _edit,
    "json": _json,
    "program": _program,
    "zoo": _zoo,
}
_OF_TEXT: Final = ("check", "check", "check", "fix", "fmt", "edit")

# ---------------------------------------------------------------- pumps

_NODE: Final = '{"kind":"object","geometry":"star"'
_SHAPES: Final[tuple[tuple[str, ...], ...]] = (
    ("let a¤ = b¤;\n",),
    ("let name¤ = nane¤; ",),
    ("squarr¤; ",),
    ("a", "let ", "", " = 1;"),
    ("a¤, ", "fn f(", "", "z) = 1; let x = f("),
    ("param a¤ = 2 in 0..1;\n",),
    ("param a¤ = 1;\n",),
    ("fn f¤(x, y) = 1; ",),
    ("a¤, ", "fn f(", "", "z) = 1;"),
    ("b¤ = 1, ", "fn f(a) = 1; let x = f(", "", "a = 1);"),
    ("m(1, 2); ", "module m(a) { } "),
    ("square { translate(a, 0); } ", "let a = true; "),
    ("square { rotate(30); }\n",),
    ('import "x¤.nsg" as a¤; ',),
    ("1/0, ", "let a = [", "", "1];"),
    ("1 ", "let a = [", "", "];"),
    ("9", "let a = ", "", ";"),
    ("1e999, ", "let a = [", "", "1];"),
    ("0x1f, ", "let a = [", "", "1];"),
    (".a", "let a = a", "", ";"),
    ("[0]", "let v = [1]; let a = v", "", ";"),
    ("1 + ", "let a = ", "", "1;"),
    ("-", "let a = ", "", "1;"),
    ("a ? ", "let b = ", " : 1", ";"),
    ("(", "let a = ", ")", ";"),
    ("[", "let a = ", "]", ";"),
    ("rand(", "let a = ", ")", ";"),
    ("fn f(",),
    ("\\q",),
    ("\\q", 'let a = "', "", '";'),
    ('"a ',),
    ("'a' ",),
    ("@a ",),
    ("/*",),
    ("/* ",),
    ("// ",),
    ('\\"',),
    ("*/",),
    ("//",),
    ("#zz ",),
    ("; ",),
    ("é ",),
    ("( ",),
    ("} ",),
    ("{ }",),
    ("group {\n", "", "}\n"),
    ("group { ", "", "}"),
    ("group {", "", ""),
    ("square {\n}\n}\n",),
    ("union { star; ", "", "}"),
    ("subtract { square; union { square; star; } } ",),
    ("for (i in 0..0) { ", "", "}"),
    ("for (i in 0..1) ",),
    ("for (i = 0; i < 3; i++) { } ",),
    ("if (true) { } else ", "", "", "{ }"),
    ("else ",),
    ("if (a) b; else ",),
    ("let x 1; ",),
    ("let x == 1; ",),
    ("use <a.scad> ",),
    ("import as ",),
    ("color #d33; ",),
    ("material flat; ", "square {", "", "}"),
    ("translate(1, 1); ", "square {", "", "}"),
    ("smooth star; ", "chain {", "", "}"),
    ("vec3 f(float x) { return x; }\n",),
    ("translate([1, 0, 0]) cube(3); ",),
    ('{"a": ',),
    ("<a>",),
)
"""Unit, head, close, tail: what thought found."""
_DATA: Final = (
    Pump("json", _NODE + "},", '{"nodes":[', tail=_NODE + "}]}"),
    Pump("json", _NODE + ',"siz¤":1},', '{"nodes":[', tail=_NODE + "}]}"),
    Pump("json", _NODE + ',"kind":"object"},', '{"nodes":[', tail=_NODE + "}]}"),
    Pump("json", '{"kind":"group","children":[', '{"nodes":[', "]}", "]}"),
    Pump("json", '{"kind":"twirl","k":9},', '{"nodes":[' + _NODE + ',"transforms":[', tail="{}]}]}"),
    Pump("json", "[", tail="]"),
    Pump("json", '"\\u0061', '{"nodes":'),
    Pump("json", "1", '{"canvas":[', tail=",1]}"),
    Pump("program", '"a¤":{},', "{", tail='"b":0}'),
    Pump("program", "[", '{"vectors":', "]", "}"),
    Pump("program", "9,", '{"vectors":{"shape":[', tail="1]}}"),
    Pump("program", "9", '{"vectors":{"shape":[', tail="]}}"),
    Pump("zoo", '"a¤":{},', '{"format":1,"elements":{', tail='"b":0}}'),
    Pump("zoo", '"a¤":[[0,0]],', '{"format":2,"elements":{},"materials":{},"groups":{', tail='"b":0}}'),
    Pump("zoo", "[", '{"format":2,"elements":{"a":', "]", "}}"),
    Pump("zoo", '"a¤":{"dtype":"U8","shape":[0],"data_offsets":[0,0]},', "{", tail='"b":0}'),
)


def seeds() -> list[Pump]:
    """Texts by hand, for every reader of text in turn."""
    readers = dict.fromkeys(_OF_TEXT)
    return [*_DATA, *(Pump(reader, *shape) for shape in _SHAPES for reader in readers)]


_HEADS: Final = (
    "",
    "",
    "",
    "let a = ",
    "let a = [",
    "square { ",
    "group { ",
    "chain { ",
    "fn f(",
    "square { scale(",
)
_CLOSES: Final = {"(": ")", "[": "]", "{": "}", "/*": "*/"}


def drawn(generator: Random) -> Pump:
    """A pump at random: some words as they come, or a piece of a scene."""
    if generator.random() < 0.2:
        return mutated(generator.choice(_DATA), generator)
    gap, count = generator.choice(("", " ", " ", "\n")), generator.choice((1, 1, 2, 2, 3, 4, 6, 10))
    words = [generator.choice((f"a{NUMBER}", "a", *generator.sample(text.words(), 3))) for _ in range(count)]
    unit = gap.join([*words, ""])
    if generator.random() < 0.3:
        unit = generator.choice(text.PIECES) + gap
    if generator.random() < 0.3:
        unit = text.decode(text.mutate(text.encode(unit), generator))
    ends = "".join(_CLOSES[sign] for sign in reversed(unit) if sign in _CLOSES)
    close = ends if generator.random() < 0.3 else ""
    return Pump(generator.choice(_OF_TEXT), unit[:200], generator.choice(_HEADS), close)


def mutated(pump: Pump, generator: Random) -> Pump:
    """A change of one part of a pump."""
    fields = asdict(pump)
    name = generator.choice(("unit", "unit", "unit", "head", "tail", "close"))
    fields[name] = text.decode(text.mutate(text.encode(fields[name]), generator))[:200]
    return Pump(**fields)
