"""A run on disk: its setup, its expert and every answer of the solver, in one ``.npz`` file.

Answers are what a run costs; everything else (cuts, centres, intervals, the recording) is computed
again from them in no time. A run that is resumed asks the same queries as before, gets the answers
from the file, and goes on where they end.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from walking_irl.archives import UNREADABLE, read_arrays
from walking_irl.arrays import Array
from walking_irl.domains import load
from walking_irl.domains.contract import Demonstration, Domain, Truth, settings
from walking_irl.errors import InvalidInputError, reason
from walking_irl.files import to_plain, with_arrays, write_file
from walking_irl.run.setup import Setup
from walking_irl.types import Expert, Forward, Response
from walking_irl.versions import versions

Answer = tuple[Array, Response]

FORMAT = 2
OLD_OPTIONS = ("population", "rollouts", "noise", "disturbance")
"""Settings of format 1 that are now options of those domains that have them."""
SAME = 1e-9
"""Largest difference of two weights that are one query."""


@dataclass(frozen=True)
class Checkpoint:
    """What is needed to go on.

    Attributes:
        setup: What the run was asked to do.
        demonstration: Its expert; without the recorded trajectories.
        answers: Queries, shape (K,), and what the solver answered, in order.
    """

    setup: Setup
    demonstration: Demonstration
    answers: Sequence[Answer]


class Replay:
    """A forward solver that does not solve again what is known.

    A solver with a memory of its own, ``recall(response)``, is told of what it did not solve.
    """

    def __init__(self, forward: Forward, answers: Sequence[Answer]) -> None:
        self.forward, self.answers = forward, answers

    def __call__(self, w: Array) -> Response:
        """The answer from memory, or the solver's."""
        for asked, response in self.answers:
            if np.abs(asked - w).max() <= SAME:
                if hasattr(self.forward, "recall"):
                    self.forward.recall(response)
                return response
        return self.forward(w)


