"""E01xx, W01xx: syntax."""

CODES: dict[str, str] = {}
