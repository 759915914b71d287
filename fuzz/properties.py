"""Properties that Hypothesis holds the library to: a few dozen examples in the tests, or an hour of them.

``python -m fuzz properties --minutes 60`` runs them with new seeds until the time is over.
"""

from __future__ import annotations

import itertools
import sys
import time
import traceback
from typing import Final

from fuzz import language_properties as language
from fuzz import value_properties as values
from fuzz.drawn import Property
from fuzz.target import Target

PROPERTIES: Final[tuple[Property, ...]] = (
    language.sentences_are_read_and_formatted,
    language.expressions_have_the_values_that_python_gives,
    language.ranges_hold_what_fractions_count,
    language.strings_are_what_their_literals_say,
    values.scenes_survive_all_their_forms,
    values.programs_stay_in_their_files_and_can_be_drawn,
    values.networks_of_any_size_load_as_they_were_saved,
    values.diagnostics_of_any_text_render,
)
EXAMPLES: Final = 50
"""Examples of a property in one turn; the seeds differ from turn to turn."""


def check(data: bytes) -> None:
    """One turn of a property: ``NAME SEED``, as findings are written down."""
    name, _, number = data.decode().partition(" ")
    next(held for held in PROPERTIES if held.name == name).run(EXAMPLES, int(number))


TARGET = Target(
    name="properties",
    summary="sentences drawn from the grammar, expressions against Python's arithmetic, ranges against "
    "fractions, strings, Scenes in all forms, Programs, networks, manifests and diagnostics drawn by "
    "Hypothesis",
    check=check,
    seeds=lambda: [f"{held.name} 0".encode() for held in PROPERTIES],
    mutate=lambda data, generator: data.partition(b" ")[0] + b" %d" % generator.randrange(1 << 30),
    runs=EXAMPLES,
)


def turns(seconds: float, first: int) -> int:
    """Turn after turn until the time is over, or one fails, which is told; returns the exit status."""
    end_s = time.monotonic() + seconds
    for turn in itertools.count(first):
        for held in PROPERTIES:
            if time.monotonic() > end_s:
                print(f"no mistakes up to turn {turn}")
                return 0
            try:
                check(told := f"{held.name} {turn}".encode())
            except Exception:
                traceback.print_exc()
                print(f"the input is: {told.decode()}", file=sys.stderr)
                return 1
    raise AssertionError
