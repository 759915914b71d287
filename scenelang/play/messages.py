"""What a message of the page holds. All of these raise ValueError where it is something else."""

from __future__ import annotations

from typing import Any, Final

from scenelang.evaluate.limits import MAX_BYTES
from scenelang.play.folder import Refused

MOST_SIDE: Final = 8192
Json = dict[str, Any]


def string_of(message: Json, key: str) -> str:
    value = message.get(key)
    if not isinstance(value, str):
        raise ValueError(f"`{key}` is not a text")
    return value


def text_of(message: Json) -> str:
    """A scene's text."""
    text = string_of(message, "text")
    try:
        size = len(text.encode())
    except UnicodeEncodeError:
        raise Refused("the text has halves of characters") from None
    if size > MAX_BYTES:
        raise Refused(f"a text of more than {MAX_BYTES // 1_000_000} MB")
    return text


def id_of(message: Json) -> int | str:
    id = message.get("id")
    if isinstance(id, bool) or not isinstance(id, int | str) or len(str(id)) > 100:
        raise ValueError("`id` is neither a whole number nor a short text")
    return id


def whole_of(message: Json, key: str, low: int, high: int) -> int:
    value = message.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ValueError(f"`{key}` is not a whole number in {low}..{high}")
    return value


def wishes(message: Json) -> Json:
    """Params, frame and size."""
    params, size = message.get("params") or {}, message.get("size")
    if not isinstance(params, dict):
        raise ValueError("`params` is not an object")
    if size is not None:
        if not isinstance(size, list) or len(size) != 2:
            raise ValueError("`size` is neither null nor two numbers")
        size = [whole_of({"size": side}, "size", 1, MOST_SIDE) for side in size]
    frame = whole_of({"frame": 0, **message}, "frame", 0, 1 << 31)
    return {"params": params, "frame": frame, "size": size}


def in_unit(value: Any) -> Any:
    """A number of radians as a literal of the language; anything else as it is."""
    return f"{value!r}rad" if isinstance(value, int | float) and not isinstance(value, bool) else value
