"""E04xx, W04xx: graph and booleans."""

CODES: dict[str, str] = {
    "E0401": "a composite in a union cannot be streamed",
    "E0402": "a composite operand of subtract cannot be streamed",
    "E0403": "a composite operand of intersect cannot be streamed",
    "E0404": "a composite operand of smooth is not the first",
    "E0405": "a scene is nested too deeply",
    "E0406": "transforms compose to a singular one",
    "W0401": "an intersection with nothing is empty",
}
