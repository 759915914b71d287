"""Every fuzz target runs without atheris: over seeds, over what was found once, and over seeded mutations.

``pytest -m slow tests/fuzz`` runs a hundred times as many mutations.
"""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from fuzz.target import TARGETS, Target, load_target, mutations

FOUND = Path(__file__).parent / "found"
COUNTS = {
    "parse": (40, 60),
    "evaluate": (40, 60),
    "scene_json": (40, 200),
    "program": (20, 150),
    "weights": (20, 250),
    "formatting": (40, 50),
    "zoo": (20, 150),
    "learn": (30, 60),
    "slow": (4, 4),
}
"""How many seeds and mutations a target takes in about two seconds."""


def run(target: Target, inputs: list[bytes]) -> None:
    for data in inputs:
        try:
            target.check(data)
        except Exception as error:
            raise AssertionError(f"{target.name} fails for {data[:2000]!r}") from error


@pytest.mark.parametrize("name", TARGETS)
def test_seeds(name: str) -> None:
    target = load_target(name)
    seeds = target.seeds()
    assert seeds
    assert len(set(seeds)) == len(seeds)
    run(target, Random(1).sample(seeds, min(COUNTS[name][0], len(seeds))))


@pytest.mark.parametrize("name", TARGETS)
def test_mutations(name: str) -> None:
    target = load_target(name)
    run(target, list(mutations(target, COUNTS[name][1], seed=2)))


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_many_mutations(name: str) -> None:
    target = load_target(name)
    run(target, list(mutations(target, 100 * COUNTS[name][1], seed=3)))


@pytest.mark.parametrize(
    "path", sorted(FOUND.glob("*/*")), ids=lambda path: f"{path.parent.name}-{path.name}"
)
def test_what_was_found(path: Path) -> None:
    run(load_target(path.parent.name), [path.read_bytes()])


@pytest.mark.parametrize("name", TARGETS)
def test_mutations_are_the_same_each_time_and_change_something(name: str) -> None:
    target = load_target(name)
    once, again = (list(mutations(target, 20, seed=4)) for _ in range(2))
    assert once == again
    assert len(set(once)) > 15
    assert all(len(data) <= target.most_bytes for data in once)


@pytest.mark.parametrize("name", TARGETS)
def test_dictionaries_are_what_libfuzzer_takes(name: str) -> None:
    words = load_target(name).dictionary()
    assert words
    assert all(0 < len(word) <= 64 for word in words)
