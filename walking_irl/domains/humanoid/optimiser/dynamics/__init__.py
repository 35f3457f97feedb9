"""Closed-form first and second derivatives of MuJoCo's inverse dynamics, at all knots at once."""
