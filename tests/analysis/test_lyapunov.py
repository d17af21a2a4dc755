"""The trace of v: its value, and the residual of the energy balance."""

import numpy as np
import pytest

from rbstab.analysis.lyapunov import energy_scale, lyapunov_trace


def damped_oscillator(times):
    """Return kinetic and stored energy of x = e^-t cos 2t.

    The oscillator has mass 1, stiffness 5 and damping 2.
    """
    x = np.exp(-times) * np.cos(2 * times)
    v = -np.exp(-times) * (np.cos(2 * times) + 2 * np.sin(2 * times))
    kinetic, stored = 0.5 * v**2, 2.5 * x**2
    return kinetic, stored


def test_trace_of_a_damped_oscillator_under_a_load():
    times = np.linspace(0, 3, 31)
    kinetic, stored = damped_oscillator(times)
    # Under a load the rest state has 7 J less than the unloaded position.
    energy = np.column_stack([kinetic, stored - 7.0])
    fallen = kinetic + stored - (kinetic[0] + stored[0])
    value, residual = lyapunov_trace(energy, fallen, -7.0)
    np.testing.assert_allclose(value, kinetic + stored, rtol=0, atol=1e-14)
    np.testing.assert_allclose(residual, 0, atol=1e-14)


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
