"""Random scenes of the plane with numbers out of all proportion, as text."""

from __future__ import annotations

import random

LEAVES = ("square", "triangle", "star", "pentagon")
TEXTURES = ("bricks", "checker", "dots", "waves")


def wild_scene(seed: int, low: float, high: float) -> str:
    """A scene of a few objects whose transforms now and then have numbers of 10^low to 10^high."""
    rng = random.Random(seed)

    def number(mild: float = 1.0) -> float:
        return round(rng.uniform(-mild, mild), rng.choice([1, 2, 6]))

    def huge() -> float:
        return (
            rng.choice([-1, 1])
            * round(rng.uniform(1, 10), rng.choice([0, 1, 9]))
            * 10 ** rng.uniform(low, high)
        )

    def size() -> float:
        return rng.choice([rng.uniform(0.2, 1.2), 0.5, 1.0])

    def wild() -> list[str]:
        n, s = huge(), abs(huge())
        a, b = number() or 0.3, number() or 0.7
        return rng.choice(
            [
                [f"translate({n}, {a})", f"translate({-n}, {b})"],
                [f"translate({n}, {n})", f"rotate({b}deg)", f"translate({-n}, {-n})"],
                [f"translate({n}, {b})"],
                [f"scale({s})", f"scale({size()} / {s})"],
                [f"scale({s}, {size()})", f"scale({size()} / {s}, {size()})"],
                [f"scale({s})", f"rotate({a}turn)", f"translate({n}, {b})", f"scale({size()} / {s})"],
                [f"scale(1 / {s})", f"translate({n}, 0)", f"translate({-n}, {b})", f"scale({s})"],
                [f"shear(xy = {n})", f"shear(xy = {-n})"],
                [f"shear(xy = {n})", f"rotate({b}deg)", f"shear(yx = {a})", f"scale({size()} / {s})"],
                [f"rotate({n}deg)"],
                [f"bend({n})"],
                [f"twirl({n})"],
                [f"bend({n})", f"bend({-n})"],
                [f"twirl({n})", f"twirl({-n} + {b})"],
                [f"scale({s})", f"bend({b} / {s})", f"scale({size()} / {s})"],
                [f"scale({s})", f"bend({b})", f"scale({size()} / {s})"],
                [f"scale({s}, {size()})"],
                [f"scale({size()}, {s})", f"rotate({b}turn)"],
                [f"matrix([[{n}, {s}, 0, {a}], [{a}, {b}, 0, {b}], [0, 0, 1, 0], [0, 0, 0, 1]])"],
            ]
        )

    def mild() -> list[str]:
        return rng.choice(
            [
                [f"translate({number()}, {number()})"],
                [f"rotate({number(360)}deg)"],
                [f"scale({size()})"],
                [f"scale({size()}, {size()})"],
                [f"twirl({number(2)})"],
                [f"bend({number(2)})"],
            ]
        )

    def moves(most: int, chance: float) -> str:
        found = [wild() if rng.random() < chance else mild() for _ in range(rng.randrange(most + 1))]
        return "".join(f"{step}; " for steps in found for step in steps)

    def colour() -> str:
        return f"#{rng.randrange(1 << 24):06x}"

    def material() -> str:
        kind = rng.random()
        if kind < 0.2:
            return ""
        if kind < 0.85:
            return f"material flat {{ color({colour()}); }}"
        own = "".join(f"{step}; " for step in (wild() if rng.random() < 0.3 else []) if "bend" not in step)
        own = "" if "twirl" in own else own
        hue = rng.choice(["", f"hue({number()}turn); ", f"hue({huge()}turn); hue({number()}turn); "])
        return f"material {rng.choice(TEXTURES)} {{ {own}{hue}color({colour()}); }}"

    def leaf() -> str:
        return f"{rng.choice(LEAVES)} {{ {moves(3, 0.3)}{material()} }}"

    def node(depth: int) -> str:
        if depth == 0 or rng.random() < 0.4:
            return leaf()
        inner = "".join(node(depth - 1) + " " for _ in range(rng.randrange(1, 4)))
        kind = rng.choice(["group", "union", "smooth", "subtract", "intersect", "smooth(k)"])
        if kind == "smooth(k)":
            kind = f"smooth({rng.choice([abs(huge()), 1 / abs(huge()), size()])})"
        return f"{kind} {{ {inner}{moves(2, 0.2)}}}"

    stage = rng.choice(["", "background(none);", f"background({colour()});"])
    objects = "\n".join(node(2) for _ in range(rng.randrange(1, 4)))
    return f"canvas({rng.choice(['24, 24', '24, 24', '40, 12', '64, 1'])});\n{stage}\n{objects}\n"
