"""The properties of `fuzz.properties`, a few dozen examples each."""

from __future__ import annotations

import pytest

from fuzz.drawn import Property
from fuzz.properties import PROPERTIES


@pytest.mark.parametrize("held", PROPERTIES, ids=lambda held: held.name)
def test_property(held: Property) -> None:
    held.run(examples=30)
