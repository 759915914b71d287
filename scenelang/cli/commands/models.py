"""``scenelang models``: what there is to draw with, and where it comes from; imports no torch."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any, Literal

import click

from scenelang.cli import options
from scenelang.compiler.manifest import Manifest, available, load_manifest
from scenelang.compiler.weights import ModelError, read_facts


@click.command("models")
@click.argument("name", required=False)
@options.choice("--format", "kind", words="human json", help="Format of what is printed.")
def command(name: str | None, kind: Literal["human", "json"]) -> None:
    """List the models, or tell all about the model NAME.

    That is its manifest (what it can draw, which ranges it was trained or measured in, what was
    measured), its weights, and how they were trained.
    """
    known = available()
    if name is None:
        told = [_facts(load_manifest(each)) for each in known]
        if kind == "json":
            click.echo(json.dumps(told, indent=2))
            return
        for facts in told:
            manifest = facts["manifest"]
            click.echo(f"{manifest['name']}  {manifest['dimension']}D  {manifest['summary']}")
        return
    try:
        facts = _facts(load_manifest(name))
    except KeyError:
        raise click.UsageError(f"No model `{name}`; there is {', '.join(known)}.") from None
    click.echo(json.dumps(facts, indent=2) if kind == "json" else _text(facts))


def _facts(manifest: Manifest) -> dict[str, Any]:
    """Manifest and weights; the weights are null where they are missing or damaged."""
    try:
        weights: dict[str, Any] | None = read_facts(manifest.name)
    except (OSError, ModelError):
        weights = None
    return {"manifest": asdict(manifest), "weights": weights}


def _text(facts: dict[str, Any]) -> str:
    manifest, weights = facts["manifest"], facts["weights"] or {"weights": "missing or damaged"}
    lines = [f"{manifest['name']}: {manifest['summary']}", ""]
    lines += _tree({k: v for k, v in manifest.items() if v and k not in ("name", "summary")}, "")
    return "\n".join([*lines, "", "weights", *_tree(weights, "  ")])


def _tree(values: dict[str, Any], indent: str) -> list[str]:
    """A line for each value; dictionaries within are indented."""
    lines = []
    for key, value in values.items():
        title = f"{indent}{key.replace('_', ' '):12} "
        if isinstance(value, dict) and any(isinstance(v, dict | list | tuple) for v in value.values()):
            lines += [title.rstrip(), *_tree(value, indent + "  ")]
        elif isinstance(value, list | tuple) and value and isinstance(value[0], dict):
            lines += [title + _line(v) for v in value]
        else:
            lines.append(title + _line(value))
    return lines


def _line(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key.replace('_', ' ')} {_line(each)}" for key, each in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(_line, value))
    if isinstance(value, float):
        return f"{value:.4g}"
    return f"{value:,}" if type(value) is int else str(value)
