"""Quality of reports of one mistake: ``python -m lab bench mutations [--count N] [--worst N]``.

Makes slips in all examples and in the sound scenes of the tests, lets Lark and the evaluator judge which of
them are mistakes, and prints for each kind how many gave exactly one diagnostic, within one line of the
slip. The last columns count the mistakes that gave none, two, three and more diagnostics, and those
without a whole tree.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter

from tests.language.mutations import KINDS, Outcome, parsed_only, scenes, share, study

COLUMNS = ("mistakes", "sound", "one, near", "one", "near", "0", "2", "3", "more", "no tree")


def row(name: str, outcomes: list[Outcome]) -> str:
    mistakes = [o for o in outcomes if o.fault != "none"]
    counts = Counter(o.count for o in mistakes)
    more = sum(number for count, number in counts.items() if count > 3)
    cells = [
        f"{len(mistakes):,}",
        f"{len(outcomes) - len(mistakes):,}",
        f"{100 * share(mistakes, 'good'):.1f} %",
        f"{100 * counts[1] / max(1, len(mistakes)):.1f} %",
        f"{100 * share(mistakes, 'near'):.1f} %",
        *(str(number) for number in (counts[0], counts[2], counts[3], more)),
        str(sum(not outcome.tree for outcome in mistakes)),
    ]
    return f"{name:<18}" + "".join(f"{cell:>10}" for cell in cells)


def show(outcome: Outcome) -> None:
    """One mistake: the lines around it and what was said about them."""
    mutation = outcome.mutation
    first, last = mutation.lines
    print(f"--- {mutation.scene}: {mutation.kind} {mutation.what} ({outcome.fault}, line {first})")
    lines = mutation.text.split("\n")
    for number in range(max(1, first - 2), min(len(lines), last + 2) + 1):
        print(f"{number:5} | {lines[number - 1]}")
    for d in outcome.diagnostics:
        place = "{}:{}".format(*d.span.locate()[0]) if d.span else "-"
        print(f"      {d.code} {place} {d.message}" + (f" ({d.help})" if d.help else ""))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=1000, help="slips of each kind (1000)")
    parser.add_argument("--seed", type=int, default=2021)
    parser.add_argument("--kind", choices=KINDS, action="append", help="only this kind")
    parser.add_argument("--fault", choices=("syntax", "meaning"), help="list only mistakes of this sort")
    parser.add_argument("--worst", type=int, default=0, help="list so many of the worst mistakes")
    options = parser.parse_args()
    kinds = tuple(options.kind or KINDS)
    start = time.process_time()
    outcomes = study(options.count, options.seed, kinds)
    print(
        f"{len(scenes())} scenes, seed {options.seed}, {time.process_time() - start:.0f} s of processor time"
    )
    print(f"{'':<18}" + "".join(f"{title:>10}" for title in COLUMNS))
    for kind in kinds:
        own = [o for o in outcomes if o.mutation.kind == kind]
        print(row(f"{kind} / syntax", [o for o in own if o.fault == "syntax"]))
        print(row(f"{kind} / meaning", [o for o in own if o.fault != "syntax"]))
    for name, some in (
        ("syntax", [o for o in outcomes if o.fault == "syntax"]),
        ("  parser alone", parsed_only(outcomes)),
        ("meaning", [o for o in outcomes if o.fault != "syntax"]),
        ("all", outcomes),
    ):
        print(row(name, some))
    faults = (options.fault,) if options.fault else ("syntax", "meaning")
    wrong = [o for o in outcomes if o.fault in faults and not o.good]
    wrong.sort(key=lambda o: (-o.count, -o.distance))
    for outcome in wrong[: options.worst]:
        show(outcome)


if __name__ == "__main__":
    main()
