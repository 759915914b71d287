"""Quality of reports of one mistake: ``python -m lab bench mutations [--count N | --all] [--worst N]``.

Makes slips in all examples and in the sound scenes of the tests, lets Lark and the evaluator judge which of
them are mistakes, and prints for each kind how many gave exactly one diagnostic, within one line of the
slip. The last columns count the mistakes that gave none, two, three and more diagnostics, and those
without a whole tree.
"""

from __future__ import annotations

import argparse
import time

from tests.language.mutations import (
    KINDS,
    Outcome,
    Tally,
    exhaust,
    parsed_only,
    sample,
    scenes,
    study,
    together,
)

COLUMNS = ("mistakes", "sound", "one, near", "one", "near", "0", "2", "3", "more", "no tree")


def row(name: str, tally: Tally) -> str:
    """One line of the table."""
    counts = tally.counts()
    more = sum(number for count, number in counts.items() if count > 3)
    cells = [
        f"{len(tally.outcomes):,}",
        f"{tally.still_sound:,}",
        f"{100 * tally.share('good'):.1f} %",
        f"{100 * counts[1] / max(1, len(tally.outcomes)):.1f} %",
        f"{100 * tally.share('near'):.1f} %",
        *(str(number) for number in (counts[0], counts[2], counts[3], more)),
        str(sum(not outcome.tree for outcome in tally.outcomes)),
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
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=1000, help="slips of each kind (1000)")
    parser.add_argument("--all", action="store_true", help="every token of every scene instead")
    parser.add_argument(
        "--tries", type=int, default=2, help="with --all: random slips of a kind at a token (2)"
    )
    parser.add_argument("--seed", type=int, default=2021)
    parser.add_argument("--kind", choices=KINDS, action="append", help="only this kind")
    parser.add_argument("--fault", choices=("syntax", "meaning"), help="list only mistakes of this sort")
    parser.add_argument("--worst", type=int, default=0, help="list so many of the worst mistakes")
    options = parser.parse_args()
    kinds = tuple(options.kind or KINDS)
    start = time.process_time()
    slips = (
        exhaust(options.seed, options.tries, kinds)
        if options.all
        else sample(options.count, options.seed, kinds)
    )
    table = study(slips)
    print(
        f"{len(scenes())} scenes, seed {options.seed}, {time.process_time() - start:.0f} s of processor time"
    )
    print(f"{'':<18}" + "".join(f"{title:>10}" for title in COLUMNS))
    for (kind, fault), tally in sorted(table.items()):
        print(row(f"{kind} / {fault}", tally))
    for name, tally in (
        ("syntax", together(table, "syntax")),
        ("  parser alone", parsed_only(together(table))),
        ("meaning", together(table, "meaning")),
        ("all", together(table)),
    ):
        print(row(name, tally))
    wrong = [o for o in together(table, options.fault).outcomes if not o.good]
    wrong.sort(key=lambda o: (-o.count, -o.distance))
    for outcome in wrong[: options.worst]:
        show(outcome)


if __name__ == "__main__":
    main()
