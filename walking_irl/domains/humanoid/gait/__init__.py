"""Gaits: periodic motions, their files, figures and pictures."""
