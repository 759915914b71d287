"""What the compiler gives does not hang on the order of Python's sets, which changes from run to run."""

from __future__ import annotations

import hashlib

from tests.work import ends


def outcomes(count: int) -> str:
    """A line for each of ``count`` texts: a digest of diagnostics, Scene and Program."""
    from fuzz.target import load_target, mutations
    from fuzz.targets.evaluate import outcome

    target = load_target("evaluate")
    inputs = [*target.seeds()[:count], *mutations(target, count, seed=77)]
    return "\n".join(hashlib.sha256(outcome(data)).hexdigest() for data in inputs)


def test_other_hash_seeds_give_the_same() -> None:
    code = "from tests.fuzz.test_hash_seeds import outcomes; print(outcomes(30))"
    told = [ends(code, PYTHONHASHSEED=seed).split() for seed in ("0", "1")]
    assert len(told[0]) == 60
    assert told[0] == told[1]
