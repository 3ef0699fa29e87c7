"""Performance proved over boxes of poses, by interval arithmetic."""
