"""What the client may set, as ``initializationOptions`` or ``workspace/didChangeConfiguration``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

MAX_PAUSE_MS: Final = 60_000


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a session.

    Args:
        debounce_ms: how long typing has to pause before a scene is evaluated.
        model: draw with this model instead of the scene's.
        root: the folder that imports cannot leave, instead of the scene's.
        value_hints: show values behind lets.
        argument_hints: show parameter names in calls.
    """

    debounce_ms: float = 200.0
    model: str | None = None
    root: Path | None = None
    value_hints: bool = True
    argument_hints: bool = True

    @classmethod
    def read(cls, options: Any) -> Settings:
        """What a client sent; what is missing, of another type or out of range has its default."""
        if not isinstance(options, dict):
            return cls()
        given = options.get("scenelang", options)
        if not isinstance(given, dict):
            return cls()
        hints = given.get("inlayHints")
        hints = hints if isinstance(hints, dict) else {}
        pause, model, root = given.get("debounceMs"), given.get("model"), given.get("root")
        if isinstance(pause, bool) or not isinstance(pause, int | float) or not 0 <= pause <= MAX_PAUSE_MS:
            pause = cls().debounce_ms
        return cls(
            debounce_ms=float(pause),
            model=model if isinstance(model, str) and model else None,
            root=Path(root).expanduser() if isinstance(root, str) and root else None,
            value_hints=hints.get("values") is not False,
            argument_hints=hints.get("arguments") is not False,
        )
