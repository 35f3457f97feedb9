"""Rules for the next query: analytic, Chebyshev, gravity and inscribed-ellipsoid centres."""

from __future__ import annotations

from walking_irl.errors import InvalidInputError
from walking_irl.geometry.centres.analytic import analytic
from walking_irl.geometry.centres.centre import Centre, CentreRule, OwnCentre, checked
from walking_irl.geometry.centres.chebyshev import chebyshev
from walking_irl.geometry.centres.ellipsoid import ellipsoid
from walking_irl.geometry.centres.gravity import gravity

__all__ = ["CENTRES", "Centre", "CentreRule", "OwnCentre", "centre_rule"]

CENTRES: dict[str, CentreRule] = {
    "ac": analytic,
    "cg": gravity,
    "mvie": ellipsoid,
    "cc": chebyshev,
}


def centre_rule(centre: str | CentreRule | OwnCentre) -> CentreRule:
    """The rule of that name, or a function of one's own as such a rule.

    >>> centre_rule("acc")
    Traceback (most recent call last):
    walking_irl.errors.InvalidInputError: unknown centre 'acc'; choose from ac, cc, cg, mvie

    Raises:
        InvalidInputError: If there is none.
    """
    if callable(centre):
        return checked(centre)
    if centre not in CENTRES:
        raise InvalidInputError(
            f"unknown centre {centre!r}; choose from {', '.join(sorted(CENTRES))}"
        )
    return CENTRES[centre]
