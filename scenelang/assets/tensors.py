"""Files of tensors, safetensors with a JSON header of ours, checked as a stranger's before they are read."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import TYPE_CHECKING, Any, Final

from scenelang.assets.files import read_json
from scenelang.assets.records import Record

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

FORMAT: Final = 1
MOST_HEADER: Final = 1 << 20
_MOST_NAME, _MOST_SIDES, _MOST_SIDE = 200, 8, 1 << 31
_TYPES: Final = {
    "F64": "<f8", "F32": "<f4", "F16": "<f2", "I64": "<i8", "I32": "<i4", "I16": "<i2", "I8": "<i1",
    "U8": "<u1", "BOOL": "|b1",
}  # fmt: skip
_KINDS: Final = {str: "text", int: "a whole number", list: "a list", dict: "an object"}


class TensorError(ValueError):
    """A damaged or foreign file of tensors; the message says where."""


class Tensor(Record):
    """One tensor of a file."""

    type: str  # as safetensors calls it, `F32`
    shape: tuple[int, ...]  # sides
    # where its bytes begin and end, counted from the end of the file's header
    first: int
    last: int


class TensorFile(Record):
    """A file whose layout was checked."""

    header: dict[str, Any]  # our own
    tensors: dict[str, Tensor]  # by name
    body: memoryview  # the tensors' bytes

    def arrays(self, *, finite: bool = True) -> dict[str, npt.NDArray[Any]]:
        """All tensors, copied; raises `TensorError`, where ``finite`` also for numbers that are not."""
        return {name: self._array(name, tensor, finite) for name, tensor in self.tensors.items()}

    def _array(self, name: str, tensor: Tensor, finite: bool) -> npt.NDArray[Any]:
        import numpy as np

        part = self.body[tensor.first : tensor.last]
        flat: np.ndarray[Any, Any] = np.frombuffer(part, _TYPES[tensor.type]).copy()
        if tensor.type == "BOOL" and flat.view(np.uint8).max(initial=0) > 1:
            raise TensorError(f"tensor `{name}` holds what is neither true nor false")
        if finite and tensor.type.startswith("F") and not np.isfinite(flat).all():
            raise TensorError(f"tensor `{name}` holds numbers that are not finite")
        return flat.reshape(tensor.shape)


def read_tensors(data: bytes, most_bytes: int, formats: Collection[int] = (FORMAT,)) -> TensorFile:
    """The tensors and the header in a file's bytes; raises `TensorError` for a damaged or too large one."""
    if len(data) > most_bytes:
        raise TensorError(f"more than {most_bytes:,} bytes")
    length = int.from_bytes(data[:8], "little")
    if len(data) < 8 or length > min(MOST_HEADER, len(data) - 8):
        raise TensorError("its header does not fit")
    outer = _object(data[8 : 8 + length], "the list of tensors")
    metadata = outer.pop("__metadata__", None)
    if not isinstance(metadata, dict) or metadata.keys() != {"scenelang"}:
        raise TensorError("its metadata are not those of scenelang")
    if not isinstance(text := metadata["scenelang"], str):
        raise TensorError("its metadata are not text")
    header = _object(text.encode("utf-8", "surrogatepass"), "the header")
    if type(result := header.get("format")) is not int or result not in formats:
        raise TensorError(f"not of format {' or '.join(map(str, formats))}")
    body = memoryview(data)[8 + length :]
    tensors = {name: _tensor(name, entry) for name, entry in outer.items()}
    end = 0
    for name, tensor in sorted(tensors.items(), key=lambda item: (item[1].first, item[1].last)):
        if tensor.first != end:
            raise TensorError(f"tensor `{name}` begins at byte {tensor.first:,}, where {end:,} is expected")
        end = tensor.last
    if end != len(body):
        raise TensorError(f"its tensors need {end:,} bytes and there are {len(body):,}")
    return TensorFile(header, tensors, body)


def _object(data: bytes, what: str) -> dict[str, Any]:
    try:
        result = read_json(data)
    except ValueError as error:
        raise TensorError(f"{what}: {str(error).lower()}") from None
    if not isinstance(result, dict):
        raise TensorError(f"{what} is not an object")
    return result


def check_fields(value: Any, schema: Any, whose: str) -> None:
    """Hold JSON to a schema; raises `TensorError`, which names the field that is of another type or range.

    A schema is a type, a `range`, the least and the greatest of numbers, a list with that of all items, or a
    dict with those of fields, of which ``name?`` may lack, or with that of all fields for `str`.
    """
    kind = schema if isinstance(schema, type) else type(schema)
    fits, wanted = type(value) is kind, _KINDS.get(kind, "")
    if isinstance(schema, range):
        fits = type(value) is int and value in schema
        wanted = f"a whole number from {schema[0]:,} to {schema[-1]:,}"
    elif isinstance(schema, tuple):
        fits = type(value) in (int, float) and schema[0] <= value <= schema[1]
        wanted = f"a number from {schema[0]:g} to {schema[1]:g}"
    if not fits:
        raise TensorError(f"{whose} is not {wanted}")
    for item in value if isinstance(schema, list) else ():
        check_fields(item, schema[0], whose)
    if isinstance(schema, dict):
        known = dict.fromkeys(value, schema[str]) if str in schema else schema
        fields = {name.removesuffix("?"): inner for name, inner in known.items()}
        if not known.keys() & fields.keys() <= value.keys() <= fields.keys():
            raise TensorError(f"{whose} has missing or unknown fields")
        for name, item in value.items():
            check_fields(item, fields[name], f"`{name[:40]}` of {whose}")


def _tensor(name: str, entry: Any) -> Tensor:
    if not name.isprintable() or not 0 < len(name) <= _MOST_NAME:
        raise TensorError(f"a tensor has the name {name[:40]!r}")
    if not isinstance(entry, dict) or entry.keys() != {"dtype", "shape", "data_offsets"}:
        raise TensorError(f"tensor `{name}` does not have a type, a shape and a place alone")
    kind, shape, place = entry["dtype"], entry["shape"], entry["data_offsets"]
    if not isinstance(kind, str) or kind not in _TYPES:
        raise TensorError(f"tensor `{name}` has an unknown type")
    if not _are_sizes(shape) or len(shape) > _MOST_SIDES:
        raise TensorError(f"tensor `{name}` has no shape")
    if not _are_sizes(place) or len(place) != 2:
        raise TensorError(f"tensor `{name}` has no place in the file")
    if math.prod(shape) * int(_TYPES[kind][2:]) != (size := place[1] - place[0]):
        raise TensorError(f"tensor `{name}` is {kind} {shape}, which does not take {size:,} bytes")
    return Tensor(kind, tuple(shape), place[0], place[1])


def _are_sizes(value: Any) -> bool:
    return isinstance(value, list) and all(type(side) is int and 0 <= side < _MOST_SIDE for side in value)
