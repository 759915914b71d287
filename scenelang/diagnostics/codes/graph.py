"""E04xx, W04xx: graph and booleans."""

CODES: dict[str, str] = {}
