"""E05xx, W05xx: what a model cannot do."""

CODES: dict[str, str] = {}
