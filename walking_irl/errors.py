"""Errors that a user can act on; the command line turns each into one sentence and exit code 2."""

from __future__ import annotations


class WalkingIRLError(Exception):
    """Base of every error that this package raises on purpose."""


class InvalidInputError(WalkingIRLError, ValueError):
    """An argument has the wrong shape, sign or value; the message says what was expected."""


class EmptyPolyhedronError(WalkingIRLError):
    """No weight satisfies every cut: a mixture of the policies found beats the expert.

    Attributes:
        radius: Radius of the largest inscribed ball (negative: by how much the rows miss).
    """

    def __init__(self, message: str, radius: float = float("nan")) -> None:
        super().__init__(message)
        self.radius = radius


class FlatPolyhedronError(EmptyPolyhedronError):
    """The weights left are too thin to have a centre: known to about 1e-6 in some direction."""


class SolverError(WalkingIRLError):
    """A forward solver diverged or stalled from every start that it tried."""


class FallError(WalkingIRLError):
    """The walker fell in closed loop.

    Attributes:
        time: When it fell [s].
    """

    def __init__(self, message: str, time: float = float("nan")) -> None:  # picklable
        super().__init__(message)
        self.time = time


class RecordingError(WalkingIRLError):
    """A recording cannot be written or read."""


def reason(error: BaseException) -> str:
    """What an error of other code says, as part of a sentence: one short line of readable text."""
    text = " ".join(str(error).split()) or type(error).__name__
    readable = "".join(c if c.isprintable() else "?" for c in text)
    return readable if len(readable) <= 200 else f"{readable[:200]} ..."
