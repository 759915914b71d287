"""The dozen functions by which numpy arrays and torch tensors differ; all else is written as both have it.

The field is written once, for a network whose `xp` is `NUMPY` here or `TORCH` (`arrays_torch.py`). Points lie
along the last axis, M. Functions leave their arguments as they are; `put`, `add`, `above` and `unit` write in
place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

Array = Any  # a numpy array, or a torch tensor on any device
BLOCK = 256
"""Points of a product: larger ones are split among cores by OpenBLAS, whose threads wait for each other."""
Layers = Sequence[tuple[Array, Array]]  # weights (…, out, in) and biases (…, out)
SMOOTH_BLOCK = 2048  # points that go through smooth layers at once


class Smooth(list[tuple[Array, Array]]):
    """Layers with SiLU between."""

    @cached_property
    def joined(self) -> list[Array]:
        """Weights with biases as a last column, of numpy; of hidden layers half of them."""
        joined = [np.concatenate([w, b[:, None]], 1) for w, b in self]
        return [*(w / 2 for w in joined[:-1]), joined[-1]]


class Arrays:
    """Functions on arrays of numpy; a subclass has those of another library."""

    to_numpy: ClassVar[Any] = staticmethod(np.asarray)
    array: ClassVar[Any] = staticmethod(lambda values, like: values)  # of a numpy array, where another lies
    full: ClassVar[Any] = staticmethod(lambda shape, value, like: np.full(shape, value, like.dtype))
    concat: ClassVar[Any] = staticmethod(np.concatenate)  # (parts, axis)
    # (parts, axis); along the first, `np.stack` takes four times as long
    stack: ClassVar[Any] = staticmethod(lambda x, axis: np.stack(x, axis) if axis else np.array(x))
    copy: ClassVar[Any] = staticmethod(np.copy)
    packed: ClassVar[Any] = staticmethod(np.ascontiguousarray)  # the same entries, contiguous in memory
    where: ClassVar[Any] = staticmethod(lambda mask: mask.nonzero()[0])  # indices (k,) of a mask (M,)
    order: ClassVar[Any] = staticmethod(lambda x: x.argsort(kind="stable"))  # indices that sort (M,)
    take: ClassVar[Any] = staticmethod(lambda x, index: x.take(index, -1))  # entries (…, k) of (…, M)
    frozen: ClassVar[Any] = staticmethod(lambda x: x)  # the same numbers, without their gradients
    wide: ClassVar[Any] = staticmethod(lambda x: x.astype(np.float64))
    narrow: ClassVar[Any] = staticmethod(lambda x: x.astype(np.float32))
    whole: ClassVar[Any] = staticmethod(lambda x: x.astype(np.intp))  # integers, to index with
    largest: ClassVar[Any] = staticmethod(lambda x: x.max(-2, keepdims=True))  # over rows: (…, 1, M)
    least: ClassVar[Any] = staticmethod(lambda x: x.min(0))  # (M,) of (R, M)
    total: ClassVar[Any] = staticmethod(lambda x: np.add.reduce(x, 0))  # the sum (M,) of (R, M)
    above: ClassVar[Any] = staticmethod(lambda x: np.maximum(x, 0.0, out=x))  # parts above zero, in place
    sigmoid: ClassVar[Any] = staticmethod(lambda x: 1.0 / (1.0 + np.exp(-x)))
    exp: ClassVar[Any] = np.exp
    log: ClassVar[Any] = np.log
    cos: ClassVar[Any] = np.cos
    sin: ClassVar[Any] = np.sin
    acos: ClassVar[Any] = np.arccos
    sqrt: ClassVar[Any] = np.sqrt
    floor: ClassVar[Any] = np.floor
    minimum: ClassVar[Any] = np.minimum
    maximum: ClassVar[Any] = np.maximum
    select: ClassVar[Any] = staticmethod(np.where)  # (mask, where it holds, elsewhere)
    # a context: no gradients are kept, and numbers beyond float32 pass without a warning
    inference: ClassVar[Any] = staticmethod(lambda: np.errstate(all="ignore"))
    one_core: ClassVar[Any] = staticmethod(
        lambda: None
    )  # have this thread compute each operation on one core

    def unit(self, x: Array) -> Array:
        """Clamped to [0, 1], in place."""
        return np.minimum(np.maximum(x, 0.0, out=x), 1.0, out=x)

    def length(self, p: Sequence[Array]) -> Array:
        """Euclidean lengths of points, by their coordinates."""
        return np.sqrt(sum(coordinate * coordinate for coordinate in p))

    def add_product(self, total: Array, x: Array, factor: Array | float) -> Array:
        """``total + x * factor``, rounded once where the library can."""
        result = x * factor
        result += total
        return result

    def dense(self, x: Array, w: Array, b: Array) -> Array:
        """A layer ``w @ x + b``: (…, in, M), (…, out, in), (…, out)."""
        result = w @ x
        result += b[..., None]
        return result

    def perceptron(self, x: Array, layers: Layers) -> Array:
        """Layers with rectified linear units between: (out, M) of (in, M); torch takes leading axes too."""
        channels, count = x.shape
        blocks = max(1, -(-count // BLOCK))
        each = -(-count // blocks)
        even = np.zeros((channels, blocks * each), x.dtype)
        even[:, :count] = x
        x = even.reshape(channels, blocks, each).swapaxes(0, 1)
        for layer in layers[:-1]:
            x = self.dense(x, *layer)  # (blocks, out, each)
            np.maximum(x, 0.0, out=x)
        return self.dense(x, *layers[-1]).swapaxes(0, 1).reshape(-1, blocks * each)[:, :count]

    def smooth(self, x: Array, layers: Smooth) -> Array:
        """Layers with SiLU between: (out, M) of (in, M)."""
        result = np.empty((len(layers[-1][1]), x.shape[1]), x.dtype)
        for start in range(0, x.shape[1], SMOOTH_BLOCK):
            into = result[:, start : start + SMOOTH_BLOCK]
            inputs = np.ones((len(x) + 1, into.shape[1]), x.dtype)  # a last row for the biases
            inputs[:-1] = x[:, start : start + SMOOTH_BLOCK]
            for weights in layers.joined[:-1]:
                half = weights @ inputs  # a sigmoid(a) is h + h tanh(h), h = a / 2
                if len(inputs) != len(half) + 1:
                    inputs = np.ones((len(half) + 1, into.shape[1]), x.dtype)
                units = inputs[:-1]
                np.tanh(half, out=units)
                units += 1.0
                units *= half
            np.matmul(layers.joined[-1], inputs, out=into)
        return result

    def put(self, x: Array, index: Array, values: Array) -> None:
        """Overwrite entries of (M,) or (R, M) by values (k,) or (R, k)."""
        if x.ndim == 1:
            x[index] = values
            return
        for row, value in zip(x, values, strict=True):  # four times as fast as `x[:, index] = values`
            row[index] = value

    def add(self, x: Array, index: Array, values: Array) -> None:
        """Add values (R, k) to entries of (R, M), to some of them more than once."""
        for row, value in zip(x, values, strict=True):
            np.add.at(row, index, value)

    def each(self, threads: int, work: Callable[[Any], object], items: Sequence[Any]) -> None:
        """Call ``work`` on each item, in so many threads if there is more than one item."""
        if threads == 1 or len(items) == 1:
            for item in items:
                work(item)
            return
        from concurrent.futures import ThreadPoolExecutor

        # every worker computes on one core; torch would otherwise split each small product again
        with ThreadPoolExecutor(threads, initializer=self.one_core) as pool:
            list(pool.map(work, items))


NUMPY = Arrays()
