"""Torch's side of `scenelang.drawing.arrays`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import linear, silu

from scenelang.drawing.arrays import Array, Arrays, Layers, Smooth


def _where(mask: Tensor) -> Tensor:
    if mask.device.type == "cpu":
        return torch.from_numpy(mask.numpy().nonzero()[0])  # several times as fast as torch's
    return mask.nonzero()[:, 0]


class Torch(Arrays):
    """Functions on tensors."""

    to_numpy = staticmethod(lambda x: x.detach().cpu().numpy())
    concat = staticmethod(torch.cat)
    stack = staticmethod(torch.stack)
    copy = staticmethod(Tensor.clone)
    packed = staticmethod(Tensor.contiguous)
    where = staticmethod(_where)
    order = staticmethod(lambda x: x.argsort(stable=True))
    take = staticmethod(lambda x, index: x.index_select(-1, index))  # many times as fast as a subscript
    put = staticmethod(lambda x, index, values: x.index_copy_(-1, index, values))
    add = staticmethod(lambda x, index, values: x.index_add_(-1, index, values))
    frozen = staticmethod(Tensor.detach)
    full = staticmethod(lambda shape, value, like: like.new_full(shape, value))
    wide, narrow, whole = (staticmethod(convert) for convert in (Tensor.double, Tensor.float, Tensor.long))
    largest = staticmethod(lambda x: x.amax(-2, keepdim=True))
    least = staticmethod(lambda x: x.amin(0))
    total = staticmethod(lambda x: x.sum(0))
    above = staticmethod(lambda x: x.relu_())
    unit = staticmethod(lambda x: x.clamp(0.0, 1.0))
    sigmoid = staticmethod(Tensor.sigmoid)
    inference = staticmethod(torch.no_grad)
    one_core = staticmethod(lambda: torch.set_num_threads(1))
    exp, log, cos, sin = torch.exp, torch.log, torch.cos, torch.sin
    acos, sqrt, floor = torch.acos, torch.sqrt, torch.floor
    minimum, maximum, select = torch.minimum, torch.maximum, torch.where

    def array(self, values: np.ndarray, like: Tensor) -> Tensor:
        result = torch.from_numpy(values)
        if like.device.type == "cuda":  # from page-locked memory, for which the host need not wait
            result = result.pin_memory()
        return result.to(like.device, non_blocking=True)

    def length(self, p: Sequence[Tensor]) -> Tensor:
        first, *rest = p
        if first.requires_grad:  # at the origin the gradient of a norm is 0, that of `hypot` is none
            norm: Tensor = torch.linalg.vector_norm(torch.stack([first, *rest]), dim=0)
            return norm
        return reduce(torch.hypot, rest, first)

    def add_product(self, total: Tensor, x: Tensor, factor: Tensor | float) -> Tensor:
        if isinstance(factor, Tensor):
            return torch.addcmul(total, x, factor)
        return torch.add(total, x, alpha=factor)

    def dense(self, x: Tensor, w: Tensor, b: Tensor) -> Tensor:
        return torch.addmm(b.unsqueeze(1), w, x) if x.dim() == 2 else torch.baddbmm(b.unsqueeze(2), w, x)

    def perceptron(self, x: Tensor, layers: Layers) -> Array:
        if x.dim() == 2 and not torch.is_grad_enabled():
            x = x.T.contiguous()  # rows of points suit layers this narrow
            for layer in layers[:-1]:
                x = linear(x, *layer).relu_()
            return linear(x, *layers[-1]).T
        for layer in layers[:-1]:
            x = self.dense(x, *layer).relu()
        return self.dense(x, *layers[-1])

    def smooth(self, x: Tensor, layers: Smooth) -> Tensor:
        for layer in layers[:-1]:
            x = silu(self.dense(x, *layer), inplace=not torch.is_grad_enabled())
        return self.dense(x, *layers[-1])


TORCH = Torch()
