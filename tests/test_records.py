"""Records behave as frozen dataclasses with slots do, but for freezing at run time."""

from __future__ import annotations

import copy
import pickle
from dataclasses import dataclass, field, fields, replace
from typing import ClassVar, get_type_hints

import pytest

from scenelang.assets.records import Record
from scenelang.language import tree
from scenelang.language.diagnostics import Span


class Point(Record):
    """A point."""

    x: float
    y: float = 0.0
    origin: ClassVar[str] = "o"


class Named(Point):
    name: str = "p"


class Bag(Record, frozen=False):
    items: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Model:
    x: float
    y: float = 0.0


def test_records_are_as_dataclasses() -> None:
    point = Named(1, 2, "q")
    assert Point(1) == Point(1, 0.0) != Point(1, 2)
    assert hash(Point(1)) == hash(Point(1)) == hash(Model(1))
    assert Point(1) != Named(1)
    assert repr(Named(1)) == "Named(x=1, y=0.0, name='p')"
    assert repr(Model(1)).replace("Model", "Point") == repr(Point(1))
    assert [f.name for f in fields(Named)] == ["x", "y", "name"]
    assert replace(point, y=5) == Named(1, y=5, name="q")
    assert copy.deepcopy(point) == pickle.loads(pickle.dumps(point)) == point
    assert (Point.origin, Point.__doc__) == ("o", "A point.")
    for wrong in ((), (1, 2, 3)):
        with pytest.raises(TypeError, match=r"__init__\(\)"):
            Point(*wrong)
    with pytest.raises(AttributeError):
        Point(1).z = 2  # type: ignore[attr-defined]
    match point:
        case Named(x, y, name):
            assert (x, y, name) == (1, 2, "q")
    assert get_type_hints(tree.Name, vars(tree)) == {"text": str, "span": Span}


def test_one_that_may_change_is_equal_to_itself_alone() -> None:
    bag = Bag()
    bag.items.append(1)
    assert Bag().items == []
    assert bag == bag != Bag([1])
    assert len({bag, Bag([1])}) == 2
