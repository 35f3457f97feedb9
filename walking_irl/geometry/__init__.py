"""The set of weights: its polyhedron, centres, and the linear programs underneath."""
