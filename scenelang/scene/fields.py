"""What a Scene is made of: frozen nodes, numbers and words, in which unit, and what is refused.

The descriptions and the `json_schema_extra` parts go into the JSON Schema, which says what it can of what
the validators check.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from scenelang.diagnostics.suggest import plural
from scenelang.words import RESERVED

_NOT_0: dict[str, Any] = {"not": {"const": 0}}
_NOT_000: dict[str, Any] = {"not": {"const": [0, 0, 0]}}


def _checked(value: Any, wrong: bool, why: str) -> Any:
    if wrong:
        raise ValueError(why)
    return value


# Strict: text such as "0.5" is not a number. Integers are.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Length = Annotated[Finite, Field(description="world units; the shorter side of the canvas spans 2")]
Radians = Annotated[Finite, Field(description="radians, counter-clockwise")]
Rate = Annotated[Finite, Field(description="radians per world unit")]
Factor = Annotated[
    Finite,
    Field(description="not 0", json_schema_extra=_NOT_0),
    AfterValidator(lambda factor: _checked(factor, factor == 0.0, "a scale by 0")),
]
Axis = Annotated[
    tuple[Finite, Finite, Finite],
    Field(description="of any length but 0", json_schema_extra=_NOT_000),
    AfterValidator(lambda axis: _checked(axis, not any(axis), "an axis of length 0")),
]
Rgb = Annotated[
    tuple[Finite, Finite, Finite],
    Field(description="red, green, blue as written (sRGB-encoded); 0 is none, 1 is full"),
]
Row = tuple[Finite, Finite, Finite, Finite]
Share = Annotated[Finite, Field(ge=0, le=1)]
Opaque = Annotated[
    tuple[Share, Share, Share], Field(description="red, green, blue as written (sRGB-encoded), in 0 to 1")
]


_NOT_RESERVED: Final = AfterValidator(
    lambda word: _checked(word, word in RESERVED, f"`{word}` is a word of the language")
)
_WORD: Final = "[A-Za-z_][A-Za-z0-9_]*"
_SPELT: Final[dict[str, Any]] = {"json_schema_extra": {"not": {"enum": list(RESERVED)}}}
Word = Annotated[str, Field(pattern=f"^{_WORD}$", **_SPELT), _NOT_RESERVED]
"""A name that text can spell."""
Dotted = Annotated[str, Field(pattern=rf"^{_WORD}(\.{_WORD})?$", **_SPELT), _NOT_RESERVED]
"""The same, or that of an element behind the name of its file."""


def _whole(value: Any) -> Any:
    """256.0 is an integer and true is none, as in JSON Schema."""
    if isinstance(value, bool):
        raise ValueError("true and false are not numbers")
    return int(value) if isinstance(value, float) and value.is_integer() else value


Version = Annotated[Literal[1], Field(description="of the language"), BeforeValidator(_whole)]
Pixels = Annotated[int, Field(strict=True, ge=1, le=8192), BeforeValidator(_whole)]


def singular(rows: Sequence[Sequence[float]]) -> bool:
    """Whether the 3 x 3 linear block of an affine has no inverse.

    A determinant below 1e-14 of the product of the rows' lengths counts as 0: float64 cannot tell.
    """
    lengths = [math.hypot(*row[:3]) for row in rows[:3]]
    if not all(lengths) or not all(map(math.isfinite, lengths)):
        return True
    unit = [[x / n for x in row[:3]] for row, n in zip(rows, lengths, strict=False)]
    (a, b, c), (d, e, f), (g, h, i) = unit
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return abs(determinant) < 1e-14


def _is_affine(rows: Any) -> Any:
    _checked(rows, rows[3] != (0.0, 0.0, 0.0, 1.0), "the last row of a matrix is not 0, 0, 0, 1")
    return _checked(rows, singular(rows), "a singular matrix")


def _last_row(schema: dict[str, Any]) -> None:
    schema["prefixItems"][3] = {"const": [0, 0, 0, 1]}


def first_joins_by_union(schema: dict[str, Any]) -> None:
    """Say of a chain's children what `Chain` checks."""
    first = {"properties": {"op": {"const": "union"}}}
    schema["prefixItems"] = [{"allOf": [schema["items"], first]}]


Affine = Annotated[
    tuple[Row, Row, Row, Row],
    Field(description="four rows; the last is 0, 0, 0, 1", json_schema_extra=_last_row),
    AfterValidator(_is_affine),
]


def _kind_is_required(schema: dict[str, Any]) -> None:
    """In data the kind tells nodes apart, while Python's constructors know it."""
    if "kind" in schema["properties"]:
        schema["required"] = ["kind", *schema.get("required", ())]


_SEVERAL = frozenset(("children", "elements", "nodes", "ops", "transforms"))


_COLOURS = frozenset(("background", "color", "rgb"))


