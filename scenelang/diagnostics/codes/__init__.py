"""Every diagnostic code with its title. Codes are stable and never reused."""

from scenelang.diagnostics.codes import graph, model, names, syntax, types

CODES: dict[str, str] = {
    **syntax.CODES,
    **names.CODES,
    **types.CODES,
    **graph.CODES,
    **model.CODES,
}
