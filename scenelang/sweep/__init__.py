"""Many pictures of one scene, each with other values of its params.

In order: `values` says which values, `variants` makes scenes of them, `table` and `sheet` show what came of
them, `api` ties it up with what draws animations.
"""
