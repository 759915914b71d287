"""Random Scenes for hypothesis: every kind of node, numbers of every size."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

import scenelang as nsg

numbers = st.one_of(
    st.floats(-1e6, 1e6, allow_nan=False),
    st.floats(allow_nan=False, allow_infinity=False),
    st.integers(-1000, 1000).map(float),
    st.sampled_from([0.0, -0.0, 1.0, 0.1, 1e-300, 5e-324, 1.7976931348623157e308]),
)
factors = numbers.filter(lambda x: x != 0.0)
angles = st.one_of(st.integers(-720, 720).map(math.radians), st.floats(-1e9, 1e9, allow_nan=False))
units = st.one_of(st.floats(0, 1), st.integers(0, 255).map(lambda n: n / 255))
colours = st.tuples(units, units, units)
axes = st.sampled_from(["xy", "xz", "yx", "yz", "zx", "zy"])

translations = st.builds(nsg.Translate, x=numbers, y=numbers, z=numbers)
rotations = st.builds(
    nsg.Rotate,
    angle=angles,
    axis=st.one_of(
        st.sampled_from([(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]), st.tuples(numbers, numbers, numbers).filter(any)
    ),
)
scales = st.one_of(st.builds(nsg.Scale, x=factors, y=factors, z=factors), factors.map(nsg.Scale.uniform))
shears = st.builds(nsg.Shear, axes=axes, k=numbers)
transforms = st.one_of(
    translations,
    rotations,
    scales,
    shears,
    st.builds(nsg.Twirl, k=numbers),
    st.builds(nsg.Bend, k=numbers),
    st.builds(nsg.Twist, k=numbers),
    st.builds(nsg.Displace, amount=numbers, frequency=numbers),
    st.builds(nsg.Grow, r=st.floats(-0.5, 1)),
    st.builds(nsg.Shell, w=st.floats(0.001, 1)),
    st.tuples(numbers, numbers, numbers).map(
        lambda t: nsg.Matrix(rows=((2, 0, 0.5, t[0]), (0, -1, 0, t[1]), (0, 0, 3, t[2]), (0, 0, 0, 1)))
    ),
)
operations = st.one_of(
    translations,
    rotations,
    scales,
    shears,
    st.just(nsg.Flip()),
    st.builds(nsg.Color, rgb=colours),
    st.builds(nsg.Grayscale, amount=units),
    st.builds(nsg.Hue, angle=angles),
)
powers = st.floats(0, 1e6)
materials = st.none() | st.builds(
    nsg.Material,
    name=st.sampled_from(["flat", "diffuse", "volumetric", "metal"]),
    ops=st.lists(operations, max_size=3).map(tuple),
    opacity=st.just(1.0) | st.floats(0, 1),
    glow=st.none() | st.builds(nsg.Glow, colours, powers),
    density=st.none() | st.floats(1e-6, 100),
    roughness=st.none() | st.floats(0.05, 1),
)
common: dict[str, Any] = {"transforms": st.lists(transforms, max_size=3).map(tuple), "material": materials}
joins = st.sampled_from([(op, 0.15) for op in ("union", "smooth", "subtract", "intersect")]) | st.tuples(
    st.just("smooth"), st.floats(1e-6, 100)
)
places = st.floats(-1e6, 1e6) | st.integers(-9, 9).map(float)
points = st.tuples(places, places, places)
cameras = st.builds(
    lambda eye, away, fov: nsg.Camera(eye, tuple(a + b for a, b in zip(eye, away, strict=True)), fov=fov),
    points,
    st.tuples(st.floats(1, 9), places, places),
    st.floats(0.01, 3.1),
)
lights = st.builds(nsg.Light, points, powers, colours, st.just(0.0) | powers)
skies = st.builds(nsg.Sky, powers, colours | st.just("default"), colours | st.just("default"))
grounds = st.builds(nsg.Ground, places, colours | st.just("default"))
objects = st.builds(
    lambda geometry, transforms, material: nsg.Object(geometry, transforms=transforms, material=material),
    geometry=st.sampled_from(["square", "star", "triangle", "pentagon", "sphere", "torus"]),
    **common,
)


def _nodes(children: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    several = st.lists(children, max_size=3).map(tuple)
    links = st.lists(st.tuples(joins, children), max_size=3).map(
        lambda pairs: tuple(
            nsg.Link(op=op, node=node, k=k) if i else nsg.Link(node=node)
            for i, ((op, k), node) in enumerate(pairs)
        )
    )
    return st.one_of(
        st.builds(nsg.Group, children=several, **common),
        st.builds(
            lambda join, **more: nsg.Boolean(op=join[0], k=join[1], **more), joins, children=several, **common
        ),
        st.builds(nsg.Chain, children=links, **common),
    )


scenes = st.builds(
    nsg.Scene,
    canvas=st.tuples(st.integers(1, 8192), st.integers(1, 8192)),
    background=st.just("default") | st.none() | colours,
    camera=st.just("default") | cameras,
    light=st.just("default") | st.none() | lights | st.lists(lights, max_size=8),
    ground=st.just("default") | st.none() | grounds,
    sky=st.just("default") | skies,
    animation=st.none()
    | st.builds(nsg.Animation, seconds=st.floats(0.001, 100), fps=st.floats(0.1, 240), loop=st.booleans()),
    nodes=st.lists(st.recursive(objects, _nodes, max_leaves=6), max_size=3).map(tuple),
)
