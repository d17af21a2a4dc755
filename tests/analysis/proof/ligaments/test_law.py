"""Protects the energy of a ligament as a function of ℓ²: its bounds, and that it is the element's.

Exact values are in balls of 400 bits, by the law as it is printed; derivatives are their
differences.
"""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx
from support.ligaments import ligament_of

from rbstab.analysis.proof.ligaments.law import LigamentEnergy, ligament_energy
from rbstab.analysis.proof.lines.intervals import Intervals, between
from rbstab.elements.ligament import Ligament

STEP = 2.0**-50
LAWS = [(400.0, 0.3, 0.05), (2.0e5, 0.03, 0.03), (50.0, 1.7, 0.6)]


def exact_energy(law, square):
    """Return ∫ T dℓ at a ball of ℓ²."""
    k, slack, toe = (arb(one) for one in law)
    strain = square.sqrt() / slack - 1
    if strain <= 0:
        return arb(0)
    if strain <= 2 * toe:
        return slack * k * strain * strain * strain / (12 * toe)
    beyond = strain - toe
    return slack * k * (beyond * beyond / 2 + toe * toe / 6)


def exact_derivative(law, square, order):
    """Return a derivative by s as a central difference; the error is about 1e-26."""
    weights = {0: {0: 1}, 1: {1: 1, -1: -1}, 2: {2: 1, 0: -2, -2: 1}}
    weights[3] = {3: 1, 1: -3, -1: 3, -3: -1}
    total = arb(0)
    for place, weight in weights[order].items():
        total += weight * exact_energy(law, arb(square) + place * arb(STEP))
    return total / (2 * arb(STEP)) ** order


def squares_of(law, rng, count=40):
    """Return squares of lengths from slack to far beyond the toe, none at a change of the law."""
    ratios = rng.uniform(0.3, 1.5 + 4 * law[2], size=count)
    return (law[1] * ratios) ** 2


@pytest.mark.parametrize("law", LAWS)
def test_bounds_at_points_contain_the_derivatives(law):
    squares = squares_of(law, np.random.default_rng(0))
    found = LigamentEnergy(*law).bounds(Intervals(squares, np.zeros_like(squares)), 3)
    near = LigamentEnergy(*law).at(squares)
    scale = law[0] * law[1]
    with ctx.workprec(400):
        for order in range(4):
            unit = scale / law[1] ** (2 * order)
            for k, square in enumerate(squares):
                exact = exact_derivative(law, square, order)
                low, high = found[order].low[k], found[order].high[k]
                slack = 1e-18 * unit
                assert low - slack <= float(exact) <= high + slack
                assert high - low <= 1e-11 * unit / law[2]
                if order < 3:
                    assert near[order][k] == pytest.approx(float(exact), rel=1e-9, abs=1e-12 * unit)


@pytest.mark.parametrize("law", LAWS)
def test_bounds_over_intervals_contain_all_values_between(law):
    rng = np.random.default_rng(1)
    low = squares_of(law, rng, 60)
    high = low * rng.uniform(1.0, 2.5, size=60)
    energy = LigamentEnergy(*law)
    found = energy.bounds(between(low, high), 3)
    tension, excess = energy.tension(between(low, high)), energy.excess(between(low, high))
    for share in np.linspace(0, 1, 23):
        inside = low + share * (high - low)
        at = energy.bounds(Intervals(inside, np.zeros_like(inside)), 3)
        for order in range(4):
            assert np.all(found[order].low <= at[order].high)
            assert np.all(at[order].low <= found[order].high)
        T, more = 2 * np.sqrt(inside) * at[1].middle, 4 * inside * at[2].middle
        assert np.all((tension.low <= T * (1 + 1e-12)) & (tension.high >= T * (1 - 1e-12)))
        assert np.all((excess.low <= more * (1 + 1e-12)) & (more * (1 - 1e-12) <= excess.high))


@pytest.mark.parametrize("order", range(4))
def test_bounds_over_an_interval_are_not_much_wider_than_its_values(order):
    law = LAWS[0]
    low, high = np.array([0.31**2]), np.array([0.315**2])
    found = LigamentEnergy(*law).bounds(between(low, high), order)[order]
    inside = np.linspace(low[0], high[0], 101)
    values = LigamentEnergy(*law).bounds(Intervals(inside, np.zeros(101)), order)[order].middle
    assert found.high[0] - found.low[0] <= 1.6 * np.ptp(values)


@np.errstate(all="ignore")  # as in the searches
def test_of_an_unknown_length_only_what_holds_for_all_is_known():
    """G grows beyond all bounds; G″ has a largest value."""
    energy = LigamentEnergy(*LAWS[0])
    value, _, bend = energy.bounds(Intervals(np.array([np.nan]), np.array([np.nan])), 2)
    assert not value.high[0] < 1e300
    squares = np.linspace(0, 4, 10_000)
    assert np.all(energy.at(squares)[2] <= bend.high[0])


def test_the_law_is_that_of_the_element():
    energy = ligament_energy(ligament_of(stiffness=0.4, slack_length=0.3, toe_strain=0.1))
    assert vars(energy) == {"stiffness": 0.4, "slack_length": 0.3, "toe_strain": 0.1}


class Softer(Ligament):
    """A ligament with another toe."""

    def energy(self, strain):
        """Return half of the energy in the toe."""
        return super().energy(strain) * (0.5 + 0.5 * self.mode[1])


class Longer(Ligament):
    """A ligament whose energy jumps at the end of its toe."""

    def energy(self, strain):
        """Add a constant beyond the toe."""
        return super().energy(strain) + self.mode[1]


@pytest.mark.parametrize("kind", [Softer, Longer])
def test_an_element_with_another_energy_is_refused(kind):
    given = replace(ligament_of(), name="other")
    other = kind(**{name: getattr(given, name) for name in vars(given)})
    with pytest.raises(ValueError, match="another energy"):
        ligament_energy(other)


@pytest.mark.parametrize("toe", [1e-3, 1e-5, 1e-7])
def test_the_largest_bends_at_the_end_of_a_small_toe_are_bounded(toe):
    """There T′ - T/ℓ is k (1 + ε_t)/(ℓ₀ (1 + 2 ε_t)), and G″ is this by 4ℓ²."""
    energy, border = LigamentEnergy(1.0, 1.0, toe), 1 + 2 * toe
    around = between(np.array([(1 + toe) ** 2]), np.array([(1 + 4 * toe) ** 2]))
    exact = (1 + toe) / border
    assert energy.excess(around).high[0] >= exact
    assert energy.bounds(around, 2)[2].high[0] >= exact / (4 * border**2)
