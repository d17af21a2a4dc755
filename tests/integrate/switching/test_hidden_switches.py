"""No switch is missed: two within one step, several at one instant, and one at the start."""

import numpy as np
import pytest
from support.switching import ENGINES, INERTIA, data, guard, ligament, problem, solved

from rbstab.integrate.events import TESTS_PER_STEP, first_event
from rbstab.integrate.switching.phase import Phases
from rbstab.systems.modes import modes_of

EACH = pytest.mark.parametrize("engine_name", ENGINES)

SPIN = 1.3


def modes(trajectory):
    """Return the modes at each sample."""
    return [modes_of(system) for system in trajectory.systems]


# --- Two switches within one step.


@pytest.fixture
def turning():
    """A problem whose θ2 is below the soft angle of a guard."""
    return problem(data({"soft": guard("stiff", 40.0)}))


def searched(problem, angle, rate, length=1.0, off=0.0):
    """Return the first switch of a step in which θ2 follows a function of time.

    The last state is off the path by a number of rad.
    """
    phase, size = Phases(problem).first, problem.system.audited_size

    def state(t):
        y = np.zeros((size, *np.shape(t)))
        y[1], y[4] = angle(t), rate(t)
        return y

    ends = np.array([state(0.0), state(length)])
    ends[1, 1] += off
    rates = np.zeros((2, size))
    rates[:, 1] = ends[:, 4]
    slopes = [
        phase.margin_rates(y, t, f) for y, t, f in zip(ends, (0.0, length), rates, strict=True)
    ]
    return first_event(phase.margins, state, (0.0, length), tuple(ends), slopes)


TOPS = (0.01, 0.06, 0.125, 0.3, 0.5, 0.61, 0.94, 0.99)


@pytest.mark.parametrize(
    ("top", "height"),
    [(top, height) for height in (1e-3, 1e-6, 1e-10) for top in TOPS if top**2 > 2 * height],
)
def test_a_crossing_and_return_between_two_tests_is_found(turning, top, height):
    """θ2 is a parabola that exceeds θ_s by so little that every test is below it."""
    curvature = 0.5
    switch = searched(
        turning,
        lambda t: 0.3 + height - curvature * (t - top) ** 2,
        lambda t: -2 * curvature * (t - top),
    )
    half = np.sqrt(height / curvature)
    assert switch is not None
    assert switch.number == 0
    assert abs(switch.time - (top - half)) < 1e-6 * half + 1e-13 / half
    if height < 1e-6:
        tests = np.linspace(0, 1, TESTS_PER_STEP + 1)
        assert (np.abs(tests - top) > half).all() or top in tests


def test_the_first_of_several_switches_is_returned(turning):
    """θ2 oscillates beyond both angles within the step."""
    switch = searched(turning, lambda t: 0.5 * np.sin(9 * t), lambda t: 4.5 * np.cos(9 * t))
    assert switch is not None
    assert switch.number == 0
    assert abs(switch.time - np.arcsin(0.6) / 9) < 1e-12


@EACH
@pytest.mark.parametrize("method", ["stiff", "repelling"])
def test_a_short_touch_within_one_step_is_followed(engine_name, method):
    """θ2 turns back by an attitude spring: it touches the guard for a hundredth of a period.

    The guard is so strong that a motion without the touch would be far off. The energy is that of
    the start, and the motion after the touch that of an earlier turn.
    """
    stiffness, reach = 4.0, 0.3 + 1e-5
    spring = {"kind": "attitude", "K": [stiffness] * 3, "L": [1e-30] * 3}
    start = {"orientation": [0, -reach, 0]}
    elements = {"soft": guard(method, 1e4 if method == "stiff" else 50.0), "turn": spring}
    config = data(elements, start, {"duration": 30.0, "samples": 301})
    trajectory = solved(config, engine_name)
    assert trajectory.status == "completed"
    visited = set(modes(trajectory))
    assert visited <= {(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)}
    # The potential energy of the start is within the guard's range; it returns at every turn.
    alone = solved(config | {"elements": {"turn": spring}}, engine_name)
    assert np.abs(trajectory.states[:, 1] - alone.states[:, 1]).max() > 1e-3
    energies = [
        system.observe(state).energy.sum()
        for system, state in zip(trajectory.systems, trajectory.states, strict=True)
    ]
    np.testing.assert_allclose(energies, energies[0], rtol=1e-11)
    assert np.abs(trajectory.states[:, 1]).max() <= reach * (1 + 1e-11)


