"""Drawing a scene again on each save: `screen` shows what came of it, `picture` draws and waits."""
