"""E03xx, W03xx: types and values."""

CODES: dict[str, str] = {}
