"""Figures in docs/measurements.md."""

from lab.docs import paper
from lab.docs.figures import Figure, Phrase, at, kilobytes, numbers, read
from lab.docs.make_results import SOLIDS, WHAT

PLANE = list(WHAT)
SPACE = [f"solids3d/{name}" for name in SOLIDS]
BARE = [name for name in SPACE if not name.endswith("meshes3d")]
STABLE = "stability"
SHADOWS = [at("solids3d/shadows", key) for key in ("without/mean", "psnr/mean", "psnr/interval", "scenes")]
PROOF = read("proof")["sets"]
TIMES = {
    mist: [
        Figure(times)
        for scenes in at("element-speed", "ratios").values()
        for name, row in scenes.items()
        for what, times in row.items()
        if (name == "mist") == mist and what != "torus_ms"
    ]
    for mist in (False, True)
}
LOAD = Figure(max(at("element-speed", "load_ms").values()))
SMALL, LARGE = "solids3d/meshes3d", "solids3d-256/meshes3d"
SEARCH = read("fit-search")
OURS, CMA = (SEARCH["ways"][way] for way in ("ours", "cma"))
FEWER = Figure(OURS["median"]["frames"] / CMA["median"]["frames"])
KEY = {what: at("play", f"{what}_ms") for what in ("median", "slowest")}
STEPS, BATCH, BACKWARD = 940_000, 16, 3  # of the paper's training; a step's time by a frame's
YEARS = at("models/shapes2d/frontier", "streaming_ms") * (1e-3 * BACKWARD * BATCH * STEPS / 3600 / 24 / 365)


def least(names: list[str]) -> Figure:
    """Least mean PSNR of sets."""
    return min(at(name, "psnr/mean") for name in names)


def most(names: list[str]) -> Figure:
    """Largest mean FLIP of sets."""
    return max(at(name, "flip/mean") for name in names)


def factor(base: str, slow: str, fast: str) -> Phrase:
    """Ratio of two ways' times, with its interval where that was measured."""
    name = f"models/{base}/frontier"
    for ratio in read(name).get("ratios", ()):
        if (ratio["slow"], ratio["fast"]) == (slow, fast):
            return Phrase(f"{ratio['mean']:.2f} ± {ratio['interval']:.2f}")
    times = [float(at(name, "points/ms/median", name=way)) for way in (slow, fast)]
    return Phrase(f"{times[0] / times[1]:.2f}")


def probe(name: str, value: float, key: str = "psnr/mean", record: str = STABLE) -> Figure:
    """A figure of a probe at a value."""
    return at(record, f"probes/{name}/rows/{key}", value=value)


def of_paper(found: paper.Figures) -> str:
    """PSNR, SSIM and FLIP as the paper has them."""
    return f"{Figure(found.psnr):.2f} dB, SSIM {Figure(found.ssim):.3f}, FLIP {Figure(found.flip):.3f}"


def kept(record: str) -> str:
    """Share and number of drawings that kept a promise."""
    return f"{at(record, 'kept') * 100:.1f} % of {at(record, 'drawings'):,.0f}"


