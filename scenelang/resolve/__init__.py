"""Definitions and their uses, found without running anything."""
