"""How far a picture of the plane may differ from the exact one at most, proved pixel by pixel."""
