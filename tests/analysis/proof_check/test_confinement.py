"""Protects the checker's bound on slopes, and that it takes none where it finds none."""

import numpy as np
import pytest
from flint import arb, ctx
from support.held_springs import held_system, random_springs
from support.proofs import proof_of

from rbstab.analysis.proof_check import confinement as module
from rbstab.analysis.proof_check.confinement import FACTOR, confinement, largest_slope
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.taylor import Taylor


@pytest.fixture(autouse=True)
def _precision():
    with ctx.workprec(128):
        yield


def wave(axis):
    """Return a slope of 3 cos θ1 cos θ3 + sin θ2; they are at most 3, 1 and 3."""
    coefficients, zeros = np.zeros((3, 3, 3)), np.zeros((3, 3))
    coefficients[1, 0, 1], coefficients[0, 2, 0] = 3.0, 1.0
    data = {"quadratic": zeros.tolist(), "linear": [0.0] * 3, "coefficients": coefficients.tolist()}
    U = Energy(data)

    def slope(box):
        taylor = Taylor(U, box)
        return taylor.gradient[axis, 0], taylor.whole_gradient[axis, 0].abs_upper()

    return slope


@pytest.mark.parametrize(("axis", "most"), [(0, 3.0), (1, 1.0), (2, 3.0)])
def test_the_largest_slope_of_a_wave_is_bounded(axis, most):
    bound = largest_slope(wave(axis))
    assert bound is not None
    assert most <= float(bound) <= FACTOR * most * (1 + 1e-12)


def test_a_bound_that_is_enough_takes_fewer_boxes_and_holds():
    boxes: dict[float, int] = {0.0: 0, 5.0: 0}

    def bound(enough):
        def slope(box):
            boxes[enough] += 1
            return wave(0)(box)

        return largest_slope(slope, enough)

    found, close = bound(5.0), bound(0.0)
    assert boxes[5.0] < boxes[0.0]
    assert found is not None
    assert close is not None
    assert 3.0 <= close < found <= 5.0


def test_no_bound_is_made_up(monkeypatch):
    monkeypatch.setattr(module, "BOX_LIMIT", 3)
    assert largest_slope(wave(0)) is None
    monkeypatch.setattr(module, "BOX_LIMIT", 50)
    assert largest_slope(lambda _: (arb("nan"), arb("nan"))) is None


@pytest.mark.heavy
def test_confinement_holds_and_falls_back_to_single_terms(monkeypatch):
    (spring,) = random_springs(np.random.default_rng(1), 1)
    U = Energy(proof_of(held_system([spring], 2.0), box_limit=1)["reduced_energy"])
    monkeypatch.setattr(module, "FACTOR", 1.5)  # faster
    sharp = confinement(U)
    monkeypatch.setattr(module, "BOX_LIMIT", 1)
    single = confinement(U)
    assert sharp is not None
    assert single is not None
    assert all(0 < one < other for one, other in zip(sharp, single, strict=True))
