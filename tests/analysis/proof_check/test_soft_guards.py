"""Protects the checker of soft guards: it confirms what is true, and refuses each false claim."""

import math
from typing import Any

import pytest

from rbstab.analysis.proof_check.findings import Finding
from rbstab.analysis.proof_check.soft_guards import check_soft_guard

ENERGY = {
    "quadratic": [[1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]],
    "linear": [0.0, 0.0, 0.0],
    "coefficients": [[[0.0]]],
}
"""U = ½ (θ1² + 3 θ2² + θ3²), whose least value on θ2 = ±π/2 is 3π²/8."""

BORDER = 3 * math.pi**2 / 8
CLAIM: dict[str, Any] = {
    "method": "stiff",
    "strength": 20.0,
    "soft_angle": 1.2,
    "end": [3.0, math.pi / 2, 3.0],
    "border": BORDER - 1e-9,
    "energy_bound": BORDER + 10.0 * (math.pi / 2 - 1.2) ** 2 - 2e-9,
    "nothing_beyond": True,
}
REPELLING: dict[str, Any] = CLAIM | {
    "method": "repelling",
    "energy_bound": BORDER + 20.0 * (math.pi / 2 - 1.2) - 2e-9,
}


def refused(claim, **energy) -> list[str]:
    findings: list[Finding] = check_soft_guard(ENERGY | energy, claim)
    return [finding.claim for finding in findings if not finding.verified]


@pytest.mark.parametrize("claim", [CLAIM, REPELLING], ids=["stiff", "repelling"])
def test_true_claims(claim):
    assert refused(claim) == []
    claims = [finding.claim for finding in check_soft_guard(ENERGY, claim)]
    assert claims == ["ends", "border", "range", "nothing at rest beyond"]


@pytest.mark.parametrize(
    ("change", "claim"),
    [
        ({"border": BORDER + 1e-9}, "border"),
        ({"energy_bound": CLAIM["energy_bound"] + 1e-8}, "range"),
        ({"method": "repelling", "energy_bound": REPELLING["energy_bound"] + 1e-8}, "range"),
        ({"strength": 19.9}, "range"),
        ({"soft_angle": 1.21}, "range"),
        ({"method": "barrier"}, "soft guard"),
        ({"strength": -20.0}, "soft guard"),
        ({"soft_angle": 1.6}, "soft guard"),
        ({"end": [-1.0, 1.0, 3.0]}, "ends"),
        ({"end": [300.0, 1.0, 3.0]}, "ends"),
    ],
)
def test_false_claims(change, claim):
    assert claim in refused(CLAIM | change)


@pytest.mark.parametrize("load", [1.0, -1.0])
def test_both_ends_count(load):
    lower = CLAIM | {"nothing_beyond": False, "border": BORDER - math.pi / 2 - 1e-9}
    lower |= {"energy_bound": lower["border"]}
    assert refused(lower, linear=[0.0, load, 0.0]) == []
    higher = lower | {"border": BORDER - 1e-9}
    assert refused(higher, linear=[0.0, load, 0.0]) == ["border"]


@pytest.mark.parametrize(
    ("linear", "claim", "stands"),
    [
        ([0.0, -3.3, 0.0], CLAIM, True),
        ([0.0, -3.7, 0.0], CLAIM, False),
        ([0.0, 3.7, 0.0], CLAIM, False),
        ([0.0, -3.7, 0.0], REPELLING, False),
        ([0.0, -30.0, 0.0], REPELLING, True),
    ],
)
def test_a_load_that_the_guard_balances(linear, claim, stands):
    """At θ2 = 1.2 the spring pulls by 3.6 N m, at π/2 by 4.7; the guard adds up to 7.4 or 20."""
    found = refused(claim | {"border": -100.0, "energy_bound": -99.0}, linear=linear)
    assert found == ([] if stands else ["nothing at rest beyond"])


def test_an_energy_that_does_not_grow_with_theta1_has_no_border():
    flat = [[0.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]]
    assert refused(CLAIM, quadratic=flat) == ["ends"]
