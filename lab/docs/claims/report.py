"""Figures in docs/report.md."""

from lab.docs import paper
from lab.docs.claims.proof import BROKEN, PIXELS, SCENES, SETS
from lab.docs.claims.results import FIELDS, PAPERS, STABLE, probe
from lab.docs.figures import Figure, at, numbers, read, told
from scenelang.renderers.slopes import STEEP

SHADOWS = "solids3d/shadows"
FAR = min(at(name, "psnr/mean") for name in ("twelve", "crowd", "shuffled", "tiny", "strong", "large"))
MINUTES = [Figure(told(model)["seconds"] / 60) for model in ("shapes2d", "solids3d")]
PLANE, SPACE = numbers("models/shapes2d/weights"), numbers("models/solids3d/weights")
NEAR = [at(name, "psnr/mean") for name in ("shapes2d", "solids3d-256/solids3d")]
MAPS = [probe("affine", 64, key) for key in ("psnr/mean", "db")]
DARK = [at(SHADOWS, key) for key in ("without/mean", "psnr/mean", "psnr/interval", "scenes")]
STEPS, BATCH, BACKWARD = 940_000, 16, 3  # of the paper's training; a step's time by a frame's
YEARS = at("models/shapes2d/frontier", "streaming_ms") * (1e-3 * BACKWARD * BATCH * STEPS / 3600 / 24 / 365)
CLAIMS = [
    f"A network of {PLANE:,.0f} numbers draws the paper's deformed shapes at {NEAR[0]:.2f} dB (capped",
    f"one of {SPACE:,.0f} lit and shadowed solids and media at {NEAR[1]:.2f} dB, after {MINUTES[0]:.0f} and",
    f"and {MINUTES[1]:.0f} minutes of training on one processor core, where the paper reports "
    f"{Figure(paper.SHAPES.psnr):.2f} and {Figure(paper.SOLIDS.psnr):.2f} dB",
    f"on {at('passes', 'scenes'):,.0f} random scenes coverage differs at "
    f"{Figure(sum(p['differing'] for p in read('passes')['passes'].values()))} of "
    f"{at('passes', 'samples'):,.0f} samples",
    f"pictures stay at {MAPS[0]:.1f} dB ({MAPS[1]:.0f} dB by mean squared error)",
    f"fix the slope at {Figure(STEEP):.2f} and",
    f"no pixel by more than {at(STABLE, 'invariants/arithmetic/skipping'):.4f}",
    f"Over {SCENES} scenes of {Figure(len(SETS))} sets {BROKEN} of {PIXELS:.0f} million pixels break",
    f"keep a mean of at least {FAR:.1f} dB",
    f"without the shadow scores {DARK[0]:.1f} dB, ours is at {DARK[1]:.2f} ± {DARK[2]:.2f} dB "
    f"over {DARK[3]} scenes",
    f"but for samples, and the network takes {FIELDS[0]} times as long.",
    f"at its full size takes {PAPERS} times as long as the network",
    f"the network takes {FIELDS[1]} times as long as the exact field",
    f"*Figure 5. The worst of {at('chains', 'scenes')} chains",
    f"![The worst of {at('chains', 'scenes')} chains",
    f"that is {YEARS:.1f} years of one core",
]
GIVEN = {
    "under 2 % of the canvas": "how scenes are drawn",
    "PSNR counts at most 50 dB an image": "the cap",
    "means of 1,000 scenes": "the paper's",
    "32 numbers in the plane": "the layout of vectors",
    "frames have 12 numbers": "the layout of vectors",
    "At three times the time of a frame": "what a step is taken to cost",
    "sections 6.1 to 6.5": "of this page",
    "56 numbers": "the cell's size, counted",
    "three times the size": "a quantity that is varied",
    "All of them learn 16 scenes": "on what they were trained",
    "thinner than 0.01": "the language's definition",
    "falls under 40 dB": "the limit of warnings",
    "940,000 steps of up to 32 pictures": "the paper's training",
    "each of 16 pictures": "the paper's training",
}
