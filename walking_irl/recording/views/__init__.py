"""What a recording shows of a domain beside the polyhedron, one file a domain."""
