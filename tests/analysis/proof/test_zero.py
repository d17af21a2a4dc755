"""An isolated zero has a tight enclosure, and a domain in which it is the only one."""

import numpy as np
import pytest
from support.rest import SADDLES, inverted_pendulum, paper_system

from rbstab.analysis.proof.boxes import box_around
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import Zero, isolated_zero, newton


@pytest.fixture
def form():
    return reduced_energy(inverted_pendulum([1.0, 3.0, 1.0], 2.0)).form


def proved_zero(form, Theta):
    """Return the zero at a point, where one must be proved."""
    zero = isolated_zero(form, np.array(Theta))
    assert zero is not None
    return zero


def root_of_the_pendulum():
    # The root of θ = 2 sin θ by iteration: the slope of 2 sin θ is -0.64 there.
    theta = 1.9
    for _ in range(200):
        theta = 2 * np.sin(theta)
    return theta


def test_newton_arrives_at_the_root(form):
    Theta, last = newton(form, np.array([[1.7, 0.1, 0.1], [0.1, 0.0, 0.0]]))
    np.testing.assert_allclose(Theta[0], [root_of_the_pendulum(), 0, 0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(Theta[1], 0, atol=1e-15)
    assert np.all(last < 1e-12)


def test_newton_says_where_it_does_not_arrive():
    straight = TrigonometricForm(np.zeros((3, 3)), np.ones(3), np.zeros((1, 1, 1)))
    start = np.array([[0.3, 0.2, 0.1]])
    Theta, last = newton(straight, start)
    np.testing.assert_array_equal(Theta, start)
    assert not last[0] < 1


def test_long_steps_are_cut(form):
    # At 1.05 the slope 1 - 2 cos θ1 is nearly zero: the step would go far beyond the range.
    start = np.array([[1.05, 0.01, 0.0]])
    Theta, last = newton(form, start, steps=1)
    assert last[0] > 10
    assert np.abs(Theta - start).max() == pytest.approx(0.5, rel=1e-12)


def test_zero_is_enclosed_to_round_off(form):
    root = root_of_the_pendulum()
    zero = proved_zero(form, [root, 0.0, 0.0])
    assert zero.radius < 1e-13
    assert box_around(np.array([root, 0.0, 0.0]), 0.0).intersects(zero.enclosure)[0]
    assert zero.enclosure.within(zero.domain)[0]


def test_domain_holds_no_other_zero(form):
    root = root_of_the_pendulum()
    zeros = [proved_zero(form, [theta, 0.0, 0.0]) for theta in (-root, 0.0, root)]
    for zero in zeros:
        assert sum(zero.domain_contains(other.Theta) for other in zeros) == 1
        assert zero.domain_contains(zero.Theta)
        assert zero.domain.radius.max() > 0.05


def test_point_near_a_zero_is_none_of_it(form):
    # Only large boxes reach the zero, so its enclosure is less tight.
    zero = proved_zero(form, [1e-3, 0.0, 0.0])
    assert 1e-3 < zero.radius < 1.5e-3
    assert isolated_zero(form, np.array([0.9, 0.0, 0.0])) is None


def test_double_zero_is_not_isolated():
    form = reduced_energy(inverted_pendulum([2.0, 3.0, 1.0], 2.0)).form
    assert isolated_zero(form, np.zeros(3)) is None


def test_proofs_of_one_zero_are_told_from_those_of_two(form):
    root = root_of_the_pendulum()
    first = proved_zero(form, np.zeros(3))
    again = proved_zero(form, [1e-4, 0, 0])
    other = proved_zero(form, [root, 0.0, 0.0])
    assert first.is_same_as(again) is True
    assert again.is_same_as(first) is True
    assert first.is_same_as(other) is False


def test_overlap_that_proves_nothing_is_said_to():
    def proof(centre):
        point = np.array([centre, 0.0, 0.0])
        return Zero(point, box_around(point, 1.0), box_around(point, 1.2))

    assert proof(0.0).is_same_as(proof(1.5)) is None
    assert proof(0.0).is_same_as(proof(3.0)) is False
    assert proof(0.0).is_same_as(proof(0.1)) is True


def test_paper_saddles_stay_where_the_facts_put_them():
    form = reduced_energy(paper_system("permanent", 0.1)).form
    for known in SADDLES:
        (Theta,), _ = newton(form, np.array([known]))
        np.testing.assert_allclose(Theta, known, rtol=0, atol=5e-4)
        assert proved_zero(form, Theta).radius < 1e-11
