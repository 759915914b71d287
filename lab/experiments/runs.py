"""What each experiment trains: lists of runs, for a budget of processor time and a seed.

An experiment is a list of runs, each of which trains a student (`lab.designs.studies`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace

from lab.designs.ablations import VARIANTS
from lab.designs.students import LiftingName, RendererName, StudentConfig
from lab.designs.studies import RATES, StudyConfig
from scenelang.renderers.network import FramedConfig
from scenelang.renderers.streaming import StreamingConfig

SIDE = 32  # pixels along a side of the pictures: what `streaming` reaches on a processor in minutes
PARTS_SIDE = 128  # where only renderers that answer points are compared
Pair = tuple[RendererName, LiftingName]
ALL: tuple[Pair, ...] = tuple(
    (renderer, lifting) for renderer in ("framed", "reading", "streaming") for lifting in ("exact", "learned")
)
BEST: tuple[Pair, ...] = (("streaming", "learned"), ("framed", "exact"))
SEEDS = 3  # of the whole renderer: differences below their spread mean nothing

TRIED: Mapping[str, tuple[int, ...]] = {
    "decoder_width": (8, 16, 32, 64),
    "code": (1, 2, 4, 8),
    "state": (1, 4),
    "paint_lines": (1, 2, 4),
}
"""Values of each field of `FramedConfig` that are tried, the shipped one among them."""

LABELS = {"decoder_width": "decoder", "code": "code size", "state": "state", "paint_lines": "paint lines"}


@dataclass(frozen=True, slots=True)
class Run:
    """One training and what it is called."""

    name: str  # in tables
    group: str  # runs that are compared with one another
    study: StudyConfig  # what is trained
    seen: bool = False  # measure on the fixed scenes it was trained on
    side: int = SIDE  # pixels along a side of the pictures that are measured
    blends: bool = False  # measure scenes of smooth unions alone as well

    @property
    def folder(self) -> str:
        """Where its checkpoint lies, the same for the same run of another experiment."""
        study = self.study
        parts = [self.name, f"{study.seconds:g}s", f"seed{study.seed}"]
        if study.fixed:
            parts.append(f"{study.fixed}scenes")
        return "-".join(parts).replace("+", "-").replace(" ", "-")


def plain(renderer: RendererName, lifting: LiftingName, seconds: float, seed: int = 1) -> StudyConfig:
    """The usual training of a renderer and a lifting; `streaming` has an eighth of the paper's filters."""
    streaming = StreamingConfig(resolution=SIDE, width=1 / 8)
    student = StudentConfig(renderer=renderer, lifting=lifting, streaming=streaming)
    scenes = 8 if renderer == "streaming" else 16  # a picture of a scene takes long
    rate = RATES[renderer]
    if (renderer, lifting) == ("framed", "learned"):
        rate /= 10  # faster, its frames collapse and it draws the mean colour
    warm = renderer == "streaming"  # a level that begins as noise costs more than minutes can pay
    return StudyConfig(student, seconds=seconds, rate=rate, scenes=scenes, seed=seed, warm=warm)


def _usual(pairs: Iterable[Pair], seconds: float, seed: int, group: str = "") -> list[Run]:
    """The usual training of each pair."""
    return [Run("+".join(pair), group or f"{seconds:g} s", plain(*pair, seconds, seed)) for pair in pairs]


def overfit(budget_s: float, seed: int) -> list[Run]:
    """Each renderer on 16 scenes it sees again and again: does it work at all?"""
    pairs = [pair for pair in ALL if pair[1] == "learned" or pair[0] == "framed"]
    return [
        replace(run, study=replace(run.study, fixed=16, average=0.98), seen=True)
        for run in _usual(pairs, budget_s, seed, "16 scenes")
    ]


def compare(budget_s: float, seed: int) -> list[Run]:
    """Every renderer with every lifting at a third of the budget and at all of it."""
    return [run for seconds in (budget_s / 3, budget_s) for run in _usual(ALL, seconds, seed)]


def table2(budget_s: float, seed: int) -> list[Run]:
    """Deformed shapes: the paper's method, and ours (Table 2, left)."""
    return _usual(BEST, budget_s, seed)


def table3(budget_s: float, seed: int) -> list[Run]:
    """Growing resolution by resolution against training at the last one at once (Table 3)."""
    grown = plain("streaming", "learned", budget_s, seed)
    return [
        Run("streaming+learned", "grown, each level from the one below", grown),
        Run("streaming+learned cold", "grown, each level from noise", replace(grown, warm=False)),
        Run("streaming+learned direct", "direct", replace(grown, grow=False)),
    ]


def table4(budget_s: float, seed: int) -> list[Run]:
    """The paper's two renderers (Table 4)."""
    return _usual((("streaming", "learned"), ("reading", "learned")), budget_s, seed)


def seeds(budget_s: float, seed: int) -> list[Run]:
    """Three seeds of each renderer: spread and divergence."""
    pairs: tuple[Pair, ...] = (*BEST, ("reading", "learned"))
    return [
        run
        for pair in pairs
        for s in range(seed, seed + 3)
        for run in _usual([pair], budget_s, s, f"seed {s}")
    ]


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
    for size, values in TRIED.items():
        for value in values:
            if value == getattr(shipped, size):
                continue
            sizes = FramedConfig(**{**asdict(shipped), size: value})
            student = replace(whole.student, framed=sizes, variant="code" if size == "code" else "")
            runs.append((f"{LABELS[size]} {value}", size, replace(whole, student=student)))
    return runs


def parts(budget_s: float, seed: int) -> list[Run]:
    """`framed` without one of its parts at a time, and at other sizes: what each of them buys."""
    return [Run(*run, side=PARTS_SIDE, blends=True) for run in ablation_runs(budget_s, seed)]


EXPERIMENTS: dict[str, Callable[[float, int], list[Run]]] = {
    "overfit": overfit,
    "compare": compare,
    "table2": table2,
    "table3": table3,
    "table4": table4,
    "seeds": seeds,
    "parts": parts,
}
