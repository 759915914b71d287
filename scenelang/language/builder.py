"""Nodes of a Scene made from values that the evaluator has checked itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

from pydantic import BaseModel

from scenelang.language import tree
from scenelang.language.diagnostics import SourceFile, Span
from scenelang.language.reporter import Reporter
from scenelang.language.scene import Link, Material
from scenelang.language.session import UNBOUND, Defines, Env, Loader, Scope, Session, Slots
from scenelang.language.words import Combine

M = TypeVar("M", bound=BaseModel)

_set = object.__setattr__
_fields_set: dict[type[BaseModel], set[str]] = {}


def make(cls: type[M], fields: dict[str, Any]) -> M:
    """A frozen model from all its fields in order, unvalidated, six times faster than `model_construct`."""
    node = cls.__new__(cls)
    _set(node, "__dict__", fields)
    if (given := _fields_set.get(cls)) is None:
        given = _fields_set[cls] = set(fields)
    _set(node, "__pydantic_fields_set__", given)  # shared: frozen models never change it
    _set(node, "__pydantic_extra__", None)
    _set(node, "__pydantic_private__", None)
    return node


class Builder:
    """Contents of a node, from its block's statements; ``moved`` is the place of the first transform."""

    __slots__ = ("children", "material", "material_span", "moved", "properties", "transforms")

    def __init__(
        self, material: Material | None = None, material_span: Span | None = None, moved: Span | None = None
    ) -> None:
        self.children: list[Any] = []  # nodes, or the links of a chain
        self.transforms: list[Any] = []  # or the operations of a material
        self.properties: dict[str, tuple[Span, Any]] = {}  # of a material: place and value, None if wrong
        self.material, self.material_span, self.moved = material, material_span, moved

    def add(self, node: Any) -> None:
        self.children.append(node)

    def extend(self, other: Builder) -> None:
        """Add all that another builder of the same block holds."""
        self.children += other.children
        self.transforms += other.transforms
        if other.material is not None:
            self.material, self.material_span = other.material, other.material_span
        self.moved = self.moved or other.moved


class ChainBuilder(Builder):
    """The block of a chain: each child is joined by the word before it."""

    __slots__ = ("k", "op")

    def __init__(self) -> None:
        super().__init__()
        self.op: Combine = "union"
        self.k: float | None = None

    def add(self, node: Any) -> None:
        self.children.append(make(Link, {"op": self.op, "node": node, "k": self.k}))


Kind = Literal["file", "group", "chain", "object", "material", "unknown"]
"""Kind of a block, by its contents; ``unknown`` is that of something misspelt: all may stand there."""

Action = Callable[[Env, Builder], None]


@dataclass(slots=True)
class FileContext:
    """The state of one file."""

    source: SourceFile
    session: Session
    loader: Loader
    defines: Defines
    path: Path | None = None  # resolved; None for text without a file
    prefix: str = ""  # how the first file calls its params: empty, or ``lib.``
    env: Env = field(default_factory=lambda: [UNBOUND])
    scope: Scope = field(init=False)
    nesting: int = 0
    weight: int = 0  # half evaluation steps of what has been prepared of the block at hand
    first: tree.Stmt | None = None
    materials: dict[str, str] = field(default_factory=dict)  # of a file of elements: names in a Scene
    has_params: bool = False  # its own, or those of a file that it imports

    def __post_init__(self) -> None:
        self.scope = Scope(Slots(root=self.env))
        self.session.roots.append(self.env)

    def value(self, name: str) -> Any:
        """The value that a name of the file had in the last run."""
        return self.env[self.scope.names[name].slot]


class Site(NamedTuple):
    """Place of a statement or an expression: its scope, its file and its session."""

    file: FileContext
    scope: Scope
    kind: Kind  # of the block around it
    nested: bool = False  # a ``for`` or ``if`` stands between it and that block's braces
    repeated: bool = False  # a ``for`` stands around it, however far out
    block: Scope | None = None  # the names of that block, which tell it from others
    by_points: bool = False  # in the block of a polygon or a spline

    @property
    def session(self) -> Session:
        return self.file.session

    @property
    def report(self) -> Reporter:
        return self.file.session.report

    def inner(self, kind: Kind | None = None) -> Site:
        """The place inside a block: a new scope, and a new kind unless control flow passes it on."""
        scope = Scope(self.scope.slots, self.scope)
        if kind is None:
            return self._replace(scope=scope, nested=True)
        return Site(self.file, scope, kind, False, self.repeated, scope)
