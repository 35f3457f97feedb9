"""The best gait under given weights, by inverse dynamics."""
