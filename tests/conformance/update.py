"""Write the expectations of all cases anew: ``python -m tests.conformance.update``."""

from __future__ import annotations

import argparse
import json

import numpy as np

from tests.conformance.cases import FOLDER, NAMES, is_stable, run, stored

NEW = {"params": {}, "frame": 0}


def main() -> None:
    """Update each case and say what changed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--add", action="append", default=[], metavar="NAME", help="a case that is new")
    added = set(parser.parse_args().add)
    for name in NAMES:
        known = (FOLDER / f"{name}.json").exists()
        if not known and name not in added:
            raise SystemExit(f"{name} has no expectations: --add {name} takes it in")
        facts, arrays = stored(name) if known else ({"input": NEW}, {})
        outcome = run(name, {**NEW, **facts["input"]})
        if outcome.graph is not None and not is_stable(outcome.graph):
            raise SystemExit(f"a sample of {name} lies on an outline: move an object a little")
        changed = [key for key in outcome.facts if facts.get(key) != outcome.facts[key]]
        changed += [
            key
            for key in sorted(outcome.arrays.keys() | arrays.keys())
            if key not in arrays
            or key not in outcome.arrays
            or not np.array_equal(arrays[key], outcome.arrays[key])
        ]
        if changed:
            print(f"{name}: {', '.join(changed)}")
        text = json.dumps(outcome.facts, indent=1)
        (FOLDER / f"{name}.json").write_text(text + "\n", encoding="utf-8")
        target = FOLDER / f"{name}.npz"
        if outcome.arrays:
            np.savez_compressed(target, **outcome.arrays)
        else:
            target.unlink(missing_ok=True)


if __name__ == "__main__":
    main()
