"""From the stability suite to what a manifest says: how far a model may be taken, and what it does beyond.

A value is within range while pictures are hardly told from exact ones (`HARDLY`), or no worse than the
model's usual ones by more than `SLACK`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lab.sets.sets import SETS
from lab.sets.solid_sets import SIDES
from lab.sets.solid_sets import WARP as SOLID_WARP

HARDLY, SLACK = 40.0, 1.0  # dB, of mean PSNR
WARP = SETS["shapes2d"].warp
SCALES = 0.2, 0.55  # of the base set
WARP_OF, SCALES_OF = {2: WARP, 3: SOLID_WARP}, {2: SCALES, 3: SIDES}


def quantities(dimension: int) -> dict[str, tuple[str, float, float]]:
    """Quantity of a manifest -> the probe that varies it, and by what either end of its values is multiplied.

    Of solids the ratio of scales says little: rays may pass over what is thinner than 0.01, at any size.
    """
    most, scales = WARP_OF[dimension], SCALES_OF[dimension]
    warp = "warp", most, most
    solid = {
        "twist": warp,
        **{name: (probe, 1.0, 1.0) for name, probe in SOLID.items()},
    }
    return {
        "objects": ("objects", 1.0, 1.0),
        "smooth": ("blends", 1.0, 1.0),
        "twirl": warp,
        "bend": warp,
        "scale": ("size", *scales),
        **({"thin": ("thin", 1.0, 1.0), "texels": ("texels", 1.0, 1.0)} if dimension == 2 else solid),
        "blend": ("deep", scales[1], scales[1]),
    }


SOLID = {"displace": "amount", "frequency": "frequency", "thickness": "thickness", "width": "width"}
FROM_NOTHING = {"smooth", "blend", "displace", "frequency", "width", "texels"}  # the probe starts later
UNBOUNDED = {"objects", "thin"}
"""Of these a model has no range where nothing was lost up to the last value: a warning would not say why.

Nor has a scale a lower end where nothing was lost down to the first: thin objects are as small one way.
"""
BOTH_WAYS = {"twirl", "bend", "twist"}  # the range is the same on either side of 0


def measured_ranges(
    found: Mapping[str, Any], dimension: int = 2
) -> tuple[dict[str, list[float]], dict[str, str]]:
    """What the suite says of a model.

    Args:
        found: of `lab.stability.suite.run_stability`.
        dimension: the model's.

    Returns:
        Ranges ``quantity -> [low, high]`` for the manifest's ``trained``, and lines about what lies beyond
        for ``measured.stability``.
    """
    ranges: dict[str, list[float]] = {}
    lines: dict[str, str] = {}
    for quantity, (name, low_unit, high_unit) in quantities(dimension).items():
        probe = found["probes"].get(name)
        if probe is None:
            continue
        rows = probe["rows"]
        first, last = _healthy(rows, probe["healthy"])
        if quantity in UNBOUNDED and last == len(rows) - 1:
            continue
        low, high = rows[first]["value"] * low_unit, rows[last]["value"] * high_unit
        low = 0.0 if quantity in FROM_NOTHING or (quantity == "scale" and first == 0) else low
        if quantity in BOTH_WAYS:
            low = -high
        ranges[quantity] = [int(v) if v == int(v) else round(v, 4) for v in (low, high)]
        below = [] if quantity in BOTH_WAYS | FROM_NOTHING else rows[:first]
        beyond = [*below, *rows[last + 1 :]]
        shown = [beyond[0], beyond[-1]] if len(beyond) > 1 else beyond
        unit = {True: low_unit, False: high_unit}
        said = [
            f"{row['value'] * unit[row['value'] < probe['healthy']]:g}: {row['psnr']['mean']:.1f} dB "
            f"(worst {row['psnr']['worst']:.1f})"
            for row in shown
        ]
        if said:
            lines[quantity] = ", ".join(said)
    return ranges, lines


def _healthy(rows: list[dict[str, Any]], healthy: float) -> tuple[int, int]:
    """The first and the last row, around the healthy one, up to which all is well."""
    centre = next(i for i, row in enumerate(rows) if row["value"] == healthy)
    least = min(HARDLY, rows[centre]["psnr"]["mean"] - SLACK)
    first = last = centre
    while first > 0 and rows[first - 1]["psnr"]["mean"] >= least:
        first -= 1
    while last + 1 < len(rows) and rows[last + 1]["psnr"]["mean"] >= least:
        last += 1
    return first, last
