"""The Scene, a value: its nodes, where each was written, and the ways out and in."""