ALIKE = min(at(name, "ssim/mean") for name in [*PLANE, *SPACE])
FIELDS = [factor(base, base, "exact field") for base in ("shapes2d", "solids3d")]
PAPERS = factor("shapes2d", "the paper's streaming, 256²", "shapes2d")
SUMMARY = [
    f"in {numbers('models/shapes2d/weights'):,.0f} numbers for the plane and "
    f"{numbers('models/solids3d/weights'):,.0f} for space",
    f"Over {Figure(len(PLANE))} sets of the plane the mean PSNR is at least {least(PLANE):.1f} dB and the "
    f"mean FLIP at most {most(PLANE):.4f}",
    f"over {Figure(len(SPACE))} sets of space {least(SPACE):.1f} dB "
    f"and {most(SPACE):.4f} (both of meshes; of the others {least(BARE):.1f} dB); SSIM is {ALIKE:.4f} or "
    "more",
    f"the network takes {FIELDS[0]} times as long in the plane and {FIELDS[1]} times in space",
    f"takes {PAPERS} times as long as `shapes2d`",
    f"({probe('deep', 3):.1f} ± {probe('deep', 3, 'psnr/interval'):.1f} dB on average at three",
    f"({probe('blends', 64):.1f} dB for 64 of them), in slivers ({probe('thin', 300):.1f} dB), and in "
    f"space in thin objects ({probe('thickness', 0.003, record='stability-solids3d'):.1f} dB where",
]
EDGES = [probe("canvas", side, "per_edge_ideal") for side in (32, 256, 1024)]
SAMPLED = [probe("canvas", side, "per_edge") for side in (32, 256, 1024)]
STABILITY = [
    f"scenes {probe('affine', 3, 'db'):.0f} dB for three maps, {probe('affine', 64, 'db'):.0f} dB for 64)",
    f"is {EDGES[0]:.4f} at 32², {EDGES[1]:.4f} at 256² and {EDGES[2]:.4f} at 1024²",
    f"it is {SAMPLED[0]:.6f}, {SAMPLED[1]:.4f} and {SAMPLED[2]:.4f}.",
    f"by more than {at(STABLE, 'invariants/arithmetic/skipping'):.4f}",
    f"in the plane {at(STABLE, 'invariants/flicker/mean') * 100:.1f} % of the change that it has, in space "
    f"{at('stability-solids3d', 'invariants/flicker/mean') * 100:.1f} %, and "
    f"{at('stability-solids3d', 'invariants/flicker/worst') * 100:.1f} % in the worst scene",
]
CLAIMS = [
    *SUMMARY,
    *STABILITY,
    f"The paper reports {of_paper(paper.SHAPES)} for deformed",
    f"The paper reports {of_paper(paper.SOLIDS)} for up to three",
    f"material) is {of_paper(paper.TEXTURES)}",
    f"worst 6 of {at('chains', 'scenes')} chains",
    f"without the shadow scores {SHADOWS[0]:.1f} dB, ours is at {SHADOWS[1]:.2f} ± {SHADOWS[2]:.2f} dB "
    f"over {SHADOWS[3]} scenes",
    f"kept it in {kept('frontier-verified')} cases in the plane and in {kept('frontier-verified-solids')} in",
    f"{Figure(sum(row['scenes'] for row in PROOF))} scenes of {Figure(len(PROOF))} sets at 256², "
    f"{Figure(sum(row['pixels'] for row in PROOF) / 1e6):.0f} million pixels: "
    f"**{Figure(sum(row['broken'] for row in PROOF))} pixels are farther from the exact one",
    f"in {Figure(sum(row['proved_again'] < 1 for row in PROOF))} of the sets a pixel is left",
    f"takes {min(TIMES[False]):.1f} to {max(TIMES[False]):.1f} times as long as with a torus in its place; "
    f"of mist {min(TIMES[True]):.1f} to {max(TIMES[True]):.1f} times. Loading one takes {LOAD:.0f} ms",
    f"The three take {kilobytes('std/meshes'):.0f} KB",
    f"at {at(SMALL, 'psnr/mean'):.1f} dB and FLIP {at(SMALL, 'flip/mean'):.4f} on average, the worst of "
    f"{at(SMALL, 'scenes')} at {at(SMALL, 'psnr/worst'):.1f} (128²; {at(LARGE, 'psnr/mean'):.1f} and "
    f"{at(LARGE, 'flip/mean'):.4f} at 256²",
    f"it takes {KEY['median']:.0f} ms from the press of a key to the network's changed picture of "
    f"`chain.nsg` at 256², where {at('play', 'load'):.1f} processes want the {at('play', 'cores')} cores: "
    f"the median of {at('play', 'keys')} keys; the slowest key took {KEY['slowest']:.0f} ms",
    f"{Figure(CMA['found'])} of {Figure(SEARCH['scenes'])} scenes of six params are found, with the sequence "
    f"{Figure(OURS['found'])}, in {FEWER:.1f} of the pictures",
    f"that is {YEARS:.1f} years of one core",
]
GIVEN = {
    "where they are 0.003 thick": "a quantity that is varied",
    "three times the usual size": "a quantity that is varied",
    "capped at 50 dB an image": "the cap",
    "under 0.002 nobody sees it, at 0.01 outlines are hard or a little off, at 0.1 it is": "a rule of thumb",
    "under 2 % of the canvas": "how scenes are drawn",
    "under 0.02 % for the tiny ones": "how scenes are drawn",
    "(Table 1, 32 numbers a material)": "the paper's",
    "The worst 6 scenes of booleans": "what a picture shows",
    "what is thinner than 0.01": "the language's definition",
    "against 64 samples": "what pictures are compared with",
    "of at most 2.5 %": "how a promise is defined",
    "k = ⌈0.975 (n + 1)⌉": "how a promise is defined",
    "at least 95 % of each": "how a promise is defined",
    "a fixed piece of work of 50 ms": "how the yardstick was made",
    "drawn in 256 pixels": "how a time is foretold",
    "is at most 25 dB from it": "how targets are made",
    "within 1 % of every range, or a picture at 45 dB": "what counts as found",
    "noise of 2 to 5 %": "how targets are made",
    "940,000 steps of up to 32 pictures": "the paper's training",
    "at three times the time of a frame": "what a step is taken to cost",
    "each of 16 pictures": "the paper's training",
}
