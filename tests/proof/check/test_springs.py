"""Protects the check of springs of a body that is not held."""

from fractions import Fraction

import pytest

from rbstab.proof.check import check
from rbstab.proof.exact.expr import as_factor, variable
from rbstab.proof.model import Energy

from .cases import BOWL, Y, record, state

Z = [variable(k) for k in (3, 4, 5)]
FREE = (3, 4, 5)
AWAY = 3
"""The distance of the anchor from where all else holds the body, m."""

STIFFNESS = 100
"""That of all else, N/m; the spring pushes with 1 N."""

SHIFT = 50
"""What is taken off the energy and its levels, J."""

NO_LENGTH = Fraction(STIFFNESS * AWAY**2, 2)
"""The least energy where the spring has no length, J: all else is stretched by `AWAY`."""


def spring(away=AWAY, weight=1):
    """Return -w |z + r| with r = (away, 0, 0)."""
    shifted = as_factor(Z[0] + away)
    return -weight * (shifted**2 + Z[1] ** 2 + Z[2] ** 2).sqrt()


def claims(level, steep=300, more=0, **others):
    """Return a record of one minimum at Θ = 0, with a certified region."""
    held = Fraction(STIFFNESS, 2) * (Z[0] ** 2 + Z[1] ** 2 + Z[2] ** 2)
    U = steep * (BOWL + 2 * Y**2) + held + spring() + more - SHIFT
    return record(Energy(U, FREE), state((0, 0, 0), 0), level=level - SHIFT, **others)


def wrong(data):
    """Return which claims are not verified."""
    return {finding.claim for finding in check(data) if not finding.verified}


def test_a_region_ends_where_the_spring_has_no_length():
    # At θ2 = ±π/2 the energy is higher: 600 (π/2)² J above the lowest.
    assert float(NO_LENGTH) < 600 * 2.4
    assert wrong(claims(float(NO_LENGTH) - 0.01)) == set()
    assert wrong(claims(float(NO_LENGTH) + 0.01)) == {"certified region"}


def test_what_is_never_verified_with_springs():
    """Every start; and one that may push both ways, as all positions on a sphere balance."""
    data = claims(10.0, more=10 * Y.cos() ** -2, every_start=True)
    data["energy"]["closed"] = [1]
    assert "every start" in wrong(data)
    assert wrong(claims(1.0, more=-spring() + spring(0, 10))) & {"rest states", "convexity"}


def test_a_length_has_each_entry_of_z_once():
    twice = (as_factor(Z[0] + AWAY) ** 2 + as_factor(Z[0] - 1) ** 2 + Z[1] ** 2 + Z[2] ** 2).sqrt()
    assert wrong(claims(1.0, more=-twice)) == {"convexity"}


@pytest.mark.parametrize(
    ("factor", "power"), [(-60, 2), (Fraction(1, 10), 3), (Fraction(1, 10), 4)]
)
def test_what_is_beside_springs_must_be_convex(factor, power):
    unverified = wrong(claims(1.0, more=factor * Z[1] ** power))
    assert unverified == (set() if power == 4 else {"convexity"})
