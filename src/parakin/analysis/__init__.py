"""What follows from a machine: workspaces, performance, singularities, proofs."""
