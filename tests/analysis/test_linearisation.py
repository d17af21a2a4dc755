"""The linearised system agrees with closed solutions, finite differences and long runs."""

from dataclasses import replace

import numpy as np
import pytest
from support.problems import bare_system
from support.rest import system_of
from support.systems import VARIANTS

from rbstab.analysis.configuration import configurations
from rbstab.analysis.linearisation import eigenvalue_text, linearise
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.elements.gravity import Gravity
from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import ReducedCoordinates


def at_rest(variant, seed):
    """Return a random system under a light load, its rest state, and its linearisation there."""
    system = system_of(variant, seed)
    gravity = system.elements[0]
    assert isinstance(gravity, Gravity)
    light = Gravity(0.1 * gravity.weight)
    system = replace(system, elements=(light, *system.elements[1:]))
    rest = nearest_rest_state(system)
    assert rest.rests_in_range
    return system, rest, linearise(system, rest.motion, rest.element_states)


def test_oscillators_in_closed_form():
    """A body on stabilizers alone: mẍ + Lẋ + Kx = 0 and Jθ̈ + Lθ̇ + Kθ = 0 on each axis."""
    mass, J = 2.0, np.array([3.0, 4.0, 5.0])
    K_t, L_t = np.array([50.0, 90.0, 2.0]), np.array([4.0, 1.0, 7.0])
    K_r, L_r = np.array([7.0, 80.0, 30.0]), np.array([0.5, 9.0, 60.0])
    body = Body(mass, np.diag(J), np.array([0.1, 0.2, 0.3]))
    system = bare_system(
        body, K_t=np.diag(K_t), L_t=np.diag(L_t), K_r=np.diag(K_r), L_r=np.diag(L_r)
    )
    rest = nearest_rest_state(system)
    linear = linearise(system, rest.motion, rest.element_states)
    expected = []
    for inertia, damping, stiffness in [
        *zip([mass] * 3, L_t, K_t, strict=True),
        *zip(J, L_r, K_r, strict=True),
    ]:
        expected += list(np.roots([inertia, damping, stiffness]))
    assert np.sort_complex(linear.eigenvalues) == pytest.approx(np.sort_complex(expected), abs=1e-9)
    # The lightly damped first axis: ω = √(K/m), ζ = L / (2√(Km)), τ = 2m/L.
    mode = int(np.argmin(np.abs(linear.natural_frequencies - 5.0)))
    assert linear.damping_ratios[mode] == pytest.approx(4.0 / (2 * np.sqrt(50.0 * 2)))
    assert linear.time_constants[mode] == pytest.approx(2 * mass / 4.0)
    assert linear.growing == 0


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_matrix_is_that_of_finite_differences(variant):
    system, rest, linear = at_rest(variant, 1)
    still = configurations(system).system
    y = still.start(rest.motion, rest.element_states)
    for k, column in enumerate(linear.matrix.T):
        h = np.zeros(len(y))
        h[k] = 1e-5
        central = (still.rates(y + h) - still.rates(y - h)) / 2e-5
        assert column == pytest.approx(central, rel=1e-5, abs=1e-5 * np.abs(linear.matrix).max())
    assert linear.matrix @ linear.modes == pytest.approx(
        linear.modes * linear.eigenvalues, abs=1e-7 * np.abs(linear.matrix).max()
    )


def test_an_unstable_rest_state_is_told():
    """A held body upside down falls over: its centre is above C."""
    body = Body(2.0, np.diag([3.0, 4.0, 5.0]), np.array([0.0, 0.0, -0.5]))
    system = bare_system(
        body, ReducedCoordinates(), weight=(0, 0, -20.0), K_r=4.0 * np.eye(3), L_r=0.1 * np.eye(3)
    )
    upright = system.motion(np.zeros(6))
    linear = linearise(system, upright, np.zeros(0))
    # About x and y: (J + m/4)θ̈ + 0.1θ̇ + (4 - 20 · 0.5)θ = 0.
    expected = max(np.roots([3.5, 0.1, -6.0]).real), max(np.roots([4.5, 0.1, -6.0]).real)
    assert linear.growing == 2
    assert sorted(linear.eigenvalues.real)[-2:] == pytest.approx(sorted(expected))
    assert np.isinf(linear.time_constants[:2]).all()
    assert (linear.damping_ratios[:2] < 0).all()


@pytest.mark.parametrize(
    ("eigenvalue", "text"),
    [
        (-9.93 + 0j, "-9.93"),
        (0j, "0"),
        (-24.42 + 2.919e-14j, "-24.42 (twice)"),
        # The imaginary part may be more than round-off.
        (-24.42 + 1e-5j, "-24.42 ± 1e-05i"),
        (-2.927 + 7.506j, "-2.927 ± 7.506i"),
        # Slow motions that oscillate, however weakly they are damped.
        (-1e-12 + 8.0j, "-1e-12 ± 8i"),
        (-1e-12 + 1e-12j, "-1e-12 ± 1e-12i"),
    ],
)
def test_round_off_is_not_written_as_an_oscillation(eigenvalue, text):
    assert eigenvalue_text(eigenvalue) == text
