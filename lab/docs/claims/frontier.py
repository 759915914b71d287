"""Figures in docs/frontier.md, whose tables and first sentences lab/docs/make_frontier.py writes."""

CLAIMS: list[str] = []
GIVEN = {
    "under 0.002 nobody sees it, at 0.01 outlines are hard or a little off, at 0.1 it is": "a rule of thumb",
    "with 1 or 16 samples it is": "what is drawn for comparison",
    "Against 64 samples": "what pictures are compared with where four are not the truth",
    "of at most 2.5 %": "how a promise is defined",
    "fewer than 118 scenes": "how a promise is defined",
    "k = ⌈0.975 (n + 1)⌉": "how a promise is defined",
    "95 % of the scenes with 16 objects": "the share that is asked for",
    "at least 95 % of": "the share that is asked for",
    "a fixed piece of work of 50 ms": "how the yardstick was made",
    "| `four` | four | 0.009 | 3 |": "a setting",
    "four where neighbours differ by more than 0.04 | 0.009 | 3 |": "a setting",
    "four where neighbours differ by more than 0.15 | 0.04 | 2 |": "a setting",
    "| `one` | one | 0.04 | 2 |": "a setting",
    "one for each 2 x 2 pixels, enlarged | 0.04 | 2 |": "a setting",
    "drawn in 256 pixels": "how a time is foretold",
    "what is thinner than 0.01": "a limit of the language",
    "a shell of 0.03": "a setting",
}
