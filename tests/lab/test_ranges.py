"""Ranges of a manifest out of a stability suite's curves."""

from __future__ import annotations

from typing import Any

from lab.stability import measured_ranges


def probe(healthy: float, **psnr: float) -> dict[str, Any]:
    rows = [
        {"value": float(value[1:].replace("_", ".")), "psnr": {"mean": mean, "p5": mean, "worst": mean - 1}}
        for value, mean in psnr.items()
    ]
    return {"healthy": healthy, "rows": rows}


def test_a_range_ends_where_the_error_begins_to_show() -> None:
    found = {"probes": {"objects": probe(4, v1=50, v4=50, v16=40.1, v32=39.9, v64=50)}}
    ranges, lines = measured_ranges(found)
    assert ranges == {"objects": [1, 16]}
    assert lines == {"objects": "32: 39.9 dB (worst 38.9), 64: 50.0 dB (worst 49.0)"}


def test_what_loses_nothing_has_no_range() -> None:
    """More objects, or thinner ones, than the suite looked at are no reason to warn."""
    found = {
        "probes": {"objects": probe(4, v1=50, v4=50, v64=49.6), "thin": probe(3, v1=50, v3=50, v300=45.7)}
    }
    assert measured_ranges(found) == ({}, {})
    found = {"probes": {"blends": probe(4, v1=50, v4=47, v64=41.2)}}
    assert measured_ranges(found) == ({"smooth": [0, 64]}, {})
    found = {"probes": {"size": probe(1, v0_1=50, v1=50, v4=50)}}
    assert measured_ranges(found) == ({"scale": [0, 2.2]}, {})


def test_a_model_of_larger_error_is_compared_with_itself() -> None:
    found = {"probes": {"blends": probe(2, v1=20.5, v2=20, v4=19.2, v8=18.9)}}
    ranges, lines = measured_ranges(found)
    assert ranges == {"smooth": [0, 4]}
    assert lines == {"smooth": "8: 18.9 dB (worst 17.9)"}


def test_both_ends_have_units_of_their_own() -> None:
    found = {
        "probes": {
            "size": probe(1, v0_1=39, v0_5=50, v1=50, v2=50, v4=30),
            "warp": probe(1, v0_5=50, v1=50, v2=50),
        }
    }
    ranges, lines = measured_ranges(found)
    assert ranges == {"scale": [0.1, 1.1], "twirl": [-1.6, 1.6], "bend": [-1.6, 1.6]}
    assert lines == {"scale": "0.02: 39.0 dB (worst 38.0), 2.2: 30.0 dB (worst 29.0)"}
