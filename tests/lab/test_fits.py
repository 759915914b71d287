"""Scenes to be fitted: what their truth draws is the target, and starts are far from it."""

from __future__ import annotations

import numpy as np

import scenelang
from lab.fits import FAR_DB, random_case
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.metrics import over_white, psnr

SIDE = 64


def test_the_truth_draws_the_target_and_the_start_does_not() -> None:
    for index in range(2):
        case = random_case(load_manifest("shapes2d"), index, 3, seed=5, side=SIDE)
        given: dict[str, object] = {}
        for line in case.text.splitlines():
            if line.startswith("param"):
                name, low, high = line.split()[1], *line.rstrip(";").split(" in ")[1].split("..")
                unit = "deg" if low.endswith("deg") else ""
                ends = [float(end.removesuffix("deg")) for end in (low, high)]
                value = ends[0] + case.truth[name] * (ends[1] - ends[0])
                given[name] = f"{value!r}{unit}"
        assert given.keys() == case.truth.keys()
        start, true = (
            over_white(
                scenelang.render(scenelang.loads(case.text, params=p, size=(SIDE, SIDE)), backend="reference")
            )
            for p in ({}, given)
        )
        assert np.abs(true - case.target).max() <= 0.5 / 255 + 1e-6
        assert psnr(start, case.target) < FAR_DB + 2  # whose start was measured in fewer pixels
