"""Mutations of JSON: parts are removed, repeated, exchanged, renamed, nested and made extreme."""

from __future__ import annotations

import copy
import json
from random import Random
from typing import Any, Final

EXTREME: Final[tuple[Any, ...]] = (
    None, True, False, 0, -1, 1, 2**31, 2**63, -(2**63) - 1, 10**400, 0.0, -0.0, 0.1, 1e-320, 1e308,
    -1e308, float("inf"), float("-inf"), float("nan"), "", "x", "union", "\0", "\ud800", "\u202e",
    "a" * 5000, "1", "é",
    [], {}, [[]], [{}], {"kind": "object"}, [0, 0, 0], [1, 2], [1, 2, 3, 4, 5], {"__metadata__": {}},
)  # fmt: skip


def load(data: bytes) -> Any:
    """The value of JSON bytes; ValueError or RecursionError where they are none."""
    return json.loads(data.decode("utf-8", "surrogatepass"))


def dump(value: Any) -> bytes:
    """Bytes of a value; NaN and infinities as Python writes them."""
    return json.dumps(value, ensure_ascii=False).encode("utf-8", "surrogatepass")


def mutate(value: Any, generator: Random, others: tuple[Any, ...] = ()) -> Any:
    """A copy of a JSON value with one change somewhere, perhaps a part of ``others`` put in."""
    value = copy.deepcopy(value)
    places = _places(value)
    if not places:
        return _new(generator, others, value)
    holder, key = generator.choice(places)
    change = generator.randrange(9)
    if change == 0:
        del holder[key]
    elif change == 1 and isinstance(holder, list):
        holder[key:key] = [copy.deepcopy(holder[key]) for _ in range(generator.choice((1, 1, 2, 30)))]
    elif change == 2:
        other, at = generator.choice(places)
        holder[key] = copy.deepcopy(other[at])
    elif change == 3 and isinstance(holder, dict):
        name = generator.choice((*holder, "kind", "extra", "x", "children", "node", "format", ""))
        holder[name] = holder.pop(key)
    elif change == 4:
        for _ in range(generator.choice((1, 2, 10, 60))):
            holder[key] = generator.choice(([holder[key]], {"children": [holder[key]], "kind": "group"}))
    elif change == 5 and isinstance(holder[key], int | float) and not isinstance(holder[key], bool):
        number = holder[key]
        holder[key] = generator.choice((-number, number + 1, number * 1000, number // 3, 0))
    elif change == 6 and isinstance(holder[key], str):
        holder[key] = generator.choice(
            (holder[key] * 2, holder[key][:-1], holder[key] + "\n", f'"{holder[key]}')
        )
    else:
        holder[key] = _new(generator, others, holder[key])
    return value


def _new(generator: Random, others: tuple[Any, ...], old: Any) -> Any:
    if others and generator.random() < 0.4:
        other = generator.choice(others)
        places = _places(other)
        if places:
            holder, key = generator.choice(places)
            return copy.deepcopy(holder[key])
    return copy.deepcopy(generator.choice((*EXTREME, [old])))


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Holder and key of every part of a value."""
    found: list[tuple[Any, Any]] = []
    todo = [value]
    while todo and len(found) < 5000:
        at = todo.pop()
        keys = at.keys() if isinstance(at, dict) else range(len(at)) if isinstance(at, list) else ()
        for key in keys:
            found.append((at, key))
            todo.append(at[key])
    return found


def flip(data: bytes, generator: Random) -> bytes:
    """A few bytes changed, removed, doubled or put in, whatever they mean."""
    buffer = bytearray(data)
    for _ in range(generator.randint(1, 4)):
        at = generator.randint(0, len(buffer))
        end = min(len(buffer), at + generator.choice((1, 1, 4, 8, 64)))
        match generator.randrange(5):
            case 0:
                del buffer[at:end]
            case 1:
                buffer[at:at] = buffer[at:end]
            case 2:
                buffer[at:at] = generator.randbytes(generator.choice((1, 4, 8)))
            case 3:
                buffer[at:end] = bytes([generator.choice((0, 255, 127, 128, 34, 91, 123))]) * (end - at)
            case _:
                if at < len(buffer):
                    buffer[at] ^= 1 << generator.randrange(8)
    return bytes(buffer)
