"""Protects the bounds of soft guards and stops: at angles, over intervals, at their soft angle.

They are held against the energies and slopes that the elements state, in balls of many bits.
"""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from support.rest import system_of

from rbstab.analysis.exact import decimals
from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.separate import NotInProofsError, guard_of, guards_apart
from rbstab.analysis.proof.guards.soft import SoftEnergy, soft_energies
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.guards.soft_guards import RepellingGuard, SoftGuard, StiffGuard
from rbstab.elements.guards.stop import Stop

seeds = st.integers(0, 2**32)

NAMES: dict[type[SoftGuard], str] = {StiffGuard: "stiffness", RepellingGuard: "couple"}
KINDS = list(NAMES)


@pytest.fixture(autouse=True)
def _precision():
    with ctx.workprec(300):
        yield


def number(value):
    """Return the decimal that a double means, as an array of no axes."""
    return decimals(np.array(value))


def element(kind, strength, angle, mode=(1.0, 0.0), numbers=number):
    gains = {NAMES[kind]: numbers(strength), "soft_angle": numbers(angle)}
    return kind(name="range", mode=np.array(mode), **gains)


def energy(kind, strength, angle):
    (found,) = soft_energies([element(kind, strength, angle)])
    return found


def stated(kind, strength, angle, pitch):
    """Return the energy and the slope that the element states at θ2, as balls."""
    mode = (float(pitch > angle), float(-pitch > angle))
    one = element(kind, strength, angle, mode, lambda value: arb(repr(value)))
    return arb(0) + one.energy(arb(pitch)), arb(0) + one.slope(arb(pitch))


def contains(low, high, value):
    return arb(float(low)) <= value <= arb(float(high))


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from(KINDS))
def test_bounds_contain_what_the_element_states(seed, kind):
    rng = np.random.default_rng(seed)
    strength, angle = 10.0 ** rng.uniform(-3, 5), rng.uniform(0.05, 1.5)
    one = energy(kind, strength, angle)
    near = angle * (1 + rng.choice([-1, 1], 6) * 10.0 ** rng.uniform(-15, -1, 6))
    pitch = np.concatenate([near, -near, rng.uniform(-1.57, 1.57, 12)])
    low, high = one.at(pitch, 3)
    approximate = one.approximate(pitch, 3)
    for n, at in enumerate(pitch.tolist()):
        for order, value in enumerate(stated(kind, strength, angle, at)):
            assert contains(low[order, n], high[order, n], value)
            assert abs(approximate[order][n] - float(value)) <= 1e-14 * strength
        if abs(abs(at) - angle) > 1e-14:
            assert high[0, n] - low[0, n] <= 1e-14 * strength
            assert high[1, n] - low[1, n] <= 1e-14 * strength
            acts = kind is StiffGuard and abs(at) > angle
            assert contains(low[2, n], high[2, n], arb(repr(strength)) * int(acts))
            assert high[2, n] - low[2, n] <= 1e-14 * strength
            assert low[3, n] == high[3, n] == 0


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from(KINDS))
def test_bounds_over_an_interval_hold_inside_and_are_attained(seed, kind):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.05, 1.5)
    one = energy(kind, 7.0, angle)
    low, high = np.sort(rng.uniform(-1.57, 1.57, 2))
    if rng.random() < 0.3:
        low, high = angle - 1e-12, angle + 1e-12
    least, most = one.over(np.array([low]), np.array([high]))
    inside = np.concatenate([[low, high], rng.uniform(low, high, 40), np.clip([0.0], low, high)])
    values = [stated(kind, 7.0, angle, pitch) for pitch in inside.tolist()]
    for order in range(2):
        found = [pair[order] for pair in values]
        assert all(contains(least[order, 0], most[order, 0], value) for value in found)
        assert min(map(float, found)) == pytest.approx(least[order, 0], rel=1e-12, abs=1e-12)
        assert max(map(float, found)) == pytest.approx(most[order, 0], rel=1e-12, abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from(KINDS))
