"""Targets that other programs made, against the picture of their true values."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang
from scenelang.diagnostics.span import SourceFile
from scenelang.measure.metrics import psnr

pytest.importorskip("resvg_py", reason="resvg is not installed (the extra oracles)")
pytestmark = [pytest.mark.oracle, pytest.mark.slow]

from lab.bench import fit_targets  # noqa: E402


@pytest.mark.parametrize(
    ("draw", "blurred"), [(fit_targets.by_resvg, False), (fit_targets.photographed, True)]
)
def test_a_fit_comes_as_near_as_the_true_values(draw: fit_targets.Draw, blurred: bool) -> None:
    true = {"x": 0.3, "y": -0.1, "size": 0.45, "turn": 12.0, "ink": "#903020"}
    target = draw(true, np.random.default_rng(1))
    found = scenelang.fit(SourceFile("star.nsg", fit_targets.SCENE), target, params=fit_targets.NAMES)
    reach = scenelang.render(scenelang.loads(fit_targets.SCENE, params={**true, "turn": "12deg"}))
    assert psnr(scenelang.render(scenelang.loads(found.text)), reach, 100.0) > fit_targets.REACHED_DB
    assert psnr(reach, target) > 20 > found.start_psnr
    assert blurred == (found.blurred_psnr > found.psnr) == any("blur of" in line for line in found.told())
