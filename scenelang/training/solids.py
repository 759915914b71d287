"""Training of the solids' network: leaves by their distances and gradients, the cell by single steps.

The decoders of all leaves are fitted together through the codes by Adam, then each by the Gauss-Newton method
(Levenberg 1944, Marquardt 1963) in float64, which is what brings distances to 1e-4; what that found goes back
into the weights by the smallest change of them that the codes turn into it. The cell learns the fold from
random pairs of distances, close to equal at all scales so that gates become steep. Everything is drawn anew
at every step, and the exact reference defines what is right.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from torch import Tensor
from torch.func import grad_and_value, jacrev, vmap

from scenelang.files import write_whole
from scenelang.reference.field import TORUS, combine, leaf_distance
from scenelang.renderers.solid.network import BLEND, RADIUS, Wanted
from scenelang.renderers.solid.parameters import Solids
from scenelang.training.checkpoint import load_tensors, save_tensors
from scenelang.training.config import SolidsConfig
from scenelang.training.loop import Report, revision
from scenelang.words import TOKENS

LEAVES = ("sphere", "torus")
MATERIALS = {"diffuse": (1.0, 1.0, 1.0, 0.0), "volumetric": (1.0, 1.0, 1.0, 1.0)}  # albedo and medium
BEGINNINGS = 6  # of the cell
ROUND = 20  # Gauss-Newton steps between checkpoints


@dataclass(frozen=True, slots=True)
class Points:
    """Points on and around a leaf.

    Args:
        q: (P, 3).
        distance: exact (P,).
        gradient: of it (P, 3).
        weight: of the errors of distance and gradient (P, 4).
    """

    q: Tensor
    distance: Tensor
    gradient: Tensor
    weight: Tensor


def leaf_points(leaf: str, count: int, g: torch.Generator, kind: torch.dtype) -> Points:
    """Half of the points near the surface at all scales, a quarter in its ball, a quarter farther out."""
    if leaf == "sphere":
        normal = _directions(count // 2, g)
        near = normal
    else:
        u, v = math.tau * torch.rand((2, count // 2), generator=g)
        ring = TORUS[0] + TORUS[1] * v.cos()
        near = torch.stack([ring * u.cos(), TORUS[1] * v.sin(), ring * u.sin()], 1)
    near = near + torch.randn(near.shape, generator=g) * 10 ** (
        2.5 * torch.rand((len(near), 1), generator=g) - 3.5
    )
    far = _directions(count - len(near), g) * torch.rand((count - len(near), 1), generator=g) ** (1 / 3)
    far[::2] *= 1.3
    far[1::2] *= RADIUS
    q = torch.cat([near, far]).to(kind).requires_grad_()
    with torch.enable_grad():
        distance = leaf_distance(leaf, q.T)
        (gradient,) = torch.autograd.grad(distance.sum(), q)
    distance = distance.detach()
    by_value = torch.where(distance < -0.15, 0.2, 1.0) / (distance.abs() + 0.02)
    by_gradient = 0.003 / (distance.square() + 0.01)
    bent = gradient.isnan().any(1) | (
        distance < -0.9 * TORUS[1]
    )  # next to a centre, where there is no gradient
    by_gradient = torch.where(bent, 0.0, by_gradient)
    weight = torch.cat([by_value[:, None], by_gradient[:, None].expand(-1, 3)], 1)
    return Points(q.detach(), distance, gradient.nan_to_num(), weight)


def _directions(count: int, g: torch.Generator) -> Tensor:
    return torch.nn.functional.normalize(torch.randn((count, 3), generator=g))


def fit_decoders(
    network: Solids, steps: int, g: torch.Generator, rate: float = 0.01, points: int = 512
) -> float:
    """Fit the decoders of all leaves and their codes together; returns the last loss."""
    mine = [network.codes, *network.decoder_w, *network.decoder_b]
    optimiser = torch.optim.Adam(mine, lr=rate, betas=(0.9, 0.99), fused=True)
    for step in range(steps):
        optimiser.param_groups[0]["lr"] = rate * _schedule(step, steps)
        losses = []
        for leaf, code in zip(LEAVES, network.codes, strict=True):
            data = leaf_points(leaf, points, g, torch.float32)
            q = data.q.T.requires_grad_()
            x = q
            *hidden, last = network.decoder(code)
            for w, b in hidden:
                x = torch.nn.functional.silu(w @ x + b[:, None])
            value = (last[0] @ x + last[1][:, None])[0]
            (slope,) = torch.autograd.grad(value.sum(), q, create_graph=True)
            wrong = torch.cat([(value - data.distance)[:, None], slope.T - data.gradient], 1)
            losses.append((wrong * data.weight).square().sum(1).mean())
        loss = torch.stack(losses).sum()
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
    return loss.item()


def polish_decoders(network: Solids, steps: int, g: torch.Generator, points: int = 4000) -> dict[str, float]:
    """Fit the decoder of each leaf further by Gauss-Newton steps; returns the last mean squared errors."""
    found, wanted = {}, []
    with torch.no_grad():
        for leaf, code in zip(LEAVES, network.codes, strict=True):
            layers = network.decoder(code)
            shapes = [part.shape for layer in layers for part in layer]
            weights = torch.cat([part.double().reshape(-1) for layer in layers for part in layer])
            weights, found[leaf] = _gauss_newton(leaf, weights, shapes, steps, points, g)
            wanted.append(weights)
        one = torch.cat([network.codes, torch.ones(len(LEAVES), 1)], 1).double()
        inverse = torch.linalg.pinv(one)  # (C + 1, leaves)
        start = 0
        for w, b in zip(network.decoder_w, network.decoder_b, strict=True):
            for part, turned in ((w, True), (b, False)):
                size = part[0].numel()
                goal = torch.stack([v[start : start + size] for v in wanted])
                if turned:  # decoders hold (out, in), parameters (in, out)
                    goal = goal.view(-1, part.shape[2], part.shape[1]).mT.reshape(len(goal), -1)
                start += size
                old = part.double().reshape(len(part), -1)
                part.copy_((old + inverse @ (goal - one @ old)).view(part.shape))
    return found


def _gauss_newton(
    leaf: str, weights: Tensor, shapes: list[torch.Size], steps: int, points: int, g: torch.Generator
) -> tuple[Tensor, float]:
    sizes = [shape.numel() for shape in shapes]

    def distance(q: Tensor, weights: Tensor) -> Tensor:
        w1, b1, w2, b2, w3, b3 = (p.view(s) for p, s in zip(torch.split(weights, sizes), shapes, strict=True))
        silu = torch.nn.functional.silu
        return (w3 @ silu(w2 @ silu(w1 @ q + b1) + b2) + b3)[0]

    def answer(weights: Tensor, q: Tensor) -> Tensor:  # (4,)
        gradient, value = grad_and_value(distance)(q, weights)
        return torch.cat([value[None], gradient])

    answers, slopes = vmap(answer, (None, 0)), vmap(jacrev(answer), (None, 0), chunk_size=1000)

    def wrong(weights: Tensor, data: Points) -> Tensor:  # (P, 4)
        exact = torch.cat([data.distance[:, None], data.gradient], 1)
        return (answers(weights, data.q) - exact) * data.weight

    damping, best = 1e-2, math.inf
    for step in range(steps):
        # the last steps see more points, so that none of them pulls
        data = leaf_points(leaf, points * (3 if step > 0.8 * steps else 1), g, torch.float64)
        error = wrong(weights, data).reshape(-1)
        j = (slopes(weights, data.q) * data.weight[..., None]).reshape(len(error), -1)
        square, pull, best = j.T @ j, j.T @ error, error.square().mean().item()
        for _ in range(6):
            scaled = square + damping * torch.diag(square.diagonal() + 1e-6 * square.diagonal().max())
            tried = weights - torch.linalg.solve(scaled, pull)
            if wrong(tried, data).square().mean() < best:
                weights, damping = tried, max(damping / 3, 1e-9)
                break
            damping *= 4
    return weights, best


def fit_cell(network: Solids, steps: int, g: torch.Generator) -> float:
    """Fit the cell, and what materials look like, by single steps of the fold; returns the last loss.

    Some beginnings end with a gate shut or with two lines that do the same. So each token goes on from the
    best of several short fits.
    """
    cell = [network.cell_lines, network.cell_gain, network.cell_bias, network.candidate, network.bump]
    best, kept = torch.full((len(TOKENS),), math.inf), [part.detach().clone() for part in cell]
    for _ in range(BEGINNINGS):
        with torch.no_grad():
            for part, spread, centre in zip(
                cell, (0.3, 0.0, 0.0, 0.3, 0.0), (0.0, 0.0, 0.5, 0.0, 0.0), strict=True
            ):
                part.copy_(centre + spread * torch.randn(part.shape, generator=g))
        losses = _fit_cell(network, cell, max(1, steps // 8), g)
        for token in torch.nonzero(losses < best)[:, 0].tolist():
            best[token] = losses[token]
            for part, good in zip(cell, kept, strict=True):
                good[token] = part[token].detach()
    with torch.no_grad():
        for part, good in zip(cell, kept, strict=True):
            part.copy_(good)
    return float(_fit_cell(network, [*cell, network.albedo, network.material_codes], steps, g).sum())


def _fit_cell(
    network: Solids, parts: list[torch.nn.Parameter], steps: int, g: torch.Generator, points: int = 512
) -> Tensor:
    """Fit some of the parameters; returns the mean loss of each token over the last tenth of the steps."""
    optimiser = torch.optim.Adam(parts, lr=0.01, betas=(0.9, 0.99), fused=True)
    known, told = torch.tensor(list(MATERIALS.values())), torch.zeros(len(TOKENS))
    last = max(1, steps // 10)
    for step in range(steps):
        optimiser.param_groups[0]["lr"] = 0.01 * _schedule(step, steps)
        past, own = torch.randn((2, points), generator=g) * 10 ** (
            3 * torch.rand((2, points), generator=g) - 2.5
        )
        close = torch.randn(points, generator=g) * 10 ** (5 * torch.rand(points, generator=g) - 5.5)
        which = torch.randint(0, 4, (points,), generator=g)
        own = torch.where(which == 0, past + close, torch.where(which == 1, close, own))
        own = torch.where(which == 2, close - past, own)
        memory = torch.cat([past[None], torch.zeros(4, points)])
        blank, losses = torch.zeros(points, 1), []
        for token in TOKENS.values():
            cell = network.cell(token, BLEND)[Wanted.ALL]
            found, _ = network.join(own, memory, torch.ones(4, 1), cell, Wanted.ALL)
            depth, paint = combine(past, blank, own, blank + 1, token)
            kind = paint.round()  # of a blend the nearer one's
            losses.append(
                ((found[0] - depth).abs() / (depth.abs() + 0.02)).mean()
                + (found[1] - paint[:, 0]).abs().mean()
                + (found[4] - kind[:, 0]).abs().mean()
            )
        looks = (network.look(network.material_codes) - known).square().sum()
        optimiser.zero_grad()
        (torch.stack(losses).sum() + looks).backward()
        optimiser.step()
        if step >= steps - last:
            told += torch.stack(losses).detach() / last
    return told


def _schedule(step: int, steps: int) -> float:
    """Warm-up, then half a cosine down to one hundredth."""
    return min(1.0, (step + 1) / 200) * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * step / steps)))


def train_solids(
    config: SolidsConfig,
    folder: Path,
    *,
    budget_s: float = math.inf,
    report: Report | None = None,
) -> bool:
    """Train, or go on from the checkpoint in ``folder``, which is saved after each part of the training.

    Args:
        config: what to train; must equal the checkpoint's.
        folder: gets ``checkpoint.safetensors`` and, at the end, ``weights.safetensors``.
        budget_s: stop at the first checkpoint after so many seconds of this call.
        report: called with steps, all steps, seconds spent and losses, of which there are none at the start.

    Returns:
        True when all is done.

    Raises:
        ValueError: the checkpoint belongs to another configuration.
    """
    folder.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(config.seed)
    network = Solids(config.network, len(LEAVES), len(MATERIALS))
    parts: list[tuple[int, Callable[[int, torch.Generator], dict[str, float]]]] = [
        (config.cell, lambda steps, g: {"cell": fit_cell(network, steps, g)}),
        (config.leaves, lambda steps, g: {"leaves": fit_decoders(network, steps, g)}),
        *[(ROUND, lambda steps, g: polish_decoders(network, steps, g))] * (config.polish // ROUND),
    ]
    done, spent_s = 0, 0.0
    checkpoint = folder / "checkpoint.safetensors"
    if checkpoint.exists():
        tensors, header = load_tensors(checkpoint)
        if header["config"] != asdict(config):
            raise ValueError(f"{checkpoint} was trained with another configuration")
        network.load_state_dict(tensors)
        done, spent_s = header["parts"], header["seconds"]
    total, started = sum(steps for steps, _ in parts), time.perf_counter()
    if report:
        report(sum(steps for steps, _ in parts[:done]), total, spent_s, {})
    while done < len(parts):
        if time.perf_counter() - started > budget_s:
            return False
        steps, part = parts[done]
        losses = part(steps, torch.Generator().manual_seed(1000 * config.seed + done))
        done += 1
        seconds = spent_s + time.perf_counter() - started
        told = {
            "seconds": round(seconds, 1),
            "revision": revision(),
            "torch": torch.__version__.split("+")[0],
        }
        header = {"format": 1, "model": config.model, "config": asdict(config), "parts": done, **told}
        save_tensors(checkpoint, dict(network.state_dict()), header)
        if report:
            report(sum(steps for steps, _ in parts[:done]), total, seconds, losses)
    write_whole(folder / "weights.safetensors", checkpoint.read_bytes())
    return True
