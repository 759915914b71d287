"""Records: frozen values with named fields, like `dataclass(frozen=True, slots=True)` but cheap to define.

A dataclass writes and compiles six methods when its module is imported, which takes half a millisecond. A
record compiles `__init__` alone and inherits the others. Type checkers hold it to be frozen and nothing does
at run time, so that making one takes a quarter of the time.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import Any, dataclass_transform

_register = dataclass(init=False, repr=False, eq=False, match_args=False)


@dataclass_transform(frozen_default=True)
class _RecordType(type):
    """Makes the slots and `__init__` of a record from its annotations."""

    def __new__(cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any]) -> _RecordType:
        hints = namespace.get("__annotations__", {})
        own = [field for field, hint in hints.items() if "ClassVar" not in str(hint)]
        fields = [*(f for base in bases for f in getattr(base, "__match_args__", ())), *own]
        defaults = [value for base in bases for value in getattr(base.__init__, "__defaults__", None) or ()]
        defaults += [namespace.pop(field) for field in own if field in namespace]
        if fields:
            lines = [f"def __init__(self, {', '.join(fields)}):", *(f" self.{f} = {f}" for f in fields)]
            exec("\n".join(lines), {}, namespace)
            namespace["__init__"].__defaults__ = tuple(defaults)
            namespace.setdefault("_key", attrgetter(*fields))
        namespace |= {"__slots__": own, "__match_args__": tuple(fields)}
        namespace.setdefault("__doc__", name)
        # Registered, so that `dataclasses.fields` and `replace` take it.
        return _register(super().__new__(cls, name, bases, namespace))


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
        fields = ", ".join(f"{name}={getattr(self, name)!r}" for name in self.__match_args__)
        return f"{self.__class__.__qualname__}({fields})"