# --- Several switches at one instant.


@EACH
@pytest.mark.parametrize("count", [2, 4])
def test_ligaments_that_go_taut_at_one_instant(engine_name, count):
    """Together they move the body as one ligament of their common stiffness does."""
    start = {"velocity": [1.1, 0, 0]}
    many = {f"a{i}": ligament(-1.0, stiffness=80.0 / count) for i in range(count)}
    many |= {f"b{i}": ligament(1.0, stiffness=80.0 / count) for i in range(count)}
    single = {"a0": ligament(-1.0), "b0": ligament(1.0)}
    together = solved(data(many, start), engine_name)
    alone = solved(data(single, start), engine_name)
    assert together.status == "completed"
    np.testing.assert_allclose(together.states, alone.states, rtol=0, atol=1e-11)
    for modes_together, expected in zip(modes(together), modes(alone), strict=True):
        taut = np.array(modes_together).reshape(2, count, 2)
        assert (taut == taut[:, :1]).all()
        assert taut[:, 0].ravel().tolist() == list(expected)


@EACH
def test_switches_a_moment_apart_are_both_followed(engine_name):
    """Slack lengths that differ in the last digits: the second switch follows after 1e-16 s."""
    start = {"velocity": [1.1, 0, 0]}
    near = np.nextafter(1.0, 2.0)
    for length in (near, 1.0 + 1e-12, 1.0 + 1e-9):
        elements = {"a": ligament(-1.0, stiffness=40.0), "b": ligament(1.0, stiffness=40.0)}
        elements |= {
            "c": ligament(-1.0, stiffness=40.0, slack_length=float(length)),
            "d": ligament(1.0, stiffness=40.0, slack_length=float(length)),
        }
        trajectory = solved(data(elements, start), engine_name)
        alone = solved(data({"a": ligament(-1.0), "b": ligament(1.0)}, start), engine_name)
        assert trajectory.status == "completed"
        tolerance = 1e-11 + 200 * (length - 1.0)
        np.testing.assert_allclose(trajectory.states, alone.states, rtol=0, atol=tolerance)


# --- A start on a threshold.


@EACH
@pytest.mark.parametrize("spin", [SPIN, -SPIN])
def test_start_exactly_at_the_soft_angle(engine_name, spin):
    """Its mode is the one that it enters: the motion is that of a spring, or straight."""
    config = data(
        {"soft": guard("stiff", 40.0)},
        {"orientation": [0, 0.3, 0], "angular_velocity": [0, spin, 0]},
        {"duration": 0.4, "samples": 9},
    )
    trajectory = solved(config, engine_name)
    w = np.sqrt(40.0 / INERTIA)
    expected = 0.3 + (
        spin / w * np.sin(w * trajectory.times) if spin > 0 else spin * trajectory.times
    )
    np.testing.assert_allclose(trajectory.states[:, 1], expected, atol=1e-12)
    assert modes(trajectory)[0] == (float(spin > 0), 0.0)


@EACH
@pytest.mark.parametrize("pull", [9.81, -9.81])
def test_start_at_rest_at_the_slack_length_under_a_load(engine_name, pull):
    """Neither the event function nor its rate tells the mode: only the load does."""
    config = data(
        {"a": ligament(-1.0)},
        {"position": [0.3, 0, 0]},
        {"duration": 0.3, "samples": 31},
        gravity=[pull, 0, 0],
    )
    trajectory = solved(config, engine_name)
    assert trajectory.status == "completed"
    assert trajectory.systems[-1].elements[-1].mode[0] == float(pull > 0)
    fall = 0.3 + 0.5 * pull * trajectory.times**2
    if pull < 0:
        np.testing.assert_allclose(trajectory.states[:, 6], fall, atol=1e-12)
    else:
        assert (trajectory.states[5:, 6] < fall[5:]).all()
        energies = [
            system.observe(y).energy.sum()
            for system, y in zip(trajectory.systems, trajectory.states, strict=True)
        ]
        np.testing.assert_allclose(energies, energies[0], atol=1e-11)
