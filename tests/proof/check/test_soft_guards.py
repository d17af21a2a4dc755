"""Protects the checker of soft guards: it confirms what is true, and refuses each false claim."""

import math
from typing import Any

import pytest

from rbstab.proof.check.findings import Finding
from rbstab.proof.check.soft_guards import check_soft_guard
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.model import Energy
from rbstab.proof.record import energy_record

X, Y, Z = map(variable, range(3))


def record(load=0.0, k=1.0, **more):
    """Return U = ½ (k θ1² + 3 θ2² + θ3²) + load θ2: without a load, 3π²/8 or more at θ2 = ±π/2."""
    U = 0.5 * (expr(k) * X * X + 3 * Y * Y + Z * Z) + expr(load) * Y
    return energy_record(Energy(U)) | more


BORDER = 3 * math.pi**2 / 8
ROOM = math.pi / 2 - 1.2
CLAIM: dict[str, Any] = {
    "method": "stiff",
    "strength": 20.0,
    "soft_angle": 1.2,
    "end": [3.0, math.pi / 2, 3.0],
    "energy_bound": BORDER + 10.0 * ROOM**2 - 2e-9,
    "nothing_beyond": True,
}
REPELLING: dict[str, Any] = CLAIM | {
    "method": "repelling",
    "energy_bound": BORDER + 20.0 * ROOM - 2e-9,
}


def refused(claim, **energy) -> list[str]:
    findings: list[Finding] = check_soft_guard(record(**energy), claim)
    return [finding.claim for finding in findings if not finding.verified]


@pytest.mark.parametrize("claim", [CLAIM, REPELLING], ids=["stiff", "repelling"])
def test_true_claims(claim):
    assert refused(claim) == []
    claims = [finding.claim for finding in check_soft_guard(record(), claim)]
    assert claims == ["ends", "range", "nothing at rest beyond"]
    assert refused(claim, k=0.0) == ["ends"]  # it does not grow with θ1


@pytest.mark.parametrize(
    ("change", "claim"),
    [
        ({"energy_bound": CLAIM["energy_bound"] + 1e-8}, "range"),
        ({"method": "repelling", "energy_bound": REPELLING["energy_bound"] + 1e-8}, "range"),
        ({"strength": 19.9}, "range"),
        ({"method": "barrier"}, "soft guard"),
        ({"strength": -20.0}, "soft guard"),
        ({"soft_angle": 1.6}, "soft guard"),
        ({"end": [300.0, 1.0, 3.0]}, "soft guard"),
    ],
)
def test_false_claims(change, claim):
    assert claim in refused(CLAIM | change)


@pytest.mark.parametrize("load", [1.0, -1.0])
def test_both_ends_count(load):
    least = CLAIM["energy_bound"] - math.pi / 2
    lower = CLAIM | {"nothing_beyond": False, "energy_bound": least}
    assert refused(lower, load=load) == []
    assert refused(lower | {"energy_bound": least + 1e-8}, load=load) == ["range"]


@pytest.mark.parametrize(
    ("load", "claim", "stands"),
    [
        (-3.3, CLAIM, True),
        (-3.7, CLAIM, False),
        (-3.7, REPELLING, False),
        (-30.0, REPELLING, True),
    ],
)
def test_a_load_that_the_guard_balances(load, claim, stands):
    """At θ2 = 1.2 the spring pulls by 3.6 N m, at π/2 by 4.7; the guard adds up to 7.4 or 20."""
    found = refused(claim | {"energy_bound": -99.0}, load=load)
    assert found == ([] if stands else ["nothing at rest beyond"])


def test_a_point_of_the_border_beyond_the_ends_is_refused():
    """With a coupling 4 θ1 θ2 the lowest point of θ2 = π/2 has θ1 = -2π."""
    U = 0.5 * (X * X + 30 * Y * Y + Z * Z) + 4 * X * Y
    energy = energy_record(Energy(U))
    least = {"energy_bound": -99.0, "nothing_beyond": False}
    for end, verified in ((6.2, False), (6.4, True)):
        claim = CLAIM | least | {"end": [end, 1.0, 3.0]}
        assert check_soft_guard(energy, claim)[0].verified is verified


@pytest.mark.parametrize(
    "more",
    [{"stop": "1"}, {"closed": [1]}, {"operations": [*record()["operations"], ["step", 1, 0]]}],
)
def test_what_closes_the_range_or_switches_is_refused(more):
    assert refused(CLAIM, **more) == ["soft guard"]
