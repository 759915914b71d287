"""Files that were made for the page, until it fetches them."""

from __future__ import annotations

import asyncio
import secrets


class Files:
    """Files that were made, each to be fetched once.

    Args:
        seconds: how long they are kept.
        most: bytes of all of them; the oldest go first.
    """

    def __init__(self, seconds: float = 600.0, most: int = 1 << 29) -> None:
        self._seconds, self._most = seconds, most
        self._kept: dict[str, tuple[str, str, bytes]] = {}

    def put(self, name: str, kind: str, data: bytes) -> str:
        """Keep a file of a media type; what fetches it."""
        key = secrets.token_urlsafe(16)
        self._kept[key] = name, kind, data
        while len(self._kept) > 1 and sum(len(kept[2]) for kept in self._kept.values()) > self._most:
            del self._kept[next(iter(self._kept))]
        asyncio.get_running_loop().call_later(self._seconds, self._kept.pop, key, None)
        return key

    def take(self, key: str) -> tuple[str, str, bytes] | None:
        """The name, media type and bytes."""
        return self._kept.pop(key, None)
