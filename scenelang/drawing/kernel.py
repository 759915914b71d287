"""The kernel: the field of solids in compiled code, asked by way of ctypes, which lets other threads run.

A wheel and an editable install bring its library. In a checkout whose C has changed since, it is built again
where Zig's compiler is installed (`pip install ziglang`); else that is an error that says so.
"""

from __future__ import annotations

import ctypes
import importlib.util
import sys
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.drawing.arrays import Array
from scenelang.drawing.how import RenderError
from scenelang.drawing.tables import CELL, DECODER, OBJECT, SCENE, STEP, TEXTURE, Tables

FOLDER: Final = Path(__file__).resolve().parent
ROOT: Final = FOLDER.parents[1]  # of a checkout
_SIZES: Final = [dtype.itemsize for dtype in (OBJECT, STEP, DECODER, CELL, TEXTURE, SCENE)]
_CALLS: Final = {
    "newest": ("", "i"),
    "sizes": ("p", ""),
    "scratch": ("ip", "l"),
    "field": ("iplppppppp", "l"),
    "own": ("iplpppp", ""),
}
"""Arguments and results of the library's functions: i int32, l int64, p an address."""
_TYPES: Final = {"i": ctypes.c_int32, "l": ctypes.c_int64, "p": ctypes.c_void_p, "": None}

Floats = npt.NDArray[np.float32]


class KernelError(RenderError):
    """The kernel's library cannot be loaded here, and why."""


class Asked(NamedTuple):
    """Answers of the field at M points; what was not asked for has none."""

    distance: Array  # (M,) world units
    gradient: Array  # (3, M)
    register: Array  # (R, M) as `Looks`
    owner: Array  # (M,) numbers of objects whose material holds, from 1; 0 for none
    met: int  # pairs of points and objects that met


class Kernel:
    """A library's functions; raises `KernelError` where it is not one of these sources."""

    def __init__(self, path: Path) -> None:
        try:
            self._library = ctypes.CDLL(str(path))
            for name, (arguments, result) in _CALLS.items():
                call = getattr(self._library, name)
                call.argtypes, call.restype = [_TYPES[kind] for kind in arguments], _TYPES[result]
        except (OSError, AttributeError) as error:
            raise KernelError(f"the kernel's library cannot be loaded: {error}") from None
        self.variant: int = self._library.newest()
        sizes = np.zeros(len(_SIZES), np.int32)
        self._library.sizes(sizes.ctypes.data)
        if sizes.tolist() != _SIZES:
            raise KernelError("the kernel's library is one of other tables")

    def field(
        self,
        tables: Tables,
        points: npt.NDArray[Any],
        reach: Any,
        gradient: bool = False,
        every: bool = False,
    ) -> Asked:
        """The field at points (3, M), exact where D is less than a reach, (M,) or one, in world units;
        elsewhere D is anything from there on, 100 where no object is near. ``every`` asks for all there is.
        """
        points = np.ascontiguousarray(points, np.float32)
        count, rows = points.shape[1], int(tables.scene["rows"])
        assert points.shape == (3, count)
        reach = np.ascontiguousarray(np.broadcast_to(np.asarray(reach, np.float32), (count,)))
        slopes, looks = count * (gradient or every), count * every
        answers = np.empty(count, np.float32), np.empty((3, slopes), np.float32)
        more = np.empty((rows, looks), np.float32), np.empty(looks, np.int32)
        scene = tables.scene.ctypes.data
        scratch = np.empty(self._library.scratch(self.variant, scene), np.uint8)
        parts = (points, reach, *answers, *more, scratch)
        places = [part.ctypes.data if part.size else None for part in parts]
        met = self._library.field(self.variant, scene, count, *places) if count else 0
        return Asked(*answers, *more, met)

    def own(
        self, tables: Tables, objects: npt.NDArray[np.integer], points: npt.NDArray[Any]
    ) -> tuple[Floats, Floats]:
        """Distances (M,) of objects alone by their numbers (M,), from 0, whatever else is at points (3, M),
        and the gradients (3, M) of these.
        """
        numbers, points = np.ascontiguousarray(objects, np.int32), np.ascontiguousarray(points, np.float32)
        count = len(numbers)
        assert points.shape == (3, count)
        assert ((numbers >= 0) & (numbers < tables.scene["objects"])).all()
        distance, gradient = np.empty(count, np.float32), np.empty((3, count), np.float32)
        places = [part.ctypes.data for part in (numbers, points, distance, gradient)]
        self._library.own(self.variant, tables.scene.ctypes.data, count, *places)
        return distance, gradient


def _source() -> Any:
    """The module that builds the library; None outside of a checkout."""
    path = ROOT / "kernel" / "build.py"
    if not (path.is_file() and (ROOT / "hatch_build.py").is_file()):
        return None
    spec = importlib.util.spec_from_file_location("scenelang_kernel_build", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def load_kernel() -> Kernel:
    """The kernel of this machine, loaded once; raises `KernelError` where there is none."""
    source = _source()
    path = FOLDER / ("libkernel.dll" if sys.platform == "win32" else "libkernel.so")
    if source is None:
        return Kernel(path)
    # looked for in the file, as a library that was loaded once is not loaded again from the same place
    if path.is_file() and source.mark().encode() in path.read_bytes():
        return Kernel(path)
    if importlib.util.find_spec("ziglang") is None:
        raise KernelError("the kernel's library is not that of kernel/; pip install ziglang, which builds it")
    try:
        source.build(path)
    except (RuntimeError, OSError) as error:
        raise KernelError(str(error)) from None
    return Kernel(path)
