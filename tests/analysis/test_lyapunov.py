"""The trace of v: its value, its rate, and the residual of the energy balance."""

import numpy as np
import pytest

from rbstab.analysis.lyapunov import energy_scale, lyapunov_trace
from rbstab.analysis.settling import value_round_off


def damped_oscillator(times):
    """Return kinetic energy, stored energy and loss of x = e^-t cos 2t.

    The oscillator has mass 1, stiffness 5 and damping 2.
    """
    x = np.exp(-times) * np.cos(2 * times)
    v = -np.exp(-times) * (np.cos(2 * times) + 2 * np.sin(2 * times))
    kinetic, stored = 0.5 * v**2, 2.5 * x**2
    return kinetic, stored, 2 * v**2


def test_trace_of_a_damped_oscillator_under_a_load():
    times = np.linspace(0, 3, 31)
    kinetic, stored, lost = damped_oscillator(times)
    # Under a load the rest state has 7 J less than the unloaded position.
    energy = np.column_stack([kinetic, stored - 7.0])
    fallen = kinetic + stored - (kinetic[0] + stored[0])
    trace = lyapunov_trace(energy, np.column_stack([0 * lost, lost]), fallen, -7.0)
    np.testing.assert_allclose(trace.value, kinetic + stored, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(trace.rate, -lost)
    np.testing.assert_allclose(trace.residual, 0, atol=1e-14)


def test_rate_is_the_slope_of_the_value():
    # A derivative by five points with a step of 1e-3 is good to 1e-11.
    step = 1e-3
    times = 0.4 + step * np.arange(-2, 3)
    kinetic, stored, lost = damped_oscillator(times)
    energy, dissipation = np.column_stack([kinetic, stored]), np.column_stack([0 * lost, lost])
    trace = lyapunov_trace(energy, dissipation, np.zeros(5), 0.0)
    slope = trace.value @ [1, -8, 0, 8, -1] / (12 * step)
    assert trace.rate[2] == pytest.approx(slope, rel=1e-10)


def test_residual_is_what_the_integral_misses():
    energy, dissipation = np.array([[3.0, 2.0], [1.0, 1.5]]), np.array([[0.0, 4.0], [0.0, 2.0]])
    trace = lyapunov_trace(energy, dissipation, np.array([0.0, -2.25]), -1.0)
    np.testing.assert_array_equal(trace.value, [6.0, 3.5])
    np.testing.assert_array_equal(trace.rate, [-4.0, -2.0])
    np.testing.assert_array_equal(trace.residual, [0.0, -0.25])


@pytest.mark.parametrize(
    ("value", "supplied", "round_off", "expected"),
    [
        # v(0), which is the largest v of a motion that nothing drives.
        ([4.0, 2.0, 1.0], None, 1e-16, 4.0),
        # A knock at rest: not v(0) and not v at the end, but the largest v, or what is supplied.
        ([0.0, 0.2, 1e-20], [0.0, 0.1, 0.1], 1e-16, 0.2),
        ([0.0, 0.2, 1e-20], [0.0, 0.25, 0.25], 1e-16, 0.25),
        # What inputs take counts as well.
        ([5.0, 1.0, 0.0], [0.0, -7.0, -7.0], 1e-16, 7.0),
        # Close to a rest state under a load: v has few digits.
        ([0.0, -1e-14, 1e-14], None, 5e-14, 5e-6),
        # A motion that diverges.
        ([3.0, np.inf, np.nan], None, 1e-16, 3.0),
    ],
)
def test_errors_are_relative_to_the_largest_energy(value, supplied, round_off, expected):
    supplied = None if supplied is None else np.array(supplied)
    assert energy_scale(np.array(value), round_off, supplied) == pytest.approx(expected)


def test_the_largest_energy_is_never_zero():
    nothing = np.zeros(3)
    assert energy_scale(nothing, value_round_off(lambda _: nothing, nothing), nothing) > 0
