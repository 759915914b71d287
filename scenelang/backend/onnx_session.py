"""Graphs for onnxruntime, put together node by node, and sessions that run them on the CPU.

onnxruntime and onnx are an extra; nothing here is imported before a picture in 8 bits is asked for.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.backend.errors import RenderError

OPSET: Final = 21
_IR: Final = 10
_KINDS: Final = {"float32": 1, "uint8": 2}  # onnx.TensorProto


def missing_package() -> str | None:
    """The package that 8 bits need and that is not installed."""
    return next((name for name in ("onnxruntime", "onnx") if importlib.util.find_spec(name) is None), None)


def need_onnx() -> None:
    """Raises RenderError, with the command to run, where onnxruntime or onnx is not installed."""
    name = missing_package()
    if name is not None:
        raise RenderError(f"precision int8 needs {name}, which is missing; pip install 'scenelang[int8]'")


@dataclass(slots=True)
class Nodes:
    """A graph under construction. Every method returns the name of its result.

    Args:
        nodes: what was added so far.
        constants: arrays by name.
        inputs, outputs: name, element type and shape, None for a side that is known when run.
    """

    nodes: list[Any] = field(default_factory=list)
    constants: dict[str, npt.NDArray[Any]] = field(default_factory=dict)
    inputs: dict[str, tuple[str, tuple[int | None, ...]]] = field(default_factory=dict)
    outputs: dict[str, tuple[str, tuple[int | None, ...]]] = field(default_factory=dict)

    def input(self, name: str, kind: str, shape: tuple[int | None, ...]) -> str:
        self.inputs[name] = kind, shape
        return name

    def output(self, name: str, kind: str, shape: tuple[int | None, ...], value: str) -> None:
        self.nodes.append(_node("Identity", [value], [name]))
        self.outputs[name] = kind, shape

    def constant(self, value: npt.ArrayLike, dtype: Any) -> str:
        name = f"c{len(self.constants)}"
        self.constants[name] = np.ascontiguousarray(value, dtype)
        return name

    def add(self, op: str, *inputs: str, **attributes: Any) -> str:
        return self.split(op, 1, *inputs, **attributes)[0]

    def split(self, op: str, count: int, *inputs: str, **attributes: Any) -> list[str]:
        names = [f"n{len(self.nodes)}_{i}" for i in range(count)]
        self.nodes.append(_node(op, list(inputs), names, **attributes))
        return names

    def quantise(self, x: str, scale: float, zero: int) -> str:
        """To uint8: round(x / scale) + zero, saturated."""
        return self.add("QuantizeLinear", x, self.constant(scale, np.float32), self.constant(zero, np.uint8))

    def dequantise(self, x: str, scale: float, zero: int) -> str:
        """From uint8: (x - zero) scale."""
        return self.add(
            "DequantizeLinear", x, self.constant(scale, np.float32), self.constant(zero, np.uint8)
        )

    def weights(
        self, w: npt.NDArray[np.float32], b: npt.NDArray[np.float32] | None, scale: float
    ) -> list[str]:
        """Kernels (out, in, h, w) in int8, a scale for each output, and biases (out,) in int32.

        Args:
            w: kernels.
            b: biases, or None.
            scale: of the layer's input; biases are kept in its product with the kernels' scales.
        """
        steps, kernels = integer_kernels(w)
        zeros = self.constant(np.zeros(len(w)), np.int8)
        found = [
            self.add(
                "DequantizeLinear",
                self.constant(kernels, np.int8),
                self.constant(steps, np.float32),
                zeros,
                axis=0,
            )
        ]
        if b is not None:
            unit = (steps * np.float32(scale)).astype(np.float32)
            most = 2.0**30  # beyond what the sum of a layer's products reaches
            whole = np.clip(np.rint(b / unit.astype(np.float64)), -most, most)
            zeros = self.constant(np.zeros(len(w)), np.int32)
            found.append(
                self.add(
                    "DequantizeLinear",
                    self.constant(whole, np.int32),
                    self.constant(unit, np.float32),
                    zeros,
                    axis=0,
                )
            )
        return found

    def session(self, threads: int) -> Any:
        """Check the graph and make an onnxruntime session of it.

        Args:
            threads: cores that it computes on.
        """
        need_onnx()
        from onnx import checker, helper, numpy_helper

        graph = helper.make_graph(
            self.nodes,
            "scenelang",
            [_described(name, *what) for name, what in self.inputs.items()],
            [_described(name, *what) for name, what in self.outputs.items()],
            [numpy_helper.from_array(value, name) for name, value in self.constants.items()],
        )
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=_IR)
        checker.check_model(model)
        return _open(model.SerializeToString(), threads)


def integer_kernels(w: npt.NDArray[np.float32]) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int8]]:
    """A step (out,) for each output and whole kernels in -127 to 127, w ≈ step x kernel."""
    largest = np.abs(w).reshape(len(w), -1).max(1)
    steps = (np.where(largest > 0, largest, 1.0) / 127).astype(np.float32)
    shape = (-1,) + (1,) * (w.ndim - 1)
    return steps, np.rint(w / steps.reshape(shape)).clip(-127, 127).astype(np.int8)


def _node(op: str, inputs: Sequence[str], outputs: Sequence[str], **attributes: Any) -> Any:
    from onnx import helper

    return helper.make_node(op, list(inputs), list(outputs), **attributes)


def _described(name: str, kind: str, shape: tuple[int | None, ...]) -> Any:
    from onnx import helper

    return helper.make_tensor_value_info(name, _KINDS[kind], list(shape))


@lru_cache(maxsize=1)
def has_vnni() -> bool:
    """Whether the processor is known to add 8-bit products in 32 bits, without overflow, in one instruction.

    Only Linux says so in a file; elsewhere the answer is no, which costs time, not accuracy.
    """
    try:
        return "vnni" in Path("/proc/cpuinfo").read_text("utf-8", "replace")
    except OSError:
        return False


def _open(model: bytes, threads: int) -> Any:
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    if not has_vnni():
        # they add pairs of products in 16 bits, which overflow: have them take a longer way
        options.add_session_config_entry("session.x64quantprecision", "1")
    # threads that wait for the next layer by spinning cost the other processes of the machine
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
