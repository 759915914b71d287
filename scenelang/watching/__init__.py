"""Drawing a scene again whenever its file, or one that it imports, is saved.

In order: `changes` waits for a save, `screen` says and shows what came of it, `picture` draws.
"""
