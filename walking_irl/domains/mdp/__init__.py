"""Finite Markov decision processes: gridworld and driving."""
