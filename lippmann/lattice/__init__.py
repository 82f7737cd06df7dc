"""Square and hexagonal microlens lattices: where lenses are, and which pixels belong to them."""
