"""The largest box inside a workspace."""
