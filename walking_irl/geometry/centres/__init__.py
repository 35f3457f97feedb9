"""Rules for the next query: analytic, Chebyshev, gravity and inscribed-ellipsoid centres."""

from __future__ import annotations

from walking_irl.errors import InvalidInputError
from walking_irl.geometry.centres.analytic import analytic
from walking_irl.geometry.centres.centre import Centre, CentreRule
from walking_irl.geometry.centres.chebyshev import chebyshev
from walking_irl.geometry.centres.ellipsoid import ellipsoid
from walking_irl.geometry.centres.gravity import gravity

__all__ = ["CENTRES", "Centre", "CentreRule", "centre_rule"]

CENTRES: dict[str, CentreRule] = {
    "ac": analytic,
    "cg": gravity,
    "mvie": ellipsoid,
    "cc": chebyshev,
}


def centre_rule(name: str) -> CentreRule:
    """The rule of that name.

    >>> centre_rule("acc")
    Traceback (most recent call last):
    walking_irl.errors.InvalidInputError: unknown centre 'acc'; choose from ac, cc, cg, mvie

    Raises:
        InvalidInputError: If there is none.
    """
    if name not in CENTRES:
        raise InvalidInputError(
            f"unknown centre {name!r}; choose from {', '.join(sorted(CENTRES))}"
        )
    return CENTRES[name]
