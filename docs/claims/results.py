"""Figures in docs/results.md."""

import solid_rivals
from figures import Figure, Word, at, numbers, read
from make_results import SOLIDS, WHAT

from scenelang.lab.experiments import paper

PLANE = list(WHAT)
SPACE = [f"solids3d/{name}" for name in SOLIDS]
BARE = [name for name in SPACE if not name.endswith("meshes3d")]
STABLE, CHANGES = "stability", "stability/probes"


def least(names: list[str]) -> Figure:
    """Least mean PSNR of sets."""
    return min(at(name, "psnr/mean") for name in names)


def most(names: list[str]) -> Figure:
    """Largest mean FLIP of sets."""
    return max(at(name, "flip/mean") for name in names)


def factor(base: str, slow: str, fast: str) -> Word:
    """How many times as long one way takes as another, with its interval where that was measured."""
    name = f"models/{base}/frontier"
    for ratio in read(name).get("ratios", ()):
        if (ratio["slow"], ratio["fast"]) == (slow, fast):
            return Word(f"{ratio['mean']:.2f} ± {ratio['interval']:.2f}")
    times = [float(at(name, "points/ms/median", name=way)) for way in (slow, fast)]
    return Word(f"{times[0] / times[1]:.2f}")


def probe(name: str, value: float, key: str = "psnr/mean", record: str = STABLE) -> Figure:
    """A figure of a probe at a value."""
    return at(record, f"probes/{name}/rows/{key}", value=value)


def compared(pair: str, seconds: int) -> Figure:
    """How far the framed renderer stands above a pair of the paper's."""
    runs = {(run["name"], run["group"]): run["psnr"]["mean"] for run in read("experiments/compare")["runs"]}
    return Figure(runs["framed+exact", f"{seconds} s"] - runs[pair, f"{seconds} s"])


def rival(scenes: str, way: str) -> str:
    """How many times our default's time another way takes; of a renderer the fastest that is as near."""
    ways = solid_rivals.ways_of(scenes)
    times = ways[way if way in ways else solid_rivals.as_near(ways, way)]["times"]
    return f"{Figure(times['mean']):.1f} ± {Figure(times['interval']):.1f}"


def codes(what: str, d: int) -> Figure:
    """PSNR by codes of so many numbers, of the first seed."""
    rows = read(f"codes-{what}")["rows"]
    return Figure(
        next(r for r in rows if (r["kind"], r["d"], r.get("seed")) == ("codes", d, 1))["psnr"]["mean"]
    )


def of_paper(found: paper.Figures) -> str:
    """PSNR, SSIM and FLIP as the paper has them."""
    return f"{Figure(found.psnr):.2f} dB, SSIM {Figure(found.ssim):.3f}, FLIP {Figure(found.flip):.3f}"


