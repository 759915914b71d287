"""E05xx, W05xx: what a model cannot do."""

CODES: dict[str, str] = {
    "E0501": "the model does not have a geometry",
    "E0502": "the model does not have a material",
    "E0503": "the model does not have a transform",
    "E0504": "the model does not have a material operation",
    "E0505": "a transform leaves the plane of a 2D model",
    "E0506": "an object has more deformations than the model holds",
    "E0507": "the canvas is larger than the model draws",
    "E0508": "no model fits the scene",
    "E0509": "the model does not draw canvases of this size",
    "E0510": "the model draws over white alone",
    "W0501": "more objects than the model was measured with",
    "W0502": "a twirl outside the measured range",
    "W0503": "a bend outside the measured range",
    "W0504": "an object outside the measured range of scales",
    "W0505": "more smooth unions than the model was measured with",
    "W0506": "an object thinner than the model was measured with",
    "W0507": "a blend of bright and dark larger than the model was measured with",
    "W0508": "a scale along z in a 2D model",
}
