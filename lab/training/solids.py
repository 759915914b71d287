"""Training of the solids' network: leaves by their distances and gradients, the cell by single steps.

The decoders of all leaves are fitted together through the codes by Adam, then each by the Gauss-Newton method
(Levenberg 1944, Marquardt 1963) in float64, which brings distances to 1e-4 and goes back into the weights by
their smallest change. The cell learns the fold from random pairs of distances, close to equal at all scales.
Answers for whole segments come last and change none of the others.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import torch
from torch import Tensor
from torch.func import grad_and_value, jacrev, vmap

from lab.about import revision
from lab.training.checkpoint import check_config, load_tensors, save_tensors
from lab.training.config import SolidsConfig
from lab.training.leaves import LEAVES, Points, half_rays, leaf_points
from lab.training.loop import Report, schedule
from scenelang.assets.files import write_whole
from scenelang.drawing.exact.field import combine
from scenelang.drawing.neural.load import Solids, load_model
from scenelang.drawing.solid.network import BLEND, Wanted
from scenelang.language.words import TOKENS

MATERIALS = {"diffuse": (1.0, 1.0, 1.0, 0.0), "volumetric": (1.0, 1.0, 1.0, 1.0)}  # albedo and medium
BEGINNINGS = 6  # of the cell
ROUND = 20  # Gauss-Newton steps between checkpoints


def fit_decoders(
    network: Solids, steps: int, g: torch.Generator, rate: float = 0.01, points: int = 512
) -> float:
    """Fit the decoders of all leaves and their codes together; returns the last loss."""
    mine = [network.codes, *network.decoder_w, *network.decoder_b]
    optimiser = torch.optim.Adam(mine, lr=rate, betas=(0.9, 0.99), fused=True)
    for step in range(steps):
        optimiser.param_groups[0]["lr"] = rate * schedule(step, steps)
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
    result, wanted = {}, []
    with torch.no_grad():
        for leaf, code in zip(LEAVES, network.codes, strict=True):
            layers = network.decoder(code)
            shapes = [part.shape for layer in layers for part in layer]
            weights = torch.cat([part.double().reshape(-1) for layer in layers for part in layer])
            weights, result[leaf] = _gauss_newton(leaf, weights, shapes, steps, points, g)
            wanted.append(weights)
        start = 0
        for w, b in zip(network.decoder_w, network.decoder_b, strict=True):
            for part, turned in ((w, True), (b, False)):
                size = part[0].numel()
                goal = torch.stack([v[start : start + size] for v in wanted])
                if turned:  # decoders hold (out, in), parameters (in, out)
                    goal = goal.view(-1, part.shape[2], part.shape[1]).mT.reshape(len(goal), -1)
                start += size
                _write(network, part, goal)
    return result


def _write(network: Solids, part: Tensor, goal: Tensor) -> None:
    """Change weights (C + 1, …) as little as makes those of the leaves (leaves, …) out of their codes."""
    one = torch.cat([network.codes, torch.ones(len(LEAVES), 1)], 1).double()
    old = part.double().reshape(len(part), -1)
    goal = goal.double().reshape(len(goal), -1)
    part.copy_((old + torch.linalg.pinv(one) @ (goal - one @ old)).view(part.shape))


def fit_segments(network: Solids, steps: int, g: torch.Generator, points: int = 2048) -> float:
    """Fit the answers for whole segments of all leaves; returns the mean squared error of the last tenth."""
    chunks = [[half_rays(leaf, 20_000, g) for leaf in LEAVES] for _ in range(min(10, 1 + steps // 100))]
    told = torch.cat([torch.stack([x.T for x, _ in chunk]) for chunk in chunks], 1)  # (leaves, M, 5)
    length = torch.cat([torch.stack([y for _, y in chunk]) for chunk in chunks], 1)
    parts = _segments(network)
    sizes = [(len(LEAVES), *part.shape[1:]) for part in parts]
    fitted = [
        (torch.randn(size, generator=g) * (size[1] ** -0.5 if len(size) > 2 else 0.3)).requires_grad_()
        for size in sizes
    ]
    optimiser = torch.optim.Adam(fitted, lr=0.01, betas=(0.9, 0.99), fused=True)
    last, error = max(1, steps // 10), 0.0
    for step in range(steps):
        optimiser.param_groups[0]["lr"] = 0.01 * schedule(step, steps)
        some = torch.randint(0, told.shape[1], (points,), generator=g)
        x = told[:, some]
        for i, (w, b) in enumerate(zip(fitted[:3], fitted[3:], strict=True)):
            x = torch.baddbmm(b[:, None], x, w)
            if i < 2:
                x = torch.nn.functional.silu(x)
        loss = (x[..., 0] - length[:, some]).square().mean(1).sum()
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        if step >= steps - last:
            error += loss.item() / len(LEAVES) / last
    with torch.no_grad():
        for part, goal in zip(parts, fitted, strict=True):
            _write(network, part, goal)
    return error


def take_over(network: Solids, name: str) -> None:
    """Copy the cell, the looks and the answers for whole segments of a shipped model, whatever its width."""
    other = load_model(name).network
    assert isinstance(other, Solids)
    with torch.no_grad():
        for part in ("material_codes", "albedo", "cell_lines", "cell_gain", "cell_bias", "candidate", "bump"):
            getattr(network, part).copy_(getattr(other, part))
        one = torch.cat([other.codes, torch.ones(len(LEAVES), 1)], 1)
        for mine, theirs in zip(_segments(network), _segments(other), strict=True):
            _write(network, mine, one @ theirs.reshape(len(theirs), -1))


def _segments(network: Solids) -> list[torch.nn.Parameter]:
    return [*network.segment_w, *network.segment_b]


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

    Some beginnings end with a gate shut, so each token goes on from the best of several short fits.
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
        optimiser.param_groups[0]["lr"] = 0.01 * schedule(step, steps)
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
            result, _ = network.join(own, memory, torch.ones(4, 1), cell, Wanted.ALL)
            depth, paint = combine(past, blank, own, blank + 1, token)
            kind = paint.round()  # of a blend the nearer one's
            losses.append(
                ((result[0] - depth).abs() / (depth.abs() + 0.02)).mean()
                + (result[1] - paint[:, 0]).abs().mean()
                + (result[4] - kind[:, 0]).abs().mean()
            )
        looks = (network.look(network.material_codes) - known).square().sum()
        optimiser.zero_grad()
        (torch.stack(losses).sum() + looks).backward()
        optimiser.step()
        if step >= steps - last:
            told += torch.stack(losses).detach() / last
    return told


def train_solids(
    config: SolidsConfig,
    folder: Path,
    *,
    budget_s: float = math.inf,
    report: Report | None = None,
) -> bool:
    """Train, or go on from the checkpoint in ``folder``; true when done, false when time is over.

    The folder gets ``checkpoint.safetensors`` after each part and, at the end, ``weights.safetensors``.
    ``report`` is called with steps, all steps, seconds spent and losses. ValueError for a checkpoint of
    another configuration.
    """
    folder.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(config.seed)
    network = Solids(config.network, len(LEAVES), len(MATERIALS))
    parts: list[tuple[int, Callable[[int, torch.Generator], dict[str, float]]]] = [
        (config.cell, lambda steps, g: {"cell": fit_cell(network, steps, g)}),
        (config.leaves, lambda steps, g: {"leaves": fit_decoders(network, steps, g)}),
        *[(ROUND, lambda steps, g: polish_decoders(network, steps, g))] * (config.polish // ROUND),
        (config.segments, lambda steps, g: {"segments": fit_segments(network, steps, g)}),
    ]
    if config.like is not None:
        parts = parts[1:-1]
    done, spent_s = 0, 0.0
    checkpoint = folder / "checkpoint.safetensors"
    if checkpoint.exists():
        tensors, header = load_tensors(checkpoint)
        check_config(checkpoint, header["config"], asdict(config))
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
        if config.like is not None:
            take_over(network, config.like)
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
