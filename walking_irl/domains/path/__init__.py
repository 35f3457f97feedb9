"""Walking paths seen from above, by optimal control."""
