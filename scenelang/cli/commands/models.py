"""``scenelang models``: what there is to draw with, and where it comes from; imports no torch."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Literal

import click

if TYPE_CHECKING:
    from scenelang.models.manifest import Manifest


@click.command("models")
@click.argument("name", required=False)
@click.option("--format", "kind", type=click.Choice(["human", "json"]), default="human", show_default=True)
def command(name: str | None, kind: Literal["human", "json"]) -> None:
    """List the models, or tell all about the model NAME.

    That is its manifest (what it can draw, which ranges it was trained or measured in, what was
    measured), its weights, and how they were trained.
    """
    from scenelang.models.manifest import available, load_manifest

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
    if name not in known:
        raise click.UsageError(f"No model `{name}`; there is {', '.join(known)}.")
    facts = _facts(load_manifest(name))
    click.echo(json.dumps(facts, indent=2) if kind == "json" else _text(facts))


def _facts(manifest: Manifest) -> dict[str, Any]:
    """Manifest and weights; the weights are null where they are missing or damaged."""
    from scenelang.models.weights import ModelError, read_facts

    try:
        weights: dict[str, Any] | None = asdict(read_facts(manifest.name))
    except (OSError, ModelError):
        weights = None
    return {"manifest": asdict(manifest), "weights": weights}


def _text(facts: dict[str, Any]) -> str:
    manifest, weights = facts["manifest"], facts["weights"]
    lines = [f"{manifest['name']}: {manifest['summary']}", ""]
    lines += [f"{key:12} {manifest[key]}" for key in ("dimension", "renderer", "lifting")]
    words = ("geometries", "materials", "transforms", "material_ops")
    lines += [f"{key.replace('_', ' '):12} {', '.join(manifest[key])}" for key in words]
    lines += [f"{'limits':12} {_pairs(manifest['limits'])}", "", "trained or measured in"]
    lines += [f"  {key:10} {low:g} to {high:g}" for key, (low, high) in manifest["trained"].items()]
    if manifest["measured"]:
        lines += ["", "measured", *_tree(manifest["measured"], "  ")]
    lines.append("")
    if weights is None:
        return "\n".join([*lines, "weights      missing or damaged"])
    lines += [
        f"weights      {weights['parameters']:,} numbers, {weights['bytes']:,} bytes",
        f"sha256       {weights['digest']}",
        "",
        "training",
        *_tree(weights["training"], "  "),
    ]
    return "\n".join(lines)


def _pairs(values: dict[str, Any]) -> str:
    return ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in values.items())


def _tree(values: dict[str, Any], indent: str) -> list[str]:
    """A line for each value; dictionaries within are indented."""
    lines = []
    for key, value in values.items():
        if isinstance(value, dict) and any(isinstance(v, dict | list) for v in value.values()):
            lines += [f"{indent}{key}", *_tree(value, indent + "  ")]
        elif isinstance(value, dict):
            lines.append(f"{indent}{key:10} {_pairs(value)}")
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            lines += [f"{indent}{key:10} {_pairs(v)}" for v in value]
        else:
            lines.append(f"{indent}{key:10} {value}")
    return lines
