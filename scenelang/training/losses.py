"""What is asked of the network: the images of each object alone and of every prefix of the stream."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from scenelang.renderers.framed import Framed
from scenelang.training.scenes import Batch

SLOPE = 0.5  # weight of the distance prior


def image_loss(network: Framed, batch: Batch) -> tuple[Tensor, dict[str, float]]:
    """Loss of a batch of streams at points.

    Coverage of each object alone and of each prefix by cross-entropy, colour where the prefix covers the
    point by squared and absolute error. A prior asks the first feature to grow like
    a distance (Gropp et al. 2020, eq. 2). Padding counts for nothing.

    Returns:
        The loss, and its parts as numbers by name.
    """
    b, n = batch.leaf.shape
    material = network.material_codes[torch.zeros_like(batch.leaf).flatten()]
    colours = batch.rgb * network.object_albedo(material).view(b, n, 3)
    trace = network.trace(batch.q, batch.scale, network.codes[batch.leaf], colours, batch.tokens)
    used = (torch.arange(n, device=batch.leaf.device) < batch.count[:, None]).float()[..., None]  # (B, N, 1)
    entries = used.sum() * batch.q.shape[2]
    alone = binary_cross_entropy_with_logits(trace.alone, 1 - batch.inside, reduction="none")
    cover = binary_cross_entropy_with_logits(trace.margin, 1 - batch.covered, reduction="none")
    seen = batch.covered * used
    gap = trace.colour - batch.colour
    parts = {
        "slope": SLOPE * (trace.slope - 1).square().mean(),
        "alone": (alone * used).sum() / entries,
        "cover": (cover * used).sum() / entries,
        "colour": ((4 * gap.square() + gap.abs()).sum(-1) * seen).sum() / entries,
    }
    return torch.stack(list(parts.values())).sum(), {k: v.item() for k, v in parts.items()}
