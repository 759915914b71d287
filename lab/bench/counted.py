"""Every call of numpy that a drawing makes, counted and timed, by the part of the renderer that made it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, NamedTuple
from unittest.mock import patch

import numpy as np

from scenelang.renderers.arrays import Arrays

PARTS = {  # by module, or function of one
    "frames": "frames",
    "network.decode": "decoder",
    "field._decoded": "decoder",
    "grid": "decoder",
    "closed.distance": "decoder",
    "texture": "textures",
    "network.update": "cell",
    "field.fold": "cell",
    "field.picture": "cell",
    "bounds": "bounds",
    "slopes": "bounds",
    "closed.rise": "bounds",
    "field.rise": "bounds",
    "field.proved": "bounds",
}
OTHER = "lists of pairs"
MOVES = "gather, scatter"
MOVING = ("take", "concatenate", "stack", "copy", "astype", "repeat", "getitem", "setitem", "where")
COMPUTING = (
    "clip",
    "max",
    "min",
    "sum",
    "mean",
    "any",
    "all",
    "argsort",
    "cumsum",
    "nonzero",
    "searchsorted",
)


class Call(NamedTuple):
    """A call of numpy: which part of the renderer made it, and what it took."""

    part: str
    seconds: float
    operations: int
    moved: int  # bytes read and written


class Counted(np.ndarray[Any, Any]):
    """An array whose operations are written down in ``calls``."""

    calls: ClassVar[list[Call]] = []

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = None, **kw: Any) -> Any:
        if out is not None:
            kw["out"] = tuple(map(_plain, out))
        name = ufunc.__name__ if method == "__call__" else method
        return _run(name, getattr(ufunc, method), inputs, kw)

    def __array_function__(self, function: Any, types: Any, args: Any, kw: Any) -> Any:
        return _run(function.__name__, function, args, kw)

    def __getitem__(self, index: Any) -> Any:
        if _simple(index):
            return super().__getitem__(index)
        return _run("getitem", np.ndarray.__getitem__, (self, index), {})

    def __setitem__(self, index: Any, value: Any) -> None:
        _run("setitem", np.ndarray.__setitem__, (self, index, value), {})


def _method(name: str) -> Callable[..., Any]:
    own = getattr(np.ndarray, name)
    return lambda self, *args, **kw: _run(name, own, (self, *args), kw)


for _name in {*MOVING, *COMPUTING} & {*dir(np.ndarray)}:
    setattr(Counted, _name, _method(_name))


def _simple(index: Any) -> bool:
    """Whether an index makes a view."""
    return all(
        part is None or part is ... or isinstance(part, int | slice)
        for part in (index if isinstance(index, tuple) else (index,))
    )


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.view(np.ndarray)
    return type(value)(map(_plain, value)) if type(value) in (tuple, list) else value


def _counted(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.view(Counted)
    return tuple(map(_counted, value)) if type(value) is tuple else value


def _arrays(value: Any) -> Iterator[np.ndarray[Any, Any]]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple | list):
        for part in value:
            yield from _arrays(part)


def _run(name: str, function: Callable[..., Any], args: tuple[Any, ...], kw: dict[str, Any]) -> Any:
    args, kw = _plain(args), {key: _plain(value) for key, value in kw.items()}
    started = time.perf_counter()
    found = function(*args, **kw)
    seconds = time.perf_counter() - started
    ins, outs = list(_arrays(args)), list(_arrays(found))
    made = sum(array.nbytes for array in outs)
    if name in MOVING:  # from wherever to wherever, and by which index
        moved = 2 * (made or ins[-1].nbytes) + sum(a.nbytes for a in ins[1:] if a.dtype.kind in "ib")
        Counted.calls.append(Call(MOVES, seconds, 0, moved))
    else:
        most = max((array.size for array in [*ins, *outs]), default=1)
        operations = 2 * ins[0].shape[-1] * outs[0].size if name == "matmul" else most
        Counted.calls.append(Call(_part(), seconds, operations, made + sum(array.nbytes for array in ins)))
    return _counted(found)


def _part() -> str:
    """Of the innermost function of a renderer that is running."""
    frame = sys._getframe(2)
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        if path.parent.name in ("renderers", "frontier") and not path.stem.startswith("arrays"):
            names = f"{path.stem}.{frame.f_code.co_name}", path.stem
            return next((PARTS[name] for name in names if name in PARTS), OTHER)
        frame = frame.f_back  # type: ignore[assignment]
    return OTHER


class _Numpy:
    """numpy, whose functions make counted arrays."""

    def __getattr__(self, name: str) -> Any:
        found = getattr(np, name)
        if isinstance(found, type | np.ufunc) or not callable(found):
            return found
        return lambda *args, **kw: _run(name, found, args, kw)


@contextmanager
def counting() -> Iterator[list[Call]]:
    """The calls of numpy within renderers meanwhile, in order."""
    Counted.calls = []
    modules = [
        module
        for name, module in sys.modules.items()
        if name.startswith(("scenelang.renderers.", "scenelang.backend.closed"))
    ]
    numpy = _Numpy()
    patches = [patch.object(module, "np", numpy) for module in modules if hasattr(module, "np")]
    patches.append(patch.object(Arrays, "to_numpy", staticmethod(lambda x: x)))
    for each in patches:
        each.start()
    try:
        yield Counted.calls
    finally:
        for each in patches:
            each.stop()
