"""Protects rest states where a guard holds θ2: found, isolated, counted, and no others.

U = ½ Σ w_i (θ_i - c_i)² with guards has rest states in closed form.
"""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from rbstab.analysis.proof.branch_and_bound import SearchOutcome, prove
from rbstab.analysis.proof.searches.zeros import search
from support.guards import parabola_with

from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.kinks import (
    Kink,
    isolated_kink_zero,
    kink_at,
    kink_index,
    kinks_of,
    newton_at_kink,
)
from rbstab.analysis.proof.guards.soft import SoftEnergy

CENTRE = np.array([0.3, 0.7, -0.2])


def soft(couple=0.0, stiffness=0.0, angle=0.5):
    return SoftEnergy(couple, stiffness, angle)


def the_kink(form, pitch):
    found = kink_at(form.guard, pitch)
    assert found is not None
    return found


def proved(form, end=(2.0, 1.5, 2.0)):
    end = np.array(end)
    if form.guard.stop is not None:
        end[1] = form.guard.end
    found = prove(form, search(form, 0, 50, end), end=end)
    without_hints = prove(form, (), end=end)
    assert len(without_hints.inside) == len(found.inside)
    assert without_hints.outcome is found.outcome
    return found


CASES = {
    "repelling, held": ((soft(couple=5.0),), 0.5, True),
    "repelling, too weak": ((soft(couple=0.05),), 0.65, False),
    "repelling, not reached": ((soft(couple=5.0, angle=0.8),), 0.7, False),
    "stiff": ((soft(stiffness=3.0),), (0.7 + 3 * 0.5) / 4, False),
    "stiff, not reached": ((soft(stiffness=3.0, angle=0.9),), 0.7, False),
    "stop, held": ((soft(couple=np.inf),), 0.5, True),
    "stop, not reached": ((soft(couple=np.inf, angle=0.9),), 0.7, False),
    "both, in the stiff one": (
        (soft(stiffness=3.0, angle=0.4), soft(couple=2.0, angle=0.6)),
        (0.7 + 3 * 0.4) / 4,
        False,
    ),
    "both, held by the second": (
        (soft(stiffness=0.1, angle=0.4), soft(couple=2.0, angle=0.6)),
        0.6,
        True,
    ),
    "before a stop": ((soft(couple=0.1), soft(couple=np.inf, angle=0.65)), 0.6, False),
}


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("case", CASES)
def test_the_one_rest_state_is_where_the_closed_form_is(case, sign):
    parts, pitch, held = CASES[case]
    pitch = 0.7 - 0.05 if case == "repelling, too weak" else pitch
    centre = CENTRE * [1, sign, 1]
    form = parabola_with(Guard(None, parts), centre)
    found = proved(form)
    assert found.outcome is SearchOutcome.PROVED
    (zero,) = found.inside
    assert zero.at_kink == held
    expected = np.array([0.3, sign * pitch, -0.2])
    np.testing.assert_allclose(zero.Theta, expected, atol=1e-12)
    assert np.all(zero.enclosure.low[0] <= expected + 1e-15)
    assert np.all(zero.enclosure.high[0] >= expected - 1e-15)
    assert zero.radius < 1e-10


def test_the_index_counts_directions_along_the_kink():
    for weights, index in (((1, 1, 2), 0), ((-1, 1, 2), 1), ((-1, 1, -2), 2)):
        form = parabola_with(Guard(None, (soft(couple=50.0),)), CENTRE, weights)
        (zero,) = proved(form).inside
        kink = the_kink(form, float(zero.Theta[1]))
        assert kink_index(form, kink, zero.enclosure) == index


def test_a_kink_without_a_couple_is_none():
    guard = Guard(BarrierEnergy(1.0), (soft(stiffness=3.0), soft(couple=1.0, angle=0.8)))
    assert [kink.angle for kink in kinks_of(guard)] == [-0.8, 0.8]
    assert kink_at(guard, 0.5) is None
    assert Kink(-1, guard.soft[1]) == kink_at(guard, -0.8)
    assert kinks_of(None) == []


