"""From a Scene's transforms to steps: matrices and warps, checked against the model's dimension."""

from __future__ import annotations

from scenelang.graph import affine
from scenelang.graph.space import REACH, SINGULAR, Refusal, Space
from scenelang.graph.steps import Affine, Displace, Rows, Step, Twist, Warp
from scenelang.scene import schema


def step_of(transform: schema.Transform, space: Space) -> Step | Refusal:
    """The step that a transform stands for, or why there is none.

    Args:
        transform: any transform of a geometry.
        space: the model's; in the plane nothing may leave it, and scales along z drop out.
    """
    if isinstance(transform, schema.Twirl):
        return Warp(transform.k, (0.0, 0.0))
    if isinstance(transform, schema.Bend):
        return Warp(0.0, (transform.k, 0.0))
    if isinstance(transform, (schema.Twist, schema.Displace)):
        if space.dimension == 2:
            fact = f"`{transform.kind}` leaves the plane"
            return Refusal("E0505", fact, "bend the shape with `twirl` or `bend` instead")
        if isinstance(transform, schema.Twist):
            return Twist(transform.k)
        return Displace(transform.amount, transform.frequency)
    fitted = space.fitted(transform, _rows(transform))
    if isinstance(fitted, Refusal):
        return fitted
    if not space.usable(fitted):
        return Refusal("E0312", *_singular(transform.kind, fitted, space))
    return Affine(fitted)


def _rows(transform: schema.Transform) -> Rows:
    if isinstance(transform, schema.Translate):
        return affine.translation(transform.x, transform.y, transform.z)
    if isinstance(transform, schema.Scale):
        return affine.scaling(transform.x, transform.y, transform.z)
    if isinstance(transform, schema.Rotate):
        return affine.rotation(transform.angle, transform.axis)
    if isinstance(transform, schema.Shear):
        return affine.shearing(transform.axes, transform.k)
    assert isinstance(transform, schema.Matrix)
    first, second, third, _ = transform.rows
    return (*first, *second, *third)


def _singular(kind: str, rows: Rows, space: Space) -> tuple[str, str]:
    smallest, largest = space.stretches(rows)
    if smallest <= SINGULAR * largest:
        return f"`{kind}` is singular: it flattens everything to {space.thinner}", "use factors other than 0"
    return (
        f"`{kind}` is singular in float32: it stretches by {smallest:.3g} to {largest:.3g}",
        f"stretches between {1 / REACH:g} and {REACH:g} can be undone",
    )
