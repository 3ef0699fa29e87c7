"""How well a machine moves: Jacobians, performance indices, singularities, the atlas, and a design by them."""
