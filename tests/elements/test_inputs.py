"""What inputs supply, and what their signals are, against work along a path and closed forms."""

import math

import numpy as np
import pytest
from flint import arb
from scipy import stats
from support.differences import derivative
from support.elements import INPUT_CASES, case_id, random_element
from support.inputs import LEGS, value_at
from support.path import random_path
from support.systems import random_body

from rbstab.elements.coactivated import CoactivatedTie
from rbstab.elements.element import NO_STATE, Element
from rbstab.elements.inputs import legs
from rbstab.elements.inputs.loads import BodyCoupleInput, BodyForceInput, CoupleInput, ForceInput
from rbstab.elements.inputs.signals import Leg, Sine
from rbstab.elements.registry import ELEMENTS, NAMED_ELEMENTS
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import motion_from_centre
from rbstab.systems.schedule import schedule_of


def load_along(element, path, t):
    """Return the force and the couple of an input, inertial, from its signal alone."""
    size = element.amplitude * element.signal.value(t) * element.direction
    if isinstance(element, BodyForceInput | BodyCoupleInput):
        size = path.A(t) @ size
    none = np.zeros(3)
    return (size, none) if isinstance(element, ForceInput | BodyForceInput) else (none, size)


@pytest.mark.parametrize("case", INPUT_CASES, ids=case_id)
def test_a_load_acts_at_its_point_and_supplies_its_work_along_a_path(rng, case):
    """A force works along the path of its point; a couple along the turning A(t + τ) A(t)'."""
    for _ in range(5):
        element, path = random_element(rng, *case), random_path(rng, random_body(rng))
        t = float(rng.normal())
        force, couple = load_along(element, path, t)
        point = getattr(element, "point", np.zeros(3))
        speed = derivative(lambda s, p=path, r=point, t=t: p.X(t + s) + p.A(t + s) @ r)
        spin = derivative(lambda s, p=path, t=t: p.A(t + s)) @ path.A(t).T
        turning = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        motion = motion_from_centre(path.body, np.zeros(3), path.Z(t))._replace(time=t)
        expected = force @ speed + couple @ turning
        scale = np.abs(force) @ np.abs(speed) + np.abs(couple) @ np.abs(turning)
        assert abs(element.supplied(motion, NO_STATE) - expected) < 1e-8 * scale
        # It is neither stored nor dissipated.
        assert element.stored(motion, NO_STATE) == element.dissipated(motion, NO_STATE) == 0
        wrench, A = element.wrench(motion, NO_STATE), path.A(t)
        np.testing.assert_allclose(wrench.force, force, atol=1e-12)
        moment = np.cross(A @ point, force) + couple
        np.testing.assert_allclose(A @ wrench.couple, moment, atol=1e-9)


def test_only_inputs_and_muscles_supply():
    """Whether an element supplies follows from its statements; all others stay passive."""
    supplying = {kind for kind in (*ELEMENTS, *NAMED_ELEMENTS) if kind.supplies}
    assert supplying == {ForceInput, BodyForceInput, CoupleInput, BodyCoupleInput, CoactivatedTie}

    class Motor(Element):
        def supplied(self, motion, states):
            return 1.0

    assert Motor.supplies


def test_a_sine_through_other_numbers():
    sine = Sine(1.5, 0.25)
    slope = jacobian(lambda t: sine.value(t[0]), np.array([0.7]))[0]
    angle = 2 * math.pi * 1.5 * 0.7 + 0.25
    np.testing.assert_allclose(slope, 2 * math.pi * 1.5 * math.cos(angle), rtol=1e-14)
    assert Sine(arb(1.5), arb(0.25)).value(arb(0.7)).overlaps(arb(math.sin(angle), 1e-14))


MADE = {
    "pulse": lambda s: legs.pulse(s["start"], s["duration"]),
    "ramp": lambda s: legs.ramp(s["start"], s["duration"]),
    "table": lambda s: legs.table(np.array(s["times"]), np.array(s["values"])),
}


def value_of_legs(made, t):
    """Return the value at a time of the leg that a schedule gives for it."""
    schedule = schedule_of({"one": made})
    return Leg(*schedule.legs_at(t)[0].tolist()).value(t)


@pytest.mark.parametrize("kind", MADE)
def test_legs_are_the_signal(rng, kind):
    """At random times, at every breakpoint, where the new leg counts, and beside it."""
    signal = LEGS[kind]
    made = MADE[kind](signal)
    edges = made[1:, 2]
    times = np.concatenate([rng.uniform(-0.5, 1.5, 200), edges, edges - 1e-9, edges + 1e-9])
    values = [value_of_legs(made, t) for t in times.tolist()]
    np.testing.assert_allclose(values, value_at(signal, times), atol=1e-12)


def test_a_table_with_rows_at_one_time():
    """Several jumps at one time leave the last value, also at the first and at the last time."""
    made = legs.table(np.array([0.0, 0.0, 1.0, 1.0, 1.0]), np.array([5.0, 1.0, 2.0, 7.0, 3.0]))
    times = [-1.0, 0.0, 0.5, 1.0, 9.0]
    assert [value_of_legs(made, t) for t in times] == [5.0, 1.0, 1.5, 3.0, 3.0]


def test_a_schedule_of_several_inputs(rng):
    """Each input keeps its own legs at the breakpoints of the others."""
    made = {kind: make(LEGS[kind]) for kind, make in MADE.items()}
    together = schedule_of(made)
    expected = sorted({t for table in made.values() for t in table[1:, 2].tolist()})
    assert together.breakpoints.tolist() == expected
    before = np.nextafter(expected, -1).tolist()
    for t in [*rng.uniform(-0.2, 1.2, 100).tolist(), *expected, *before]:
        values = [Leg(*leg).value(t) for leg in together.legs_at(t).tolist()]
        np.testing.assert_array_equal(values, [value_of_legs(table, t) for table in made.values()])
    assert together.between(expected[0], expected[-1]) == expected[1:-1]
    assert together.between(-1.0, 9.0) == expected


def test_noise_is_the_process_that_it_says():
    """Mean 0, variance 1, correlation e^(-τ/T), and a normal distribution; 5 standard errors."""
    rate, T, count = 20.0, 0.1, 100_000
    x = legs.noise(11, rate, T, (count - 1) / rate)[1:-1, 0]
    assert len(x) == count - 1
    # The variance of a mean of correlated numbers is larger by (1 + ρ)/(1 - ρ).
    rho = math.exp(-1 / (rate * T))
    error = 5 * math.sqrt((1 + rho) / (1 - rho) / count)
    assert abs(x.mean()) < error
    assert abs(x.var() - 1) < error * math.sqrt(2)
    for lag in (1, 2, 5):
        assert abs(np.mean(x[lag:] * x[:-lag]) - rho**lag) < error * math.sqrt(2)
    # Numbers that are ten correlation times apart are independent.
    assert stats.kstest(x[::20], "norm").pvalue > 1e-3
    # The first number has the variance of all others: the process does not begin at rest.
    first = [legs.noise(seed, rate, T, 0.1)[0, 0] for seed in range(400)]
    assert stats.kstest(first, "norm").pvalue > 1e-3


def test_noise_of_a_seed_does_not_depend_on_the_duration():
    long, short = legs.noise(3, 7.0, 0.5, 9.0), legs.noise(3, 7.0, 0.5, 2.0)
    np.testing.assert_array_equal(short[1:-1], long[1 : len(short) - 1])
    assert short[-1, 2] >= 2.0
    other = legs.noise(4, 7.0, 0.5, 2.0)
    assert np.abs(other[:, 0] - short[:, 0]).min() > 1e-6