FIELDS = [factor(base, base, "exact field") for base in ("shapes2d", "solids3d")]
PAPERS = factor("shapes2d", "the paper's streaming, 256²", "shapes2d")
SUMMARY = [
    f"in {numbers('models/shapes2d/weights'):,.0f} numbers for the plane and "
    f"{numbers('models/solids3d/weights'):,.0f} for space",
    f"over {Figure(len(PLANE))} sets of the plane the mean PSNR is at least {least(PLANE):.1f} dB",
    f"the mean FLIP at most {most(PLANE):.4f}; over {Figure(len(SPACE))} sets of space {least(SPACE):.1f} dB "
    f"and {most(SPACE):.4f} (both of meshes; of the others {least(BARE):.1f} dB)",
    f"the network takes {FIELDS[0]} times as long in the plane and {FIELDS[1]} times in space",
    f"takes {PAPERS} times as long as `shapes2d` for drawing four known polygons",
    f"at slivers ({probe('thin', 300):.1f} dB) and in space at thin objects "
    f"({probe('thickness', 0.003, record='stability-solids3d'):.1f} dB where",
]
EDGES = [probe("canvas", side, "per_edge_ideal") for side in (32, 256, 1024)]
SAMPLED = [probe("canvas", side, "per_edge") for side in (32, 256, 1024)]
STABILITY = [
    f"scenes {probe('affine', 3, 'db'):.0f} dB for three maps, {probe('affine', 64, 'db'):.0f} dB for 64)",
    f"one smooth union has {probe('blends', 1, 'db'):.0f} dB and 64 have {probe('blends', 64, 'db'):.0f}:",
    f"is {EDGES[0]:.4f} at 32², {EDGES[1]:.4f} at 256² and {EDGES[2]:.4f} at 1024²",
    f"it is {SAMPLED[0]:.6f}, {SAMPLED[1]:.4f} and {SAMPLED[2]:.4f}. That",
    f"does not have, is {at(STABLE, 'invariants/flicker/mean') * 100:.1f} % of the change that it has",
    f"Tiles and threads change no pixel by more than {at(STABLE, 'invariants/arithmetic/tiles'):.4f}",
    f"cannot reach changes no pixel by more than {at(STABLE, 'invariants/arithmetic/skipping'):.4f}",
    f"Flicker is {at('stability-solids3d', 'invariants/flicker/mean') * 100:.1f} % of the change that",
    f"{at('stability-solids3d', 'invariants/flicker/worst') * 100:.1f} % in the worst scene: what changes",
    f"the scale exceeds {Figure(read('models/shapes2d/manifest')['trained']['blend'][1]):.2f}",
]
PAPER = [
    f"reports {of_paper(paper.SHAPES)} for deformed",
    f"(Table 1, 32 numbers a material) is {of_paper(paper.MATERIAL_SIZES[32])}",
    f"stands {compared('streaming+learned', 40):.1f} dB above the paper's pair (`streaming` with learned "
    f"lifting) after 40 s and {compared('streaming+learned', 120):.1f} dB after 120 s",
]
RIVALS = [
    f"they take {rival('diffuse', 'formulas, adaptive')} times as long on diffuse scenes",
    f"they take {rival('solids3d', 'formulas, adaptive')} times as long there",
    f"setting that is as near as our default takes {rival('diffuse', 'POV-Ray')} times as long, "
    f"Mitsuba's {rival('diffuse', 'Mitsuba')} times",
    f"POV-Ray takes {rival('solids3d', 'POV-Ray')} times as long, and Mitsuba "
    f"{rival('solids3d', 'Mitsuba')}: its",
]
CODES = [
    f"one number ({codes('meshes', 1):.1f} dB) as with 64 ({codes('meshes', 64):.1f})",
    f"need eight ({codes('textures', 8):.1f} dB) and gain nothing by more ({codes('textures', 64):.1f} with",
]
CLAIMS = [*RIVALS, *CODES, f"worst 6 of {at('chains', 'scenes')} chains", *SUMMARY, *STABILITY, *PAPER]
GIVEN = {
    "a mean of 50.00": "the cap",
    "counts for at most 50": "the cap",
    "under 2 % of the canvas": "how scenes are drawn",
    "under 0.02 % for the tiny ones": "how scenes are drawn",
    "where they are 0.003 thick": "a quantity that is varied",
    "three times the base range": "a quantity that is varied",
    "a thirtieth to eight times": "a quantity that is varied",
    "(scales of 0.2 to 0.55)": "how scenes are drawn",
    "mean falls under 40 dB": "where warnings begin",
    "nothing falls under 40 dB": "where warnings begin",
    "6 dB less error": "half an error, in another unit",
    "against 64 samples": "what pictures are compared with",
    "36.41 dB, SSIM 0.982, FLIP 0.049": "the paper's Table 2",
    "they are 0.003 thick": "a quantity that is varied",
    "95 % interval of the": "how sure means are said to be",
    "thinner than 0.01, which": "the language's definition",
    "eight times for every point": "the paper's method",
    "1.6 million": "the paper's training",
    "trained on 16 scenes alone": "how long and on what it was trained",
    "Table 1, 32 numbers a material": "the paper's",
    "The 16 scenes' first eight": "what a picture shows",
    "The worst 6 scenes of booleans": "what a picture shows",
    "after 120 s": "how long it was trained",
    "after 40 s": "how long it was trained",
}
