"""The study of what each part of `framed` buys: the same data, budget, rate and seed for all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from scenelang.lab.designs.ablations import VARIANTS
from scenelang.lab.designs.students import StudentConfig
from scenelang.lab.designs.studies import RATES, StudyConfig
from scenelang.renderers.network import FramedConfig

SEEDS = 3  # of the whole renderer: differences below their spread mean nothing

SIZES: Mapping[str, tuple[int, ...]] = {
    "decoder_width": (8, 16, 32, 64),
    "code": (1, 2, 4, 8),
    "state": (1, 4),
    "paint_lines": (1, 2, 4),
}
"""Values of each field of `FramedConfig` that are tried, the shipped one among them."""

LABELS = {"decoder_width": "decoder", "code": "code size", "state": "state", "paint_lines": "paint lines"}


def ablation_runs(budget_s: float, seed: int) -> list[tuple[str, str, StudyConfig]]:
    """The study: (name, group, what is trained) of the whole renderer, of all variants and of all sizes.

    The whole renderer stands for the shipped value of every size.

    Args:
        budget_s: processor seconds of each.
        seed: of parameters and scenes; the whole renderer is trained with the two after it as well.
    """
    whole = StudyConfig(StudentConfig("framed", "exact"), seconds=budget_s, rate=RATES["framed"], seed=seed)
    runs = [("framed", "whole", replace(whole, seed=seed + i)) for i in range(SEEDS)]
    runs += [
        (name, "parts", replace(whole, student=replace(whole.student, variant=name)))
        for name in VARIANTS
        if name != "code"
    ]
    shipped = FramedConfig()
    for size, values in SIZES.items():
        for value in values:
            if value == getattr(shipped, size):
                continue
            sizes = FramedConfig(**{**shipped.to_json(), size: value})
            student = replace(whole.student, framed=sizes, variant="code" if size == "code" else "")
            runs.append((f"{LABELS[size]} {value}", size, replace(whole, student=student)))
    return runs
