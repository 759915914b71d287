"""Properties of drawn values, which can be run any number of times with any settings."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st


@dataclass(frozen=True, slots=True)
class Property:
    """A function that raises where something does not hold, and what its arguments are drawn from."""

    function: Callable[..., None] = field(repr=False)
    arguments: tuple[st.SearchStrategy[Any], ...] = field(repr=False)

    @property
    def name(self) -> str:
        return self.function.__name__

    def run(self, examples: int, number: int | None = None) -> None:
        """Hold it to so many examples: the same each time, or others of a seed ``number``."""

        @settings(
            max_examples=examples,
            derandomize=number is None,
            deadline=None,
            database=None,
            suppress_health_check=list(HealthCheck),
        )
        @given(st.tuples(*self.arguments))
        def holds(values: tuple[Any, ...]) -> None:
            self.function(*values)

        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module="hypothesis")
            (holds if number is None else seed(number)(holds))()


def drawn(*arguments: st.SearchStrategy[Any]) -> Callable[[Callable[..., None]], Property]:
    """Make a function a property of drawn arguments."""
    return lambda function: Property(function, arguments)
