"""Records: values with named fields, cheap to define; and work on deep trees.

A dataclass writes and compiles six methods when its module is imported, which takes half a millisecond. A
record compiles `__init__` alone and inherits the others. Type checkers hold it to be frozen and nothing does
at run time, so that making one takes a quarter of the time.
"""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING, Field, dataclass, field
from operator import attrgetter
from typing import Any, Final, dataclass_transform

_register: Callable[[type], type] = dataclass(init=False, repr=False, eq=False, match_args=False)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
class _RecordType(type):
    """Makes slots and `__init__` of a record from its annotations; one not ``frozen`` equals itself alone."""

    def __new__(
        cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any], frozen: bool = True
    ) -> _RecordType:
        hints = namespace.get("__annotations__", {})
        own = {n: namespace.pop(n, MISSING) for n, hint in hints.items() if "ClassVar" not in str(hint)}
        fields = {n: value for base in bases for n, value in getattr(base, "_defaults", {}).items()} | own
        if fields:
            head, lines = [], []
            for n, default in fields.items():
                head.append(n if default is MISSING else f"{n}=_{n}")
                build = f"_{n}.default_factory() if {n} is _{n} else " if isinstance(default, Field) else ""
                lines.append(f" self.{n} = {build}{n}")
            code = "\n".join([f"def __init__(self, {', '.join(head)}):", *lines])
            exec(code, {f"_{n}": default for n, default in fields.items()}, namespace)
            namespace.setdefault("_key", attrgetter(*fields))
        if not frozen:
            namespace |= {"__eq__": object.__eq__, "__hash__": object.__hash__}
        namespace |= {"__slots__": tuple(own), "__match_args__": tuple(fields), "_defaults": fields}
        namespace.setdefault("__doc__", name)
        # Registered, so that `dataclasses.fields` and `replace` take it.
        record = super().__new__(cls, name, bases, namespace)
        _register(record)
        return record


class Record(metaclass=_RecordType):
    """Base of records; two are equal where their classes and all fields are."""

    _key = attrgetter("__class__")  # what equality and the hash are about

    def __eq__(self, other: object) -> bool:
        if self.__class__ is not other.__class__:
            return NotImplemented
        return bool(self._key(self) == self._key(other))

    def __hash__(self) -> int:
        return hash(self._key(self))

    def __repr__(self) -> str:
        names = vars(self.__class__)["__match_args__"]
        fields = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        return f"{self.__class__.__qualname__}({fields})"


_STACK_FRAMES: Final = 200_000  # calls x nesting x frames per level, with room
_lock = threading.Lock()
_users = 0
_before = (0, False)  # the interpreter's recursion limit, and whether it collected cycles


@contextmanager
def deep_stack() -> Iterator[None]:
    """Allow deep recursion, which costs no C stack, and pause the collector of reference cycles meanwhile.

    The work makes many lasting objects and no cycles. Both switches are those of the interpreter, one for all
    threads: the last user puts them back.
    """
    global _users, _before
    with _lock:
        if _users == 0:
            _before = (sys.getrecursionlimit(), gc.isenabled())
            sys.setrecursionlimit(max(_before[0], _STACK_FRAMES))
            gc.disable()
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if _users == 0:
                sys.setrecursionlimit(_before[0])
                if _before[1]:
                    gc.enable()
