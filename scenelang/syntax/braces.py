"""Matching braces before parsing, so that every block is closed and a mistake stays inside one."""

from __future__ import annotations

from scenelang.syntax.tokens import Report, Tokens


def balance(tokens: Tokens, report: Report) -> None:
    """stub"""
