"""A workspace as summaries, meshes, cells and pictures."""