def _decoded(name: str, text: str) -> tuple[float, float, float]:
    """The colour that ``#d33`` or ``#dd3333`` is, for a class of that name."""
    if not re.fullmatch(r"#([0-9a-fA-F]{3}){1,2}", text):
        raise ValueError(f"{name}: `{text}` is not a colour such as `#d33` or `#dd3333`")
    digits = text[1:] if len(text) == 7 else "".join(digit * 2 for digit in text[1:])
    red, green, blue = (int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4))
    return red, green, blue


class Frozen(BaseModel):
    """What all nodes of a Scene are."""

    # Validators are built when first used: a scene evaluated from text needs none.
    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        defer_build=True,
        json_schema_extra=_kind_is_required,
    )

    def __init__(self, *args: Any, **data: Any) -> None:
        """A node; its fields may go without their names, in order, and one thing may stand for a sequence.

        Raises:
            ValueError: a value that does not fit, or no field of that name.
            TypeError: arguments that stand for no field.
        """
        given = self._arranged(args, data)
        try:
            super().__init__(**given)
        except ValidationError as error:
            raise refusal(type(self).__name__, error, self._names()) from None

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # data is validated without it

    @classmethod
    def _names(cls) -> list[str]:
        """What a constructor takes, in order."""
        return [name for name in cls.model_fields if name != "kind"]

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        """Arguments by their names."""
        names = cls._names()
        if len(args) > len(names):
            takes = f"at most {len(names)}: {', '.join(names)}" if names else "none"
            raise TypeError(f"{cls.__name__}: {plural(len(args), 'argument')}, where it takes {takes}")
        for name in names[: len(args)]:
            if name in data:
                raise TypeError(f"{cls.__name__}: `{name}` is given twice")
        given = {**dict(zip(names, args, strict=False)), **data}
        for name in _SEVERAL & given.keys():
            if isinstance(given[name], Frozen):
                given[name] = (given[name],)
        for name in _COLOURS & given.keys():
            if isinstance(given[name], str) and given[name] != "default":
                given[name] = _decoded(cls.__name__, given[name])
        return given

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """What differs from the defaults: the code that makes it."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if field.is_required() or value != field.default:
                yield name, value

    def __repr__(self) -> str:
        try:
            return super().__repr__()
        except RecursionError:  # nested deeper than Python likes to recurse
            return f"{type(self).__name__}(…)"


TAGS: Final = frozenset(("stated", "unsaid", "object", "group", "boolean", "chain"))
"""What pydantic names in the place of a mistake and text does not nest by."""
_MOST: Final = 3  # mistakes that one exception tells
_WIDTH: Final = 40  # characters of a value that are shown
_KINDS: Final = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text",
    "bool_type": "true or false",
    "tuple_type": "a sequence",
}


def said(item: ErrorDetails) -> str:
    """A mistake's message as it stands after the name of its place and a colon."""
    match item["type"]:
        case "string_pattern_mismatch":
            return "not a possible name"
        case "missing":
            return "is missing"
    words = item["msg"].removeprefix("Value error, ")
    return (words[:1].lower() + words[1:]).removeprefix("input ")


def refusal(name: str, error: ValidationError, known: list[str]) -> ValueError:
    """What the constructor of class ``name`` raises; ``known`` are the names of its arguments."""
    found = error.errors(include_url=False)
    lines = [_line(item, known) for item in found[:_MOST]]
    more = f"; and {len(found) - _MOST} more" if len(found) > _MOST else ""
    return ValueError(f"{name}: {'; '.join(lines)}{more}")


def _line(item: ErrorDetails, known: list[str]) -> str:
    parts = [part for part in item["loc"] if part not in TAGS]
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts).lstrip(".")
    kind, value = item["type"], item["input"]
    if kind == "extra_forbidden":
        from difflib import get_close_matches  # only mistakes need it

        near = get_close_matches(path, known, 1)
        return f"there is no `{path}`, " + (
            f"did you mean `{near[0]}`?" if near else f"only {', '.join(known)}"
        )
    if kind == "missing":
        return f"`{path}` is missing"
    if kind == "union_tag_invalid":
        wanted = item["ctx"]["expected_tags"].replace("'", "")
        return f"`{path}` is a {_shown(value)}; it may be {wanted}"
    if "class_name" in item.get("ctx", {}):
        return f"`{path}` is {_shown(value)}, not a {item['ctx']['class_name']}"
    if kind in _KINDS:
        return f"`{path}` is {_shown(value)}, not {_KINDS[kind]}"
    return f"`{path}`: {said(item)}" if path else said(item)


def _shown(value: Any) -> str:
    if hasattr(value, "kind"):
        return type(value).__name__
    text = repr(value)
    return text if len(text) <= _WIDTH else f"{text[: _WIDTH - 1]}…"
