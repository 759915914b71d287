"""Scenes, graphs and Programs as data and drawings for other software."""
