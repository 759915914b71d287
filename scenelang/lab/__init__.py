"""The laboratory: what measures, compares and trains for comparison. Nothing outside imports it."""
