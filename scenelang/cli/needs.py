"""Packages that only some commands need."""

from __future__ import annotations

import importlib.util

import click


def need_metrics() -> None:
    """Stop with advice where the packages that measure pictures are not installed."""
    for name in ("flip_evaluator", "pytorch_msssim"):
        if importlib.util.find_spec(name) is None:
            raise click.UsageError(f"{name} is missing; pip install 'scenelang[eval]'")
