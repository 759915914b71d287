"""From a Scene's transforms to steps: matrices and warps, checked against the model's dimension."""

from __future__ import annotations

from typing import NamedTuple

from scenelang.graph import affine
from scenelang.graph.steps import Affine, Rows, Step, Warp
from scenelang.scene import schema


class Refusal(NamedTuple):
    """Why a transform has no step: a code, the fact and advice."""

    code: str
    message: str
    help: str


def step_of(transform: schema.Transform, dimension: int) -> Step | Refusal:
    """The step that a transform stands for, or why there is none.

    Args:
        transform: any transform of a geometry.
        dimension: the model's, 2 or 3; in 2D nothing may leave the plane, and scales along z drop out.
    """
    if isinstance(transform, schema.Twirl):
        return Warp(transform.k, (0.0, 0.0))
    if isinstance(transform, schema.Bend):
        return Warp(0.0, (transform.k, 0.0))
    if isinstance(transform, (schema.Twist, schema.Displace)):
        return Refusal(
            "E0503",
            f"no renderer of this version draws `{transform.kind}`",
            "bend the shape with `twirl` or `bend` instead",
        )
    rows = _rows(transform)
    if dimension == 2:
        reason = _leaves_plane(transform, rows)
        if reason is not None:
            return reason
        rows = affine.flattened(rows)
    if not affine.usable(rows, dimension):
        return Refusal("E0312", *_singular(transform.kind, rows, dimension))
    return Affine(rows)


_Map = schema.Translate | schema.Rotate | schema.Scale | schema.Shear | schema.Matrix


def _rows(transform: _Map) -> Rows:
    if isinstance(transform, schema.Translate):
        return affine.translation(transform.x, transform.y, transform.z)
    if isinstance(transform, schema.Scale):
        return affine.scaling(transform.x, transform.y, transform.z)
    if isinstance(transform, schema.Rotate):
        return affine.rotation(transform.angle, transform.axis)
    if isinstance(transform, schema.Shear):
        return affine.shearing(transform.axes, transform.k)
    first, second, third, _ = transform.rows
    return (*first, *second, *third)


def _leaves_plane(transform: _Map, rows: Rows) -> Refusal | None:
    """In 2D: why ``rows`` would carry the plane out of itself."""
    kind = transform.kind
    if isinstance(transform, schema.Rotate) and transform.angle != 0.0 and any(transform.axis[:2]):
        axis = ", ".join(f"{v:g}" for v in transform.axis)
        return Refusal(
            "E0505", f"`rotate` about [{axis}] leaves the plane", "a 2D model turns about Z: leave `axis` out"
        )
    if rows[11] != 0.0:
        fact = f"`{kind}` by z = {rows[11]:g} leaves the plane"
        return Refusal("E0505", fact, "a 2D model has no z: leave the third component out")
    if isinstance(transform, schema.Shear) and transform.k != 0.0 and "z" in transform.axes:
        fact = f"`shear({transform.axes})` leaves the plane"
        return Refusal("E0505", fact, "a 2D model shears `xy` or `yx`")
    if isinstance(transform, schema.Matrix) and (rows[2] or rows[6] or rows[8] or rows[9]):
        fact = "`matrix` mixes z with x and y"
        return Refusal("E0505", fact, "for a 2D model the third row and column are those of the identity")
    return None


def _singular(kind: str, rows: Rows, dimension: int) -> tuple[str, str]:
    smallest, largest = affine.stretches(rows, dimension)
    if smallest <= affine.SINGULAR * largest:
        flat = "a line or a point" if dimension == 2 else "a plane, a line or a point"
        return f"`{kind}` is singular: it flattens everything to {flat}", "use factors other than 0"
    return (
        f"`{kind}` is singular in float32: it stretches by {smallest:.3g} to {largest:.3g}",
        f"stretches between {1 / affine.REACH:g} and {affine.REACH:g} can be undone",
    )
