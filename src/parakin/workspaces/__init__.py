"""Where a machine is allowed: certified, sampled, inscribed and connected workspaces."""
