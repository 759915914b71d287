"""Scenes, graphs and Programs as data for other software, and other software's data as Scenes."""
