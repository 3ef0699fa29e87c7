"""Workspaces proved by subdivision with interval arithmetic."""
