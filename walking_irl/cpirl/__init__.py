"""Cutting-Plane Inverse Reinforcement Learning; start at :mod:`walking_irl.cpirl.loop`."""

from walking_irl.cpirl.loop import cpirl

__all__ = ["cpirl"]
