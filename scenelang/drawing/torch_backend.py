"""Programs drawn by torch: the device, the models that are loaded, and the process's threads and memory.

Tiles are drawn in a pool of threads with one torch thread each; torch's own threads wait for each other
after every small product, and beside another busy process took up to thirty times as long.
"""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import Unpack

from scenelang.assets.element import credit_of
from scenelang.compiler.program import Program, ProgramError
from scenelang.compiler.weights import ModelError, replaced
from scenelang.drawing.how import RenderError, keep_memory, threads_for
from scenelang.drawing.neural.draw import Drawing, Run, draw_objects
from scenelang.drawing.neural.load import Framed, Model, Solids, load_model, place_of
from scenelang.drawing.neural.paper import draw_whole

try:
    import torch
except ModuleNotFoundError as error:
    raise RenderError("this is drawn by torch, which is not installed; pip install torch") from error

_loading = threading.Lock()
_drawing = threading.Lock()


def choose_device(device: str) -> str:
    """The torch device of ``auto``, ``cpu`` or ``cuda``; `RenderError` without CUDA, else `ValueError`."""
    if device not in ("auto", "cpu", "cuda"):
        raise ValueError(f"unknown device `{device}`; there are `auto`, `cpu` and `cuda`")
    if device == "cpu":
        return "cpu"
    if torch.cuda.is_available():
        return "cuda"
    if device == "cuda":
        built = "sees no device" if torch.version.cuda else "is built without it"
        raise RenderError(f"CUDA is asked for, but this torch {built}")
    return "cpu"


@lru_cache(maxsize=8)
def _load(name: str, device: str, weights: str) -> Model:
    keep_memory()
    return load_model(name, device, weights=weights)


def open_model(name: str, device: str = "cpu", weights: str = "") -> Model:
    """A shipped model, loaded once for each process and device.

    ``weights`` is the SHA-256, hex, of those that a Program was compiled for; where others replaced them
    since, they are loaded. Raises `RenderError` where there is no such model, or its weights are missing or
    damaged.
    """
    try:
        with _loading:
            return _load(name, device, replaced(weights))
    except KeyError:
        raise RenderError(f"unknown model `{name}`") from None
    except ModelError as error:
        raise RenderError(str(error)) from None


def draw_program(program: Program, model: Model, *, skip: bool = True, **run: Unpack[Run]) -> Drawing:
    """Draw a Program, as of `Run`; one drawing runs at a time, on all of ``threads``.

    Without ``skip`` points that an object cannot reach are asked too; no pixel measured differed by 0.001.
    Raises `RenderError` where the Program is of another model or other weights, its vectors are not those of
    a compiled scene, it has a sky, or the model does not draw in this way.
    """
    name, network = model.manifest.name, model.network
    if program.model != name:
        raise RenderError(f"a program for model `{program.model}`, not `{name}`")
    threads, samples, progress = run.get("threads"), run.get("samples", "adaptive"), run.get("progress")
    run["threads"] = threads_for(program.canvas) if threads is None else threads
    if place_of(network).type != "cpu":
        run |= {"threads": 1, "split": 1}  # the device is busy with one tile
    with _drawing:
        before = torch.get_num_threads()
        torch.set_num_threads(1)  # set around the pool, whose threads take it over
        try:
            program.check_weights(model.digest)
            if program.stage is not None and program.stage.sky is not None:
                fact = "light from everywhere (sky) is drawn by the kernel alone"
                raise RenderError(f"{fact}; leave out --device")
            if isinstance(network, Framed | Solids):
                drawing = draw_objects(network, program, skip=skip, **run)
                drawing.image.credit = credit_of(program.elements)
                return drawing
            if samples != "adaptive" or program.samples != 4:
                way = samples if program.samples == 4 else program.samples
                raise RenderError(f"model `{name}` samples pixels in one way only, not `{way}`")
            torch.set_num_threads(run["threads"] or 1)
            return draw_whole(network, program, progress=progress)
        except ProgramError as error:
            raise RenderError(str(error)) from None
        finally:
            torch.set_num_threads(before)
