"""A run on disk: its setup, its expert and every answer of the solver, in one ``.npz`` file.

Answers are what a run costs; everything else (cuts, centres, intervals, the recording) is computed
again from them in no time. A run that is resumed asks the same queries as before, gets the answers
from the file, and goes on where they end.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains import load
from walking_irl.domains.humanoid.recorded.archives import UNREADABLE
from walking_irl.errors import InvalidInputError
from walking_irl.files import write_file
from walking_irl.run.case import Setup, Subject
from walking_irl.run.report import to_plain
from walking_irl.types import Expert, Response
from walking_irl.versions import versions

Answer = tuple[Array, Response]

FORMAT = 1
SAME = 1e-9
"""Largest difference of two weights that are one query."""


@dataclass(frozen=True)
class SavedRun:
    """What is needed to go on.

    Attributes:
        setup: What the run was asked to do.
        subject: Its expert; without the recorded walks.
        answers: Queries, shape (K,), and what the solver answered, in order.
    """

    setup: Setup
    subject: Subject
    answers: Sequence[Answer]


class Remembering:
    """A forward solver that does not solve again what is known.

    A solver with a memory of its own, ``recall(response)``, is told of what it did not solve.
    """

    def __init__(self, forward: Callable[[Array], Response], answers: Sequence[Answer]) -> None:
        self.forward, self.answers = forward, answers

    def __call__(self, w: Array) -> Response:
        """The answer from memory, or the solver's."""
        for asked, response in self.answers:
            if np.abs(asked - w).max() <= SAME:
                if hasattr(self.forward, "recall"):
                    self.forward.recall(response)
                return response
        return self.forward(w)


def save_run(path: Path, run: SavedRun) -> None:
    """Write a run.

    Raises:
        InvalidInputError: If the file cannot be written.
    """
    domain, subject, expert = load(run.setup.domain), run.subject, run.subject.expert
    setup = {k: v for k, v in asdict(run.setup).items() if k not in ("record", "archive")}
    if run.setup.demonstration is not None:
        setup["demonstration"] = str(run.setup.demonstration)
    about = {
        "format": FORMAT,
        "setup": setup,
        "suboptimality": expert.suboptimality,
        "n_samples": expert.n_samples,
        "info": [dict(response.info) for _, response in run.answers],
        "versions": versions(),
    }
    arrays = {
        "about": np.array(json.dumps(to_plain(about))),
        "expert_mu": expert.mu,
        "expert_error": expert.error,
        "expert_covariance": expert.covariance,
        "demonstration": domain.pack(expert.demonstration),
        "policy": domain.pack(subject.policy),
        "w_expert": subject.w_expert,
        "true_mu": subject.true_mu,
    }
    for i, (w, response) in enumerate(run.answers):
        arrays[f"w_{i}"], arrays[f"mu_{i}"] = w, response.mu
        arrays[f"policy_{i}"] = domain.pack(response.policy)
        arrays[f"sensitivity_{i}"] = response.sensitivity
        arrays[f"evaluated_{i}"] = response.evaluated
    content = io.BytesIO()
    known = {name: array for name, array in arrays.items() if array is not None}
    np.savez_compressed(content, **known)
    write_file(path, content.getvalue())


def load_run(path: Path) -> SavedRun:
    """Read a run that :func:`save_run` wrote.

    Raises:
        InvalidInputError: If there is no such file, or it holds something else.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
    except FileNotFoundError as error:
        raise InvalidInputError(f"there is no file {path}") from error
    except UNREADABLE as error:
        raise InvalidInputError(f"{path} is not a readable run: {error}") from error
    try:
        return _unpacked(arrays)
    except (*UNREADABLE, IndexError, InvalidInputError) as error:
        raise InvalidInputError(
            f"{path} is not a run that this version can resume ({error}); give the archive that "
            "walking-irl recover wrote beside its recording"
        ) from error


def _unpacked(arrays: dict[str, Any]) -> SavedRun:
    about = json.loads(str(arrays["about"]))
    if about["format"] != FORMAT:
        raise InvalidInputError(f"its format is {about['format']}, expected {FORMAT}")
    setup = _setup(about["setup"])
    domain = load(setup.domain)
    K = len(domain.objectives)
    expert = Expert(
        mu=_finite(arrays["expert_mu"], K),
        error=_finite(arrays["expert_error"], K),
        suboptimality=float(about["suboptimality"]),
        covariance=arrays.get("expert_covariance"),
        n_samples=int(about["n_samples"]),
        demonstration=domain.unpack(arrays["demonstration"]),
    )
    w_expert, true_mu = (
        _finite(arrays[name], K) if name in arrays else None for name in ("w_expert", "true_mu")
    )
    subject = Subject(expert, domain.unpack(arrays["policy"]), w_expert, true_mu)
    answers = [
        (
            _finite(arrays[f"w_{i}"], K),
            Response(
                policy=domain.unpack(arrays[f"policy_{i}"]),
                mu=_finite(arrays[f"mu_{i}"], K),
                sensitivity=_finite(arrays[f"sensitivity_{i}"], K, K)
                if f"sensitivity_{i}" in arrays
                else None,
                evaluated=_table(arrays[f"evaluated_{i}"], K),
                info=info,
            ),
        )
        for i, info in enumerate(about["info"])
    ]
    return SavedRun(setup, subject, answers)


def _setup(given: dict[str, Any]) -> Setup:
    unknown = given.keys() - {f.name for f in fields(Setup)}
    if unknown:
        raise InvalidInputError(f"unknown settings {', '.join(sorted(unknown))}")
    given = copy(given)
    if given["weights"] is not None:
        given["weights"] = tuple(given["weights"])
    if given["demonstration"] is not None:
        given["demonstration"] = Path(given["demonstration"])
    for name, usual in asdict(Setup()).items():
        if type(usual) in (int, str) and type(given.get(name, usual)) is not type(usual):
            raise InvalidInputError(f"its setting {name} is {given[name]!r}")
    return Setup(**given)


def _finite(array: Array, *shape: int) -> Array:
    if array.shape != shape or not np.isfinite(array).all():
        raise InvalidInputError(f"expected finite numbers of shape {shape}, got {array.shape}")
    return array


def _table(array: Array, K: int) -> Array:
    if array.size and (array.ndim != 2 or array.shape[1] != K):
        raise InvalidInputError(f"expected policies of shape (n, {K}), got {array.shape}")
    return array
