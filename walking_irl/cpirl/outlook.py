"""What passes between the parts of one iteration: the query, and what is known after its answer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.levels import Levels
from walking_irl.cpirl.regret_model import RegretModel
from walking_irl.errors import EmptyPolyhedronError
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Rule, Status


class Query(NamedTuple):
    """Weights to solve for."""

    w: Array
    rule: Rule
    polyhedron: WeightPolyhedron
    """Weights among which they were sought, before the answer's cut."""
    centre: Array | None = None
    """The centre asked for, or the one that repeated itself and was left."""


class DeadEnd(NamedTuple):
    """Why no rule has a next query: the polyhedron has no centre, or one that repeats itself."""

    error: EmptyPolyhedronError | None
    centre: Array | None = None


class Progress(NamedTuple):
    """How Newton's method gets on."""

    target: Array
    """Where its step leads, shape (K,)."""
    length: float
    """Of the step from the model's best query (L1)."""
    n_poor: int
    """Newton queries in a row that did not gain what they should."""
    gap: float = math.inf
    """Best regret above its lower bound, relative, where f is known well enough to say."""
    noise: float = 0.0
    """Length of a step that the noise in the expert's features explains (L1)."""
    is_measured: bool = True
    """Whether the solver's own defect has been measured, where it can be."""
    has_stalled: bool = False
    """Whether the steps no longer become shorter."""


@dataclass(frozen=True)
class Outlook:
    """What is known after an answer; endings and queries look at nothing else.

    Attributes:
        bundle: All answers.
        levels: What the mode says of the regret.
        rule: How the newest query was chosen.
        model: Quadratic model of the regret, once its minimum is near.
        progress: Of Newton's method, where there is a model.
        dead_end: Why there is no next query, where there is none.
    """

    bundle: Bundle
    levels: Levels
    rule: Rule
    model: RegretModel | None = None
    progress: Progress | None = None
    dead_end: DeadEnd | None = None


class Ending(NamedTuple):
    """Why a run is over."""

    status: Status
    estimate: Array | None = None
    """The weights that it ends with, shape (K,), if not the usual estimate."""


class Decision(NamedTuple):
    """The next query (None at the end), and what is believed now."""

    query: Query | None
    estimate: Array
    status: Status
