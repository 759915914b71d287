"""Figures in docs/index.md."""

CLAIMS: list[str] = []
GIVEN: dict[str, str] = {}
