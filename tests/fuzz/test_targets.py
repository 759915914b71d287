"""Every fuzz target and property without atheris: seeds, former findings, seeded mutations, minimising.

``pytest -m slow tests/fuzz`` runs a hundred times as many mutations.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from random import Random

import pytest

from fuzz.__main__ import main
from fuzz.drawn import Property
from fuzz.minimise import failure_of, minimise
from fuzz.properties import PROPERTIES
from fuzz.target import TARGETS, Target, hold, load_target, mutations
from scenelang.language.values import divide
from tests.work import ends

FOUND = Path(__file__).parent / "found"
COUNTS = {
    "parse": (40, 60),
    "evaluate": (40, 60),
    "scene_json": (20, 40),
    "program": (6, 40),
    "weights": (20, 250),
    "formatting": (40, 50),
    "zoo": (20, 150),
    "learn": (10, 30),
    "slow": (4, 4),
    "skies": (3, 1),
}
"""Numbers of seeds and mutations that a target takes in about two seconds."""


def run(target: Target, inputs: list[bytes]) -> None:
    for data in inputs:
        try:
            target.check(data)
        except Exception as error:
            raise AssertionError(f"{target.name} fails for {data[:2000]!r}") from error


@pytest.mark.parametrize("name", TARGETS)
def test_seeds_and_mutations(name: str) -> None:
    target, (most, count) = load_target(name), COUNTS[name]
    seeds = target.seeds()
    assert len(set(seeds)) == len(seeds) > 0
    words = target.dictionary()
    assert words
    assert all(0 < len(word) <= 64 for word in words)  # as libFuzzer takes them
    mutated = list(mutations(target, count, seed=2))
    assert mutated == list(mutations(target, count, seed=2))
    assert len(set(mutated)) > 0.7 * count
    assert all(len(data) <= target.most_bytes for data in mutated)
    run(target, [*Random(1).sample(seeds, min(most, len(seeds))), *mutated])


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_many_mutations(name: str) -> None:
    target = load_target(name)
    run(target, list(mutations(target, 100 * COUNTS[name][1], seed=3)))


def test_what_was_found() -> None:
    for path in sorted(FOUND.glob("*/*")):
        run(load_target(path.parent.name), [path.read_bytes()])


@pytest.mark.parametrize("held", PROPERTIES, ids=lambda held: held.name)
def test_property(held: Property) -> None:
    held.run(examples=20)


def outcomes(count: int) -> str:
    """A line for each of ``count`` texts: a digest of diagnostics, Scene and Program."""
    from fuzz.targets.evaluate import outcome

    target = load_target("evaluate")
    inputs = [*target.seeds()[:count], *mutations(target, count, seed=77)]
    return "\n".join(hashlib.sha256(outcome(data)).hexdigest() for data in inputs)


def test_other_hash_seeds_give_the_same() -> None:
    """Nothing hangs on the order of Python's sets, which changes from run to run."""
    code = "from tests.fuzz.test_targets import outcomes; print(outcomes(20))"
    first, second = (ends(code, PYTHONHASHSEED=seed).split() for seed in ("0", "1"))
    assert len(first) == 40
    assert first == second


def check(data: bytes) -> None:
    """Fails in three ways, one of them inside the library."""
    hold(b"a" not in data, "no a", len(data))
    if b"b" in data:
        divide(1.0, 0.0)
    if b"c" in data:
        raise ZeroDivisionError(str(len(data)))


LETTERS = Target("letters", "no letters", check, lambda: [b""], lambda data, generator: data)


def test_minimise_leaves_what_matters() -> None:
    names = {
        b"a": "no a",
        b"b": "Problem in language/values.py:divide",
        b"c1": "ZeroDivisionError in outside",
        b"": None,
    }
    assert {data: failure_of(LETTERS, data) for data in names} == names
    data = bytes(Random(1).choices(b"xyz", k=300)) + b"a" + bytes(Random(2).choices(b"xyz", k=300)) + b"b"

    def shows(data: bytes) -> bool:
        return failure_of(LETTERS, data) == "no a"

    assert minimise(data, lambda d: b"a" in d and b"b" in d) == b"ab"
    assert minimise(data, shows) == b"a"
    assert len(minimise(data, shows, tries=3)) > 1


def test_the_command_minimises_what_fails(tmp_path: Path) -> None:
    path = tmp_path / "input"
    path.write_bytes(b"square;")
    assert main(["parse", "--replay", str(path)]) == 0
    assert main(["parse", "--minimise", str(path)]) == 2  # it does not fail
    with pytest.raises(KeyError):
        load_target("os")
