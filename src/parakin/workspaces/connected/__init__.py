"""The connected components of a workspace."""
