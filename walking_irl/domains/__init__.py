"""Domains: worlds with objectives and a solver for the best policy under given weights."""
