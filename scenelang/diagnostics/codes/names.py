"""E02xx, W02xx: names."""

CODES: dict[str, str] = {}