class CheckpointFile:
    """Writes a run as it goes: whole every time, but what has not changed is not packed again.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._run: Checkpoint | None = None
        self._packed = b""

    def save(self, run: Checkpoint) -> None:
        """Write a run, in place of what the file holds.

        Raises:
            InvalidInputError: If the file cannot be written.
        """
        domain, before = load(run.setup.domain), self._run
        if before is None or not _goes_on(before, run):
            before, self._packed = replace(run, answers=[]), with_arrays(b"", _expert(run, domain))
        new: dict[str, Any] = {}
        for i in range(len(before.answers), len(run.answers)):
            w, response = run.answers[i]
            new[f"w_{i}"], new[f"mu_{i}"] = w, response.mu
            new[f"policy_{i}"] = domain.pack(response.policy)
            new[f"sensitivity_{i}"] = response.sensitivity
            new[f"evaluated_{i}"] = response.evaluated
        self._packed = with_arrays(self._packed, _given(new))
        self._run = replace(run, answers=list(run.answers))
        about = np.array(json.dumps(to_plain(_about(run), is_exact=True)))
        write_file(self.path, with_arrays(self._packed, {"about": about}))


def _goes_on(before: Checkpoint, run: Checkpoint) -> bool:
    """Whether a run is the same as before, perhaps with more answers."""
    if run.demonstration is not before.demonstration or len(run.answers) < len(before.answers):
        return False
    pairs = zip(before.answers, run.answers, strict=False)
    return run.setup == before.setup and all(a[0] is b[0] and a[1] is b[1] for a, b in pairs)


def _about(run: Checkpoint) -> dict[str, Any]:
    expert = run.demonstration.expert
    setup = {k: v for k, v in asdict(run.setup).items() if k not in ("record", "checkpoint")}
    if run.setup.demonstration is not None:
        setup["demonstration"] = str(run.setup.demonstration)
    return {
        "format": FORMAT,
        "setup": setup,
        "suboptimality": expert.suboptimality,
        "n_samples": expert.n_samples,
        "info": [dict(response.info) for _, response in run.answers],
        "versions": versions(),
    }


def _expert(run: Checkpoint, domain: Domain) -> dict[str, Any]:
    shown = run.demonstration
    expert, truth = shown.expert, shown.truth
    arrays = {
        "expert_mu": expert.mu,
        "expert_error": expert.error,
        "expert_covariance": expert.covariance,
        "demonstration": domain.pack(expert.demonstration),
        "policy": domain.pack(shown.policy),
        "w_expert": None if truth is None else truth.w,
        "true_mu": None if truth is None else truth.mu,
    }
    return _given(arrays)


def _given(arrays: dict[str, Any]) -> dict[str, Any]:
    return {name: array for name, array in arrays.items() if array is not None}


def load_checkpoint(path: Path) -> Checkpoint:
    """Read a run that :class:`CheckpointFile` wrote.

    Raises:
        InvalidInputError: If there is no such file, or it holds something else.
    """
    if not path.is_file():
        raise InvalidInputError(f"there is no file {path}")
    arrays = read_arrays(path)
    try:
        return _unpacked(arrays)
    except (*UNREADABLE, AttributeError, IndexError, InvalidInputError) as error:
        raise InvalidInputError(
            f"{path} is not a run that this version can resume ({reason(error)}); give the "
            "checkpoint that walking-irl recover wrote beside its recording"
        ) from error


def _unpacked(arrays: Mapping[str, Any]) -> Checkpoint:
    about = json.loads(str(arrays["about"]))
    if about["format"] not in (1, FORMAT):
        raise InvalidInputError(f"its format is {about['format']}, expected {FORMAT}")
    setup = _setup(about["setup"], about["format"])
    domain = load(setup.domain)
    K, covariance = len(domain.objectives), arrays.get("expert_covariance")
    expert = Expert(
        mu=_finite(arrays["expert_mu"], K),
        error=_finite(arrays["expert_error"], K),
        suboptimality=float(about["suboptimality"]),
        covariance=None if covariance is None else _finite(covariance, K, K),
        n_samples=int(about["n_samples"]),
        demonstration=domain.unpack(arrays["demonstration"]),
    )
    truth = None
    if "w_expert" in arrays:
        truth = Truth(_finite(arrays["w_expert"], K), _finite(arrays["true_mu"], K))
    shown = Demonstration(expert, domain.unpack(arrays["policy"]), truth)
    answers = [_answer(arrays, domain, i, info) for i, info in enumerate(about["info"])]
    return Checkpoint(setup, shown, answers)


def _answer(arrays: Mapping[str, Any], domain: Domain, i: int, info: dict[str, Any]) -> Answer:
    K, sensitivity = len(domain.objectives), arrays.get(f"sensitivity_{i}")
    response = Response(
        policy=domain.unpack(arrays[f"policy_{i}"]),
        mu=_finite(arrays[f"mu_{i}"], K),
        sensitivity=None if sensitivity is None else _finite(sensitivity, K, K),
        evaluated=_table(arrays[f"evaluated_{i}"], K),
        info=info,
    )
    return _finite(arrays[f"w_{i}"], K), response


def _setup(given: dict[str, Any], version: int) -> Setup:
    if version == 1:  # all domains had the walker's options
        known = load(given["domain"]).options
        old = {name: given.pop(name) for name in OLD_OPTIONS if name in given}
        given["options"] = {name: value for name, value in old.items() if name in known}
    unknown = given.keys() - {f.name for f in fields(Setup)}
    if unknown:
        raise InvalidInputError(f"unknown settings {', '.join(sorted(unknown))}")
    if given["weights"] is not None:
        given["weights"] = tuple(given["weights"])
    if given["demonstration"] is not None:
        given["demonstration"] = Path(given["demonstration"])
    for name, hint in get_type_hints(Setup).items():
        if name in given and hint in (int, str, int | None):
            value = given[name]
            if not isinstance(value, hint) or isinstance(value, bool):
                raise InvalidInputError(f"its setting {name} is {value!r}")
    setup = Setup(**given)
    settings(load(setup.domain).options, setup.options, setup.domain)
    return setup


def _finite(array: Array, *shape: int) -> Array:
    if array.shape != shape or not np.isfinite(array).all():
        raise InvalidInputError(f"expected finite numbers of shape {shape}, got {array.shape}")
    return array


def _table(array: Array, K: int) -> Array:
    if array.size and (array.ndim != 2 or array.shape[1] != K):
        raise InvalidInputError(f"expected policies of shape (n, {K}), got {array.shape}")
    return array
