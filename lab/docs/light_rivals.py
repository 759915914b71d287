"""Pictures under a sky beside path tracers, from docs/results/light/rivals.json."""

from __future__ import annotations

from typing import Any

import numpy as np

from lab.charts import FAINT, figure_png, pyplot

COLOURS = {"ours": "#1f77b4", "Mitsuba": "#7b5ea7", "same field": "#c8452f"}


def chart(scenes: list[dict[str, Any]]) -> bytes:
    """PSNR over processor seconds, a panel for each family; means over its scenes."""
    plt = pyplot()
    families = list(dict.fromkeys(scene["family"] for scene in scenes))
    figure, axes = plt.subplots(1, len(families), figsize=(9.5, 3.4), sharey=True, squeeze=False)
    for axis, family in zip(axes[0], families, strict=True):
        own = [scene["ways"] for scene in scenes if scene["family"] == family]
        for name in dict.fromkeys(key.rpartition(" ")[0] for key in own[0]):
            plain = name.removesuffix(" denoised")
            line, colour = ("-", "--")[plain != name], COLOURS[plain]
            keys = [key for key in own[0] if key.rpartition(" ")[0] == name]
            x = [np.exp(np.mean([np.log(ways[key]["cpu_s"]) for ways in own])) for key in keys]
            y = [np.mean([ways[key]["psnr"] for ways in own]) for key in keys]
            axis.plot(x, y, line, color=colour, marker="o", markersize=3, linewidth=1.4, label=name)
        axis.set_xscale("log")
        axis.set_title(family, fontsize=9)
        axis.set_xlabel("processor seconds", fontsize=8)
        axis.tick_params(labelsize=7)
        axis.grid(color=FAINT, linewidth=0.5)
    axes[0, 0].set_ylabel("PSNR to its own converged picture, dB", fontsize=8)
    axes[0, -1].legend(fontsize=6, frameon=False, loc="lower right")
    figure.tight_layout()
    return figure_png(figure, dpi=120)