def test_the_expansion_about_the_centre_holds_over_the_interval(seed, kind):
    """g(θ) is g(m) + sδ + ½cδ² for an s and a c within bounds, and its slope s + cδ."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.05, 1.5)
    low, high = np.sort(angle * rng.choice([-1, 1]) + rng.uniform(-0.3, 0.3, 2))
    centre = 0.5 * (low + high)
    found = energy(kind, 7.0, angle).between(*(np.array([x]) for x in (low, high, centre)))
    assert found.jumps[0] == (
        kind is RepellingGuard and bool(low < angle < high or low < -angle < high)
    )
    for pitch in np.linspace(low, high, 21).tolist():
        value, slope = map(float, stated(kind, 7.0, angle, pitch))
        d = pitch - centre
        ends = [s[0] * d + 0.5 * c[0] * d * d for s in found.slope for c in found.curvature]
        assert found.value[0][0] + min(ends) - 1e-13 <= value
        assert value <= found.value[1][0] + max(ends) + 1e-13
        ends = [s[0] + c[0] * d for s in found.slope for c in found.curvature]
        assert min(ends) - 1e-13 <= slope <= max(ends) + 1e-13


def test_each_number_that_rounds_to_the_angle_is_covered():
    """0.1 is no double: the bounds at the double 0.1 contain both sides of the jump."""
    one = energy(RepellingGuard, 3.0, 0.1)
    low, high = one.at(np.array([0.1, -0.1]), 1)
    assert low[1].tolist() == [0.0, pytest.approx(-3.0)]
    assert high[1].tolist() == [pytest.approx(3.0), 0.0]
    assert np.all(one.at(np.array([0.1]), 2)[1][2] == np.inf)
    assert one.inner < 0.1 < one.outer


def test_a_stop_allows_any_couple_and_adds_no_energy():
    guard = guard_of([Stop(name="end", angle=number(0.7), restitution=number(0.5))])
    assert guard is not None
    assert guard.closed
    assert guard.stop == 0.7
    assert guard.end > 0.7
    low, high = guard.over(np.array([0.6, 0.6, -0.7]), np.array([0.65, 0.7, 0.0]))
    assert low[0].tolist() == high[0].tolist() == [0.0, 0.0, 0.0]
    assert low[1].tolist() == [0.0, 0.0, -np.inf]
    assert high[1].tolist() == [0.0, np.inf, 0.0]
    assert guard.approximate(np.array([0.9]), 1)[1][0] == 0


def test_guards_with_one_angle_are_added_up_exactly():
    guards = [element(RepellingGuard, x, 0.3) for x in (0.1, 0.2)]
    guards += [element(StiffGuard, 5.0, 0.3), element(StiffGuard, 2.0, 0.2)]
    assert soft_energies(guards) == (SoftEnergy(0.0, 2.0, 0.2), SoftEnergy(0.3, 5.0, 0.3))


def test_guards_beyond_a_stop_never_act():
    stops = [
        Stop(name=n, angle=number(a), restitution=number(0.0)) for n, a in (("a", 0.6), ("b", 0.5))
    ]
    guards = [element(StiffGuard, 5.0, angle) for angle in (0.4, 0.5, 0.55)]
    found = guard_of([*guards, *stops])
    assert found is not None
    assert [one.angle for one in found.soft] == [0.4, 0.5]
    assert found.stop == 0.5


def test_a_guard_that_begins_just_inside_a_stop_acts():
    """At 0.49999999999999994 it may hold the body, where the stop at 0.5 is not reached."""
    inside = 0.49999999999999994
    stop = Stop(name="end", angle=number(0.5), restitution=number(0.5))
    found = guard_of([element(RepellingGuard, 0.5, inside), stop])
    assert found is not None
    assert [one.angle for one in found.soft] == [inside, 0.5]


def test_guards_are_taken_apart_and_others_stay():
    system = system_of("permanent")
    guard = element(StiffGuard, 5.0, 0.3)
    barrier = Barrier(name="b", stiffness=number(1.0), outer_stiffness=number(0.0))
    joined = replace(system, elements=(guard, *system.elements, barrier))
    others, guards = guards_apart(joined)
    assert others.elements == system.elements
    assert guards == [guard, barrier]
    assert guard_of([]) is None
    assert guard_of([element(StiffGuard, 0.0, 0.3)]) is None
    for name in ("stiffness", "outer_stiffness"):
        with pytest.raises(NotInProofsError):
            guard_of([replace(barrier, **{name: number(-1.0)})])
    found = guard_of([barrier, replace(barrier, outer_stiffness=number(0.3))])
    assert found == Guard(BarrierEnergy(2.0), (), BarrierEnergy(0.3, half=True))


class Cubic(StiffGuard):
    """A guard with another energy."""

    def energy(self, angle):
        above, below = self._excess(angle)
        return self.stiffness * (above * above * above + below * below)


class Uneven(RepellingGuard):
    """A guard that acts on one side alone."""

    def energy(self, angle):
        return self.couple * self._excess(angle)[0]


@pytest.mark.parametrize(("kind", "name"), [(Cubic, "stiffness"), (Uneven, "couple")])
def test_a_guard_that_states_another_energy_is_refused(kind, name):
    one = kind(name="range", soft_angle=number(0.5), **{name: number(2.0)})
    with pytest.raises(ValueError, match="soft guard"):
        soft_energies([one])
