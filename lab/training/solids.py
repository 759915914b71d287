"""Training of the solids' network: leaves by their distances, the cell by single steps.

Each leaf's norm units are fitted by themselves (`norms.py`); the weights become, of all that do, the smallest
that make them out of the leaves' codes. The cell learns the fold from random pairs of distances, close to
equal at all scales.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import torch
from torch import Tensor

from lab.about import revision
from lab.training.checkpoint import check_config, load_tensors, save_tensors
from lab.training.config import SolidsConfig
from lab.training.loop import Report, schedule
from lab.training.norms import fitted
from scenelang.assets.files import write_whole
from scenelang.drawing.exact.field import combine
from scenelang.drawing.neural.load import Solids
from scenelang.drawing.solid.network import BLEND, Wanted
from scenelang.language import words
from scenelang.language.words import TOKENS

LEAVES = (*words.LEAVES[3],)
MATERIALS = {"diffuse": (1.0, 1.0, 1.0, 0.0), "volumetric": (1.0, 1.0, 1.0, 1.0)}  # albedo and medium
BEGINNINGS = 6  # of the cell
SEEDS = (0, 1)  # of the parts: cell and leaves
CODES = {
    "sphere": (0.55890197, 0.14959463, 0.10143978, 0.6335122),
    "torus": (-0.5625774, -0.033415865, -1.4781343, 0.38490954),
    "box": (1.0, 0.0, 0.0, -1.0),
    "cylinder": (0.0, 1.0, 0.0, -1.0),
    "cone": (0.0, 0.0, 1.0, -1.0),
    "capsule": (-1.0, 0.0, 0.0, -1.0),
    "octahedron": (0.0, -1.0, 0.0, 1.0),
}
"""Of the leaves; the first two are those of weights before, so that vectors of Programs stay as they are."""


def fit_leaves(network: Solids, seed: int, g: torch.Generator) -> dict[str, float]:
    """Fit the decoder of each leaf, and the weights to these; returns errors, leaf units."""
    lines, radii, errors = [], [], {}
    for leaf in LEAVES:
        start, errors[leaf] = fitted(leaf, seed)
        own, radius = start.placed(network.config.units)
        lines.append(torch.from_numpy(own))
        radii.append(radius)
    with torch.no_grad():
        network.codes.copy_(torch.tensor([CODES[leaf] for leaf in LEAVES]))
        network.lift_w.copy_(torch.randn(network.lift_w.shape, generator=g))
        network.lift_b.copy_(torch.rand(network.lift_b.shape, generator=g))
        for part, goal in ((network.lines, torch.stack(lines)), (network.radius, torch.tensor(radii))):
            part.zero_()
            _write(network, part, goal)
    return errors


def _write(network: Solids, part: Tensor, goal: Tensor) -> None:
    """Change weights (C', …) as little as makes those of the first leaves (leaves, …) out of their codes."""
    one = torch.stack([network.lifted(code) for code in network.codes[: len(goal)]]).double()
    old = part.double().reshape(len(part), -1)
    goal = goal.double().reshape(len(goal), -1)
    part.copy_((old + torch.linalg.pinv(one) @ (goal - one @ old)).view(part.shape))


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
        (len(LEAVES), lambda _, g: fit_leaves(network, config.seed, g)),
    ]
    reached: dict[str, float] = {}  # the errors and losses of parts
    done, spent_s = 0, 0.0
    checkpoint = folder / "checkpoint.safetensors"
    if checkpoint.exists():
        tensors, header = load_tensors(checkpoint)
        check_config(checkpoint, header["config"], asdict(config))
        network.load_state_dict(tensors)
        done, spent_s, reached = header["parts"], header["seconds"], header["reached"]
    total, started = sum(steps for steps, _ in parts), time.perf_counter()
    if report:
        report(sum(steps for steps, _ in parts[:done]), total, spent_s, {})
    while done < len(parts):
        if time.perf_counter() - started > budget_s:
            return False
        steps, part = parts[done]
        losses = part(steps, torch.Generator().manual_seed(1000 * config.seed + SEEDS[done]))
        done, reached = done + 1, {**reached, **losses}
        seconds = spent_s + time.perf_counter() - started
        told = {
            "seconds": round(seconds, 1),
            "reached": reached,
            "revision": revision(),
            "torch": torch.__version__.split("+")[0],
        }
        header = {"format": 1, "model": config.model, "config": asdict(config), "parts": done, **told}
        save_tensors(checkpoint, dict(network.state_dict()), header)
        if report:
            report(sum(steps for steps, _ in parts[:done]), total, seconds, losses)
    write_whole(folder / "weights.safetensors", checkpoint.read_bytes())
    return True
