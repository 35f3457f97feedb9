"""The set of weights: its polyhedron, centres, and the linear programs underneath."""

from walking_irl.geometry.centres import CENTRES, Centre, CentreRule, OwnCentre, centre_rule
from walking_irl.geometry.game import Game, game_lp
from walking_irl.geometry.polyhedron import WeightPolyhedron

__all__ = [
    "CENTRES",
    "Centre",
    "CentreRule",
    "Game",
    "OwnCentre",
    "WeightPolyhedron",
    "centre_rule",
    "game_lp",
]
