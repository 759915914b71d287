"""Elements from what users bring. The rest of the package draws without what this needs."""
