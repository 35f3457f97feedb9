"""Cutting-Plane Inverse Reinforcement Learning; start at :mod:`walking_irl.cpirl.loop`.

:func:`recover` runs it to the end in one call; :func:`cpirl` is the iterator underneath, one
immutable iteration per forward solve.
"""

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.probes import Probing
from walking_irl.cpirl.recovery import Recovery, recover
from walking_irl.cpirl.stops import (
    CertificateBelow,
    EstimateSettled,
    IntervalsNarrowerThan,
    StopRule,
)
from walking_irl.cpirl.summary import Summary, summarise

__all__ = [
    "CertificateBelow",
    "EstimateSettled",
    "IntervalsNarrowerThan",
    "Probing",
    "Recovery",
    "StopRule",
    "Summary",
    "cpirl",
    "recover",
    "summarise",
]
