"""E02xx, W02xx: names."""

CODES: dict[str, str] = {
    "E0201": "unknown name",
    "E0202": "name already defined in this scope",
    "E0203": "name used before its line",
    "E0204": "unknown geometry, module or transform",
    "E0205": "name belongs to another model",
    "E0206": "unknown argument",
    "E0207": "unknown function",
    "E0208": "unknown material",
    "E0209": "name of the language defined anew",
    "E0210": "unknown model",
    "E0211": "parameter value for no param",
    "E0212": "unknown member",
    "E0213": "name of another kind",
    "E0214": "file cannot be read",
    "E0215": "import leaves the import root",
    "E0216": "import cycle",
    "W0201": "unused name",
}
