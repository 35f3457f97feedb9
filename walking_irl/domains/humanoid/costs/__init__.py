"""What the walker may walk for."""
