"""Protects the check of soft guards: it confirms what is true, and refuses each false claim."""

import math

import numpy as np
import pytest

from rbstab.elements.guards.soft_guards import RepellingGuard, SoftGuard, StiffGuard
from rbstab.proof.check import check
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.kept_range import Border, guard_energy, kept_record
from rbstab.proof.model import Energy

X, Y, Z = map(variable, range(3))

SOFT_ANGLE = 1.2
END = np.array([3.0, math.pi / 2, 3.0])
STIFF: type[SoftGuard] = StiffGuard
REPELLING: type[SoftGuard] = RepellingGuard

BORDER = 3 * math.pi**2 / 8
ROOM = math.pi / 2 - SOFT_ANGLE
LEAST = {STIFF: BORDER + 10.0 * ROOM**2 - 2e-9, REPELLING: BORDER + 20.0 * ROOM - 2e-9}
"""The least energy at θ2 = ±π/2 without a load, J."""


def refused(bound, kind=STIFF, load=0.0, k=1.0, *, strength=20.0, inner=SOFT_ANGLE):
    """Check U = ½ (k θ1² + 3 θ2² + θ3²) + load θ2 with a guard."""
    U = 0.5 * (expr(k) * X * X + 3 * Y * Y + Z * Z) + expr(load) * Y
    return refused_of(U, guard_energy(kind, strength, SOFT_ANGLE), bound, inner, END)


def refused_of(U, guard, bound, inner, end):
    """Return the claims that are not verified."""
    findings = check(kept_record(Energy(U), Border(end, 0.0), guard, bound, inner))
    claims = [finding.claim for finding in findings]
    assert claims[:1] == ["switches"]
    return [finding.claim for finding in findings if not finding.verified]


@pytest.mark.parametrize("kind", LEAST)
def test_the_least_energy_at_the_ends(kind):
    assert refused(LEAST[kind], kind) == []
    assert refused(LEAST[kind], kind, k=0.0) == ["ends"]  # it does not grow with θ1
    assert refused(LEAST[kind] + 1e-8, kind) == ["range"]
    assert refused(LEAST[kind], kind, strength=19.9) == ["range"]


@pytest.mark.parametrize("load", [1.0, -1.0])
def test_both_ends_count(load):
    least = LEAST[STIFF] - math.pi / 2
    assert refused(least, load=load, inner=math.pi) == []
    assert refused(least + 1e-8, load=load, inner=math.pi) == ["range"]


@pytest.mark.parametrize(
    ("load", "kind", "stands"),
    [
        (-3.3, STIFF, True),
        (-3.7, STIFF, False),
        (-3.7, REPELLING, False),
        (-30.0, REPELLING, True),
    ],
)
def test_a_load_that_the_guard_balances(load, kind, stands):
    """At θ2 = 1.2 the spring pulls by 3.6 N m, at π/2 by 4.7; the guard adds up to 7.4 or 20."""
    assert refused(-99.0, kind, load) == ([] if stands else ["no other rest state"])


def test_a_point_of_the_border_beyond_the_ends_is_refused():
    """With a coupling 4 θ1 θ2 the lowest point of θ2 = π/2 has θ1 = -2π."""
    U = 0.5 * (X * X + 30 * Y * Y + Z * Z) + 4 * X * Y
    guard = guard_energy(STIFF, 20.0, SOFT_ANGLE)
    for first, wrong in ((6.2, ["ends"]), (6.4, [])):
        assert refused_of(U, guard, -99.0, math.pi, np.array([first, 1.0, 3.0])) == wrong