def test_a_kink_beyond_a_stop_is_none():
    guard = Guard(None, (soft(couple=1.0, angle=0.8), soft(couple=np.inf, angle=0.6)))
    assert [kink.angle for kink in kinks_of(guard)] == [-0.6, 0.6]


@pytest.mark.parametrize("couple", [0.2, 0.2 * (1 - 1e-13)])
def test_a_guard_whose_couple_is_just_used_up_is_not_decided(couple):
    """-∂F/∂θ2 = 0.2 at the kink: with K = 0.2, rest states of both kinds meet there."""
    form = parabola_with(Guard(None, (soft(couple=couple),)), CENTRE)
    kink = the_kink(form, 0.5)
    assert isolated_kink_zero(form, kink, np.array([0.3, 0.5, -0.2])) is None
    assert proved(form).outcome is SearchOutcome.UNDECIDED


@pytest.mark.parametrize("centre", [0.5, 0.5 * (1 + 1e-14)])
def test_a_load_that_just_ends_at_a_kink_is_not_decided(centre):
    form = parabola_with(Guard(None, (soft(couple=np.inf),)), [0.3, centre, -0.2])
    assert proved(form).outcome is SearchOutcome.UNDECIDED


def test_two_guards_at_nearly_one_angle_are_not_decided():
    """-∂F/∂θ2 passes K = 0.5 between both: there are three rest states within 1e-16 rad."""
    close = (soft(couple=0.5, angle=0.49999999999999994), soft(couple=np.inf, angle=0.5))
    form = parabola_with(Guard(None, close), [0.0, 0.0, 0.0])
    form = replace(form, quadratic=np.diag([1.0, -1.0, 1.0]), linear=np.array([0.0, -3e-17, 0.0]))
    assert proved(form).outcome is SearchOutcome.UNDECIDED


def test_a_rest_state_at_the_angle_of_a_stiff_guard_is_isolated():
    """Its slope has no jump, so uniqueness follows from the bounds on its second derivative."""
    form = parabola_with(Guard(None, (soft(stiffness=3.0),)), [0.3, 0.5, -0.2])
    found = proved(form)
    assert found.outcome is SearchOutcome.PROVED
    (zero,) = found.inside
    assert not zero.at_kink


def test_an_enclosure_contains_the_state_at_the_exact_angle():
    """An angle of a config is a decimal; with a steep coupling its distance to a double counts."""
    steep, angle = 1e8, 0.1
    form = parabola_with(Guard(None, (soft(couple=np.inf, angle=angle),)), [0.0, 0.7, -0.2])
    Q = np.diag([1.0, 1e17, 1.0])
    Q[0, 1] = Q[1, 0] = steep
    form = replace(form, quadratic=Q, linear=np.array([0.0, -1e18, 0.2]))
    kink = the_kink(form, angle)
    zero = isolated_kink_zero(form, kink, np.array([-steep * angle, angle, -0.2]))
    assert zero is not None
    exact = -Fraction(steep) * Fraction(1, 10)
    assert Fraction(zero.enclosure.low[0, 0]) < exact < Fraction(zero.enclosure.high[0, 0])
    # Also where the angle is rounded by as much as a double can be.
    for number in (kink.ends[0], kink.ends[1]):
        place = -Fraction(steep) * Fraction(number)
        assert Fraction(zero.enclosure.low[0, 0]) < place < Fraction(zero.enclosure.high[0, 0])


def test_newton_does_not_converge_where_the_guard_cannot_hold():
    form = parabola_with(Guard(None, (soft(couple=0.1),)), CENTRE)
    kink = the_kink(form, 0.5)
    Theta, last = newton_at_kink(form, kink, np.zeros((1, 3)))
    np.testing.assert_allclose(Theta, [[0.3, 0.5, -0.2]])
    assert last[0] == np.inf
    kink = the_kink(form, -0.5)
    assert newton_at_kink(form, kink, np.zeros((1, 3)))[1][0] == np.inf
