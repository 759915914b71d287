"""Losses of the network: images of each object alone and of every prefix of the stream.

An image here has colour, coverage and distance, as renderers write them side by side.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits as cross_entropy

from lab.training.network import Trainee
from lab.training.scenes import Batch, LeafBatch

SHARP = 0.02  # distances are asked for relative to themselves plus this
FAR_LEAF, FAR_WORLD = 2.0, 0.4  # leaf and world units: farther outside, a distance makes no difference


def image_loss(network: Trainee, batch: Batch, *, forced: bool = False) -> tuple[Tensor, dict[str, float]]:
    """Loss of a batch of streams at points, and its parts as numbers by name.

    Coverage by cross-entropy and distance by relative absolute error, of each object alone and of each
    prefix; colour where the prefix covers the point. If ``forced``, every step starts from the exact state
    before it.
    """
    material = network.material_codes[torch.zeros_like(batch.leaf).flatten()]
    colours = batch.rgb * network.object_albedo(material).view(*batch.leaf.shape, 3)
    given = (batch.depth, batch.colour) if forced else None
    trace = network.trace(batch.q, batch.scale, network.codes[batch.leaf], colours, batch.tokens, given)
    n = batch.leaf.shape[1]
    used = (torch.arange(n, device=batch.leaf.device) < batch.count[:, None]).float()[..., None]  # (B, N, 1)
    entries = used.sum() * batch.distance.shape[2]
    inside, covered = (batch.distance < 0).float(), (batch.depth < 0).float()
    alone = cross_entropy(trace.alone, 1 - inside, reduction="none")
    cover = cross_entropy(trace.margin, 1 - covered, reduction="none")
    scale = batch.scale[..., None]  # world per leaf unit
    shape = (trace.distance - batch.distance).abs() / (batch.distance.abs() + SHARP * scale)
    depth = (trace.depth - batch.depth).abs() / (batch.depth.abs() + SHARP)
    gap = trace.colour - batch.colour
    terms = {
        "alone": alone * used,
        "cover": cover * used,
        "shape": shape * used * (batch.distance < FAR_LEAF * scale),
        "depth": depth * used * (batch.depth < FAR_WORLD),
        "colour": (12 * gap.square() + 3 * gap.abs()).sum(-1) * covered * used,
    }
    parts = {name: term.sum() / entries for name, term in terms.items()}
    return _summed(parts)


def leaf_loss(network: Trainee, batch: LeafBatch) -> tuple[Tensor, dict[str, float]]:
    """Loss of the leaves alone, in their own frames: coverage and distance, as in `image_loss`."""
    radius = torch.linalg.vector_norm(batch.q, dim=1, keepdim=True)
    features = network.decode(batch.q, radius, 1.0, network.decoder_weights(network.codes))[:, 0]
    inside = (batch.distance < 0).float()
    terms = {
        "alone": cross_entropy(features * network.edge_slope.exp(), 1 - inside),
        "shape": ((features - batch.distance).abs() / (batch.distance.abs() + SHARP)).mean(),
    }
    return _summed(terms)


def _summed(parts: dict[str, Tensor]) -> tuple[Tensor, dict[str, float]]:
    return torch.stack(list(parts.values())).sum(), {k: v.item() for k, v in parts.items()}
