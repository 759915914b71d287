"""The command: ``python -m fuzz TARGET [--minutes M | --replay FILE | --minimise FILE]`` or ``--table``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from fuzz.target import PROPERTIES, PUMPED, TARGETS, load_target


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit status, 1 where there are findings."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description="Fuzz scenelang.")
    parser.add_argument("target", nargs="?", choices=(*TARGETS, PROPERTIES), help="what to fuzz")
    parser.add_argument("--minutes", type=float, default=60.0, help="wall time of the run (60)")
    parser.add_argument("--seed", type=int, default=1, help="of the fuzzer's random numbers (1)")
    parser.add_argument(
        "--work", type=Path, default=Path("out/fuzz"), help="corpus, log and findings (out/fuzz)"
    )
    parser.add_argument("--record", action="store_true", help="keep the record in fuzz/records")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="run the target once on this input")
    parser.add_argument(
        "--minimise", type=Path, metavar="FILE", help="print a smaller input that fails alike"
    )
    parser.add_argument(
        "--table", action="store_true", help="write the table of records into docs/fuzzing.md"
    )
    wanted = parser.parse_args(arguments)
    if wanted.table:
        from fuzz.table import update

        update()
        return 0
    if wanted.target is None:
        parser.error("which target? " + ", ".join(TARGETS))
    if wanted.replay is not None:
        load_target(wanted.target).check(wanted.replay.read_bytes())
        return 0
    if wanted.minimise is not None:
        return _minimise(wanted.target, wanted.minimise)
    try:
        if wanted.target not in (PROPERTIES, PUMPED):
            import atheris  # type: ignore[import-untyped]  # noqa: F401
    except ImportError:
        print("fuzzing needs atheris: pip install 'scenelang[fuzz]'", file=sys.stderr)
        return 2
    from fuzz.runner import RECORDS, fuzz

    records = RECORDS if wanted.record else None
    if wanted.target == PUMPED:
        from fuzz.hunt import hunt

        record = hunt(wanted.minutes, wanted.work, wanted.seed, records)
    else:
        record = fuzz(wanted.target, wanted.minutes, wanted.work, wanted.seed, records)
    print(f"{record.executions:,} executions in {record.wall_s:.0f} s, {record.edges} edges")
    for finding in record.findings:
        print(f"{finding['kind']}: {finding['signature']} ({finding['times']} times), {finding['file']}")
    return 1 if record.findings else 0


def _minimise(name: str, path: Path) -> int:
    from fuzz.keeper import minimise, shows_signature, signature_of

    target, data = load_target(name), path.read_bytes()
    try:
        target.check(data)
    except Exception as error:
        small = minimise(data, shows_signature(target, signature_of(error)[1]))
        sys.stdout.buffer.write(small)
        return 0
    print("this input does not fail", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
