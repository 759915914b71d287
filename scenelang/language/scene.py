"""The Scene: concrete, validated, frozen; its files of elements, and its text and JSON.

Angles are radians, lengths world units, colours numbers in [0, 1] as written (sRGB in 2D). Where nodes were
written is in a `SpanMap`, by `id()` of the node, so that a Scene needs no text.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from pydantic import BaseModel, Field, PrivateAttr, TypeAdapter, ValidationError, field_validator
from pydantic_core import ErrorDetails, PydanticSerializationError

from scenelang.assets import notebook
from scenelang.assets.element import Element, Part
from scenelang.assets.element_file import ElementFile, load_element_file
from scenelang.assets.files import depth_of_json, no_number, reason
from scenelang.assets.records import Record, deep_stack
from scenelang.assets.tensors import TensorError
from scenelang.language import library, nodes
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile, Span, listing, plural
from scenelang.language.library import SpanMap, Written
from scenelang.language.nodes import *
from scenelang.language.refusals import TAGS, said
from scenelang.language.reports import SceneError
from scenelang.language.scene_text import angle, node_lines, number, rgb, vector
from scenelang.language.words import BLEND, STAGE


def objects_of(zoo: ElementFile, file: str, name: str) -> tuple[Object, ...]:
    """The parts of a group of a file in their places and looks, in order of painting; raises KeyError."""
    if name not in zoo.groups:
        raise KeyError(f"`{file}` has no group `{name}`; it has {listing(zoo.groups) or 'none'}")
    return tuple(
        Object(
            f"{file}.{part.geometry}",
            _moves(part),
            _look(part, file, "flat" if zoo.geometries[part.geometry].dimension == 2 else "diffuse"),
        )
        for part in zoo.groups[name]
    )


def _moves(part: Part) -> tuple[Transform, ...]:
    moves: list[Transform] = []
    if part.turn:
        rows = [[*row, *[0.0] * (4 - len(row))] for row in part.turn]
        rows += [[float(k == at) for k in range(4)] for at in range(len(rows), 4)]
        moves.append(Matrix(tuple(tuple(row) for row in rows)))
    if part.size != 1.0:
        moves.append(Scale(part.size))
    if any(part.place):
        moves.append(Translate(*part.place))
    return tuple(moves)


def _look(part: Part, file: str, plain: str) -> Material | None:
    if part.material:
        return Material(f"{file}.{part.material}")
    return Material(plain, Color(part.color)) if part.color else None


class Elements(Frozen):
    """A file of elements; objects have its geometries as ``name.geometry``, and its materials likewise."""

    name: Word
    path: Annotated[
        str, Field(pattern=r'^[^"\\\x00-\x1f]+$', description="of the file, from the scene's folder")
    ]
    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$", description="SHA-256 of the file")]
    _zoo: ElementFile | None = PrivateAttr(None)  # not part of the value, which the digest identifies

    if TYPE_CHECKING:

        def __init__(self, name: str, path: str, digest: str) -> None: ...

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Elements) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash(self.digest)

    @staticmethod
    def of(name: str, path: str, zoo: ElementFile) -> Elements:
        elements = Elements(name, path, zoo.digest)
        elements._zoo = zoo
        return elements

    @property
    def zoo(self) -> ElementFile | None:
        """Contents of the file; None where it has not been read."""
        return self._zoo

    def group(self, name: str) -> Group | Object:
        """A ready group: its parts in places and looks, or its one part; raises KeyError if there is none."""
        if self.zoo is None:
            raise KeyError(f"`{self.path}` has not been read")
        objects = objects_of(self.zoo, self.name, name)
        return objects[0] if len(objects) == 1 else Group(objects)

    def read(self, root: Path) -> tuple[str, str] | None:
        """Read the file, within a folder where its path begins; code and message if that fails."""
        try:
            place = library.find(self.path) or (root / self.path).resolve()
            if not library.owns(place) and not place.is_relative_to(root.resolve()):
                return "E0215", f"`{self.path}` lies outside the import root"
            zoo = load_element_file(place)
        except TensorError as error:
            return "E0217", f"`{self.path}` is not a file of elements: {error}"
        except (OSError, RuntimeError, ValueError) as error:
            return "E0214", f"cannot read `{self.path}`: {reason(error)}"
        if zoo.digest != self.digest and not library.owns(place):  # what ships is mended at times
            return "E0217", f"`{self.path}` is not the file that the scene was made with"
        self._zoo = zoo
        return None


class Brought(Record):
    """Elements by the names that scenes have them by."""

    geometries: dict[str, Element]
    materials: dict[str, Element]
    unread: frozenset[str]  # names of files that have not been read

    @staticmethod
    def of(files: tuple[Elements, ...]) -> Brought:
        zoos = [(file.name, file.zoo) for file in files if file.zoo is not None]
        return Brought(
            {f"{name}.{key}": element for name, zoo in zoos for key, element in zoo.geometries.items()},
            {f"{name}.{key}": element for name, zoo in zoos for key, element in zoo.materials.items()},
            frozenset(file.name for file in files if file.zoo is None),
        )


def load_elements(path: str | Path, name: str | None = None) -> Elements:
    """Read a file of elements for a Scene.

    Args:
        path: the file, or one that ships: ``"std/meshes"``.
        name: what objects have before the dot; by default the file's, without its suffix.

    Raises:
        OSError: it cannot be read.
        TensorError: it is damaged, or no such file.
        ValueError: its name is not one that objects can have: give another.
    """
    zoo = load_element_file(library.find(str(path)) or path)
    return Elements.of(Path(path).stem if name is None else name, str(path), zoo)


class Scene(nodes.Brief):
    """A whole scene: settings and top-level nodes, which form a union in file order."""

    version: Version = 1
    model: Annotated[
        str | None,
        Field(pattern=r'^[^"\\\x00-\x1f]+$', description="the model to draw with; null: the usual one"),
    ] = None
    canvas: Annotated[tuple[Pixels, Pixels], Field(description="width and height in pixels")] = (256, 256)
    background: Annotated[
        Annotated[Opaque | None, STATED] | Unsaid,
        EITHER,
        Field(description="default: white in 2D, the sky in 3D; null: an image with alpha"),
    ] = "default"
    samples: SampleCount = 4
    camera: Annotated[Annotated[Camera, STATED] | Unsaid, EITHER, Field(description="3D")] = "default"
    light: Lights = "default"
    ground: Annotated[
        Annotated[Ground | None, STATED] | Unsaid, EITHER, Field(description="3D; null: without one")
    ] = "default"
    sky: Annotated[
        Annotated[Sky, STATED] | Unsaid, EITHER, Field(description="3D; what lights all from everywhere")
    ] = "default"
    animation: Annotated[
        Animation | None, Field(description="the animation that this Scene is one frame of")
    ] = None
    elements: Annotated[tuple[Elements, ...], Field(description="files of elements")] = ()
    nodes: Annotated[tuple[SceneNode, ...], Field(description="a union, the last on top")] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            version: Literal[1] = 1,
            model: str | None = None,
            canvas: tuple[int, int] = (256, 256),
            background: tuple[float, float, float] | str | None = "default",
            samples: Literal[4, 16] = 4,
            camera: Camera | Unsaid = "default",
            light: Light | Iterable[Light] | Unsaid | None = "default",
            ground: Ground | Unsaid | None = "default",
            sky: Sky | Unsaid = "default",
            animation: Animation | None = None,
            elements: Iterable[Elements] | Elements = (),
            nodes: Iterable[SceneNode] | SceneNode = (),
        ) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        if args:
            raise TypeError(f"Scene takes its arguments by name: {', '.join(cls._names())}")
        return super()._arranged(args, data)

    @field_validator("light")
    @classmethod
    def _lamps(cls, light: Any) -> Any:
        """One light is not a tuple, and none is None."""
        if not isinstance(light, tuple) or len(light) > 1:
            return light
        return light[0] if light else None

    def sized(self, size: tuple[int, int]) -> Scene:
        """The same scene on a canvas of width and height in pixels; raises ValueError but for 1 to 8192."""
        return self.model_copy(update={"canvas": Scene(canvas=size).canvas})

    def of_model(self, model: str | None) -> Scene:
        """The same scene for a model of that name; itself where there is none."""
        return self if model in (None, self.model) else self.model_copy(update={"model": model})

    def __repr__(self) -> str:
        """In short; `to_nsg` has all of it."""
        waiting, count = list(self.nodes), 0
        while waiting:
            node = waiting.pop()
            if isinstance(node, Object):
                count += 1
            else:
                waiting += [child.node if isinstance(child, Link) else child for child in node.children]
        width, height = self.canvas
        model = f", {self.model}" if self.model else ""
        frame = f", a frame of {self.animation.frames:,}" if self.animation else ""
        return f"Scene({plural(count, 'object')}, {width} x {height}{model}{frame})"

    __str__ = __repr__

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        return notebook.show(self, self.canvas, f"Scene of {plural(len(self.nodes), 'node')}")

    def to_nsg(self) -> str:
        """Canonical text that evaluates back to an equal Scene."""
        lines = ["nsg 1;"]
        if self.model is not None:
            lines.append(f'model "{self.model}";')
        lines += [f'import "{file.path}" as {file.name};' for file in self.elements]
        if self.canvas != (256, 256):
            lines.append(f"canvas({self.canvas[0]}, {self.canvas[1]});")
        if self.background != "default":
            lines.append(f"background({'none' if self.background is None else rgb(self.background)});")
        if self.samples != 4:
            lines.append(f"samples({self.samples});")
        for word in STAGE:
            stated = getattr(self, word)
            for value in stated if isinstance(stated, tuple) else (stated,):
                if value is None:
                    lines.append(f"{word}(none);")
                elif value != "default":
                    given = (f"{name} = {_stated(name, item)}" for name, item in value.__repr_args__())
                    lines.append(f"{word}({', '.join(given)});")
        if (clip := self.animation) is not None:
            loop = "" if clip.loop else ", loop = false"
            lines.append(f"animate({number(clip.seconds)}s, {number(clip.fps)}{loop});")
        text = "\n".join([*lines, *node_lines(self.nodes)]) + "\n"
        from scenelang.language.formatting import format_text  # what only evaluates needs none

        try:
            return format_text(text)
        except SceneError:  # nested deeper than text may be: to be looked at, not to be read back
            return text

    def to_json(self) -> str:
        """JSON that `from_json` reads back; like `model_dump_json`, and for scenes of any depth."""
        try:
            return self.model_dump_json()
        except PydanticSerializationError:
            with deep_stack():
                return json.dumps(_plain(self), separators=(",", ":"), allow_nan=False)

    @classmethod
    def from_json(cls, text: str | bytes, root: str | os.PathLike[str] | None = None) -> Scene:
        """Read JSON; like `model_validate_json`, and for scenes of any depth.

        Files of elements are read from the folder ``root`` alone. Raises `SceneError`, which names each
        place, for text that is not JSON, not a Scene, or has elements that cannot be read.
        """
        if isinstance(text, bytes):
            try:
                text = text.decode("utf-8-sig")
            except UnicodeDecodeError as error:
                raise _failure(f"not UTF-8 text: byte {error.start}") from None
        source, diagnostics = SourceFile("<json>", text), Diagnostics()
        scene = _read(source)
        _read_elements(scene, root, source, diagnostics)
        if diagnostics.errors:
            raise SceneError(diagnostics)
        return scene


def _stated(name: str | None, value: Any) -> str:
    if name in ("color", "horizon", "zenith"):
        return rgb(value)
    if isinstance(value, tuple):
        return vector(value)
    return angle(value) if name == "fov" else number(value)


def same_nodes(a: Scene, b: Scene) -> bool:
    """Test whether two frames hold the very same nodes, on one stage."""
    return (
        len(a.nodes) == len(b.nodes)
        and all(getattr(a, name) == getattr(b, name) for name in ("canvas", "background", "samples", *STAGE))
        and all(x is y for x, y in zip(a.nodes, b.nodes, strict=True))
    )


Key = str | int
_HEADINGS: Final = ("model", "geometry", "op", "name", "kind")
"""Keys that tell what a node is, the most telling first."""

# Possessive: text without end is read once, not once for each of its characters.
_TOKENS: Final = re.compile(r'"(?:[^"\\]++|\\.)*+"?|[\[\]{},:]|[^\s\[\]{},:"]++', re.DOTALL)


class Value(Record, frozen=False):
    """A JSON value: its place in the text and, in a list or an object, the values in it."""

    start: int
    end: int = -1
    items: dict[Key, Value] = field(default_factory=dict)

    def span(self, source: SourceFile) -> Span:
        """The place as a span."""
        return Span(source, self.start, self.end)

    def get(self, key: Key) -> Value:
        """The value at ``key``, or this one where there is none."""
        return self.items.get(key, self)


def read_places(text: str, twice: list[Value] | None = None) -> Value:
    """The places in a text that is known to be JSON; keys that their object has already go to ``twice``."""
    root = Value(0, len(text))
    stack: list[tuple[Value, bool]] = []  # open lists and objects, and whether they are lists
    key: Key | None = None
    for token in _TOKENS.finditer(text):
        first = text[token.start()]
        if first in ",:":
            continue
        if first in "]}":
            value, _ = stack.pop()
            value.end = token.end()
            key = None
        else:
            if stack:
                inside, is_list = stack[-1]
                if is_list:
                    key = len(inside.items)
                elif key is None:
                    word = token.group()
                    key = str(json.loads(word)) if "\\" in word else word[1:-1]
                    if twice is not None and key in inside.items:
                        twice.append(Value(token.start(), token.end()))
                    continue
                value = inside.items[key] = Value(token.start(), token.end())
            else:
                value = root = Value(token.start(), token.end())
            key = None
            if first in "[{":
                stack.append((value, first == "["))
    return root


def follow(root: Value, location: Sequence[Key]) -> tuple[Value, str]:
    """Value at pydantic's location of an error, and its path as `nodes[0].transforms[1].x`.

    A location also names the kinds of nodes on the way, which JSON does not nest by, and may end in a
    name that is missing.
    """
    value, path = root, ""
    for at, key in enumerate(location):
        if key in value.items:
            value = value.items[key]
        elif at + 1 < len(location) or isinstance(key, int) or key in TAGS:
            continue
        path += f"[{key}]" if isinstance(key, int) else f".{key}" if path else key
    return value, path


def record_places(scene: Scene, root: Value, source: SourceFile, spans: SpanMap) -> None:
    """Put the places of a scene and all its nodes, transforms and materials into ``spans``."""
    todo: list[tuple[BaseModel, Value]] = [(scene, root)]
    while todo:
        node, value = todo.pop()
        heading = next((name for name in _HEADINGS if name in type(node).model_fields), "")
        if heading in value.items or node is not scene:
            spans.record(node, Written(value.get(heading).span(source), value.span(source)))
        for name, item in node:
            here = value.get(name)
            items = enumerate(item) if isinstance(item, tuple) else ()
            todo += [(part, here.get(at)) for at, part in items if isinstance(part, BaseModel)]
            if isinstance(item, BaseModel):
                todo.append((item, here))


MAX_CHARS: Final = 200_000_000
_BRACKETS_PER_NODE: Final = 3  # a link of a chain: list, link, node
_PLAIN_DEPTH: Final = 150  # brackets that pydantic reads by itself
_MAX_SHOWN: Final = 20
_MAX_PATH: Final = 80
_WIDTH: Final = 90


def to_readable_json(scene: Scene) -> str:
    """JSON of a Scene for people: what differs from the defaults, indented, short values on one line."""
    with deep_stack():
        return _laid_out(_plain(scene, brief=True), "") + "\n"


def _plain(value: Any, *, brief: bool = False) -> Any:
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        return {
            name: _plain(item, brief=brief)
            for name, item in value.__dict__.items()
            if not (brief or name in nodes.LATER)
            or name in ("kind", "version")
            or not _same(item, fields[name].default)
        }
    return [_plain(item, brief=brief) for item in value] if isinstance(value, tuple) else value


def _same(item: Any, default: Any) -> bool:
    """Test whether a value is the default, bit for bit: -0.0 is not 0.0."""
    return bool(item == default) and repr(item) == repr(default)


def _laid_out(value: Any, margin: str) -> str:
    """JSON text whose lists and objects go over several lines where one is too short for them."""
    if not isinstance(value, dict | list) or not value:
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    inner = margin + "  "
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {_laid_out(item, inner)}" for key, item in value.items()]
    else:
        parts = [_laid_out(item, inner) for item in value]
    start, end = "{}" if isinstance(value, dict) else "[]"
    if sum(map(len, parts)) + 2 * len(parts) + len(margin) <= _WIDTH and not any("\n" in p for p in parts):
        return f"{start}{', '.join(parts)}{end}"
    return f"{start}\n{inner}" + f",\n{inner}".join(parts) + f"\n{margin}{end}"


def load_json(
    source: SourceFile, diagnostics: Diagnostics, root: Path | None = None
) -> tuple[Scene | None, SpanMap]:
    """A Scene from JSON text, None after reports, and where its nodes are written there; as `from_json`."""
    spans = SpanMap()
    try:
        scene = _read(source)
    except SceneError as error:
        for d in error.diagnostics:
            diagnostics.add(d.code, d.message, d.span, help=d.help)
        return None, spans
    record_places(scene, read_places(source.text), source, spans)
    _read_elements(scene, root, source, diagnostics)
    return scene, spans


def _read_elements(
    scene: Scene, root: str | os.PathLike[str] | None, source: SourceFile, diagnostics: Diagnostics
) -> None:
    for at, file in enumerate(scene.elements if root is not None else ()):
        if (fault := file.read(Path(root or ""))) is not None:
            value, _ = follow(read_places(source.text), ("elements", at, "path"))
            diagnostics.add(*fault, value.span(source))


def _read(source: SourceFile) -> Scene:
    text = source.text
    if len(text) > MAX_CHARS:
        raise _failure(f"more than {MAX_CHARS:,} characters of JSON")
    depth, too_deep = depth_of_json(text), f"nodes nested deeper than {MAX_NODE_DEPTH}"
    if depth > (MAX_NODE_DEPTH + 4) * _BRACKETS_PER_NODE:
        raise _failure(too_deep)
    try:
        if depth <= _PLAIN_DEPTH:
            scene = Scene.model_validate_json(text)
        else:
            with deep_stack():
                scene = _read_deep(source)
            if _node_depth(scene) > MAX_NODE_DEPTH:
                raise _failure(too_deep)
    except ValidationError as error:
        raise SceneError(_problems(error, source)) from None
    except UnicodeEncodeError as error:
        half = Span(source, error.start, error.end)
        raise _failure(f"half of a character at {error.start}", half) from None
    _refuse_repeated(source)
    return scene


def _refuse_repeated(source: SourceFile) -> None:
    """Refuse a sound text whose objects have a key twice: readers take the last one, people see the first."""
    repeated = False

    def note(pairs: list[tuple[str, Any]]) -> None:
        nonlocal repeated
        repeated = repeated or len({key for key, _ in pairs}) < len(pairs)

    with deep_stack():
        json.loads(source.text, object_pairs_hook=note, parse_int=len)  # of long numbers Python refuses some
    if repeated:
        twice: list[Value] = []
        read_places(source.text, twice)
        result = [Diagnostic("E0313", "a key that the object has already", v.span(source)) for v in twice]
        raise SceneError(result[:_MAX_SHOWN])


def _node_depth(scene: Scene) -> int:
    """Depth of nested nodes: 0 where none holds another."""
    depth, level = -1, list(scene.nodes)
    while level:
        depth += 1
        inside = [child for node in level if not isinstance(node, Object) for child in node.children]
        level = [child.node if isinstance(child, Link) else child for child in inside]
    return depth


def _read_deep(source: SourceFile) -> Scene:
    try:
        data = json.loads(source.text, parse_constant=no_number)
    except ValueError as error:
        raise _no_json(error, source) from None
    if isinstance(data, dict) and isinstance(data.get("nodes"), list):
        adapter: TypeAdapter[Any] = TypeAdapter(SceneNode)
        built = [_build(node, adapter, source, ("nodes", at)) for at, node in enumerate(data["nodes"])]
        data = {**data, "nodes": built}
    return Scene.model_validate(data)


def _build(data: Any, adapter: TypeAdapter[Any], source: SourceFile, path: tuple[Key, ...]) -> Any:
    """A node whose children are validated before it, so that no validation goes deep."""
    if isinstance(data, dict) and isinstance(data.get("children"), list):
        inside = [(*path, "children", at) for at in range(len(data["children"]))]
        children = [
            {**child, "node": _build(child["node"], adapter, source, (*here, "node"))}
            if data.get("kind") == "chain" and isinstance(child, dict) and "node" in child
            else _build(child, adapter, source, here)
            for child, here in zip(data["children"], inside, strict=True)
        ]
        for child in (data, *children):
            if isinstance(child, dict) and child.get("k") == BLEND:
                child["k"] = None
        data = {**data, "children": children}
    try:
        return adapter.validate_python(data)
    except ValidationError as error:
        raise SceneError(_problems(error, source, path)) from None


def _failure(message: str, span: Span | None = None, help: str | None = None) -> SceneError:
    return SceneError([Diagnostic("E0313", message, span, help=help)])


def _no_json(error: ValueError, source: SourceFile) -> SceneError:
    if isinstance(error, json.JSONDecodeError):
        said = error.msg[:1].lower() + error.msg[1:]
        return _failure(f"not JSON: {said}", Span(source, error.pos, min(error.pos + 1, len(source.text))))
    said = str(error).partition(":")[0]
    return _failure(f"not JSON: {said[:1].lower()}{said[1:]}")


def _problems(error: ValidationError, source: SourceFile, path: tuple[Key, ...] = ()) -> list[Diagnostic]:
    """One diagnostic for each place that does not fit."""
    errors = error.errors(include_url=False, include_input=False)[:_MAX_SHOWN]
    if errors[0]["type"] == "json_invalid":
        try:
            json.loads(source.text, parse_constant=no_number)
        except ValueError as wrong:
            return list(_no_json(wrong, source).diagnostics)
        return [Diagnostic("E0313", errors[0]["msg"].lower(), None)]
    root = read_places(source.text)
    return [_problem(item, (*path, *item["loc"]), root, source) for item in errors]


def _problem(item: ErrorDetails, location: tuple[Key, ...], root: Value, source: SourceFile) -> Diagnostic:
    from difflib import get_close_matches  # only mistakes need it

    value, path = follow(root, location)
    message, help = said(item), None
    match item["type"]:
        case "union_tag_not_found":
            message, path = "is missing", f"{path}.kind" if path else "kind"
        case "union_tag_invalid":
            words, tag = item["ctx"]["expected_tags"].replace("'", ""), str(item["ctx"]["tag"])
            near = get_close_matches(tag, words.split(", "), 1)
            message, path = f"no such kind, `{tag[:40]}`", f"{path}.kind" if path else "kind"
            help = f"did you mean `{near[0]}`? there are {words}" if near else f"there are {words}"
            value = value.get("kind")
        case "extra_forbidden":
            message = "unknown key"
            models = [m for m in vars(nodes).values() if isinstance(m, type) and issubclass(m, BaseModel)]
            fields = {name for model in models for name in model.model_fields}
            near = get_close_matches(str(location[-1]), sorted(fields), 1)
            help = f"did you mean `{near[0]}`?" if near else None
    path = path if len(path) <= _MAX_PATH else f"…{path[-_MAX_PATH:]}"
    return Diagnostic("E0313", f"{path}: {message}" if path else message, value.span(source), help=help)
