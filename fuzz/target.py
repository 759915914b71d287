"""Fuzz targets, and their report when an oracle does not hold."""

from __future__ import annotations

import importlib
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from random import Random
from typing import Final

TARGETS: Final = (
    "parse",
    "evaluate",
    "scene_json",
    "program",
    "weights",
    "formatting",
    "zoo",
    "learn",
    "slow",
    "skies",
)
"""Names of the modules in `fuzz.targets`."""
PUMPED: Final = "slow"
"""The target that `fuzz.hunt` drives, without atheris."""
PROPERTIES: Final = "properties"
"""Targets that Hypothesis drives, in `fuzz.properties`."""


class Failure(AssertionError):
    """An oracle, named alike whatever the input, does not hold; ``detail`` says what was found."""

    def __init__(self, oracle: str, detail: object = "") -> None:
        super().__init__(f"{oracle}: {detail}" if detail != "" else oracle)
        self.oracle = oracle


def hold(truth: object, oracle: str, detail: object = "") -> None:
    """Raise `Failure` unless ``truth``."""
    if not truth:
        raise Failure(oracle, detail)


@dataclass(frozen=True, slots=True)
class Target:
    """One thing that is fuzzed."""

    name: str
    summary: str  # what is fuzzed and what must hold, one sentence
    check: Callable[[bytes], None] = field(repr=False)  # one run; what it raises is a finding
    seeds: Callable[[], list[bytes]] = field(repr=False)
    mutate: Callable[[bytes, Random], bytes] = field(repr=False)  # knows the structure of the input
    dictionary: Callable[[], list[bytes]] = field(repr=False, default=list)  # for atheris
    most_bytes: int = 4096
    runs: int = 1  # uses of the library that an input stands for


def load_target(name: str) -> Target:
    """The target of a name; raises KeyError for another one."""
    if name == PROPERTIES:
        return _target("fuzz.properties")
    if name not in TARGETS:
        raise KeyError(name)
    return _target(f"fuzz.targets.{name}")


def _target(module: str) -> Target:
    target: Target = importlib.import_module(module).TARGET
    return target


def mutations(target: Target, count: int, seed: int) -> Iterator[bytes]:
    """Seeded mutations without atheris: one to four of the target's own after each other, from its seeds."""
    generator = Random(seed)
    seeds = target.seeds()
    for _ in range(count):
        data = generator.choice(seeds)
        for _ in range(generator.randint(1, 4)):
            data = target.mutate(data, generator)[: target.most_bytes]
        yield data


def sampled(data: bytes, one_in: int) -> bool:
    """Whether an input is one of those that a costly oracle looks at: the same ones each time."""
    return zlib.crc32(data) % one_in == 0
