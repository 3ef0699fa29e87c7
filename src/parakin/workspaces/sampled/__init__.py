"""Workspaces sampled on a grid, along rays, and over the drives' ranges."""
