"""Steps of sets of motions: all exact motions end in the set at the end."""

import numpy as np
import pytest
from support.exact_motions import state_after
from support.polynomial_sets import place_in_frame, state_of
from support.set_steps import ends, exact_system, stepped
from support.start_sets import VARIANTS, random_config, random_set

from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.mechanics.derivatives import jacobian


@pytest.mark.parametrize(("error", "width"), [(1e-6, 1e-2), (0.0, 1e-3), (1e-13, 3e-3)])
@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_all_motions_end_in_the_set(variant, coordinates, error, width):
    """Corners and inner points, in wide sets and in those where only rounding counts."""
    config, rng = random_config(variant, coordinates, 5), np.random.default_rng(6)
    states, scale = random_set(config, 7, width=width, error=error)
    step = stepped(config, states, scale)
    starts = [
        (rng.choice([-1.0, 1.0], 2), states.radius[0] * rng.choice([-1.0, 1.0], len(scale))),
        (rng.uniform(-1, 1, 2), states.radius[0] * rng.uniform(-1, 1, len(scale))),
    ]
    for place in ends(config, states, step, starts):
        # The comparison is in doubles, with errors far below the smallest part of the bound.
        assert np.all(np.abs(place) <= 1 + 1e-12)


@pytest.mark.parametrize(("variant", "coordinates"), [VARIANTS[1], VARIANTS[2]])
def test_the_errors_of_all_starts_are_not_far_below_their_bound(variant, coordinates):
    """Towards the corner of w that reaches farthest along an axis, the bound is nearly reached."""
    config = random_config(variant, coordinates, 5)
    states, scale = random_set(config, 7, width=1e-7, error=1e-9)
    step, n = stepped(config, states, scale), len(scale)
    z = np.array([0.5, -1.0])
    start = state_of(states, z.tolist(), np.zeros(n))
    doubles = enclosed_system(config, lambda values: values)
    h_J = step.h[0] * jacobian(doubles.rates, np.array([float(x) for x in start]))
    flow = np.linalg.matrix_power(np.eye(n) + h_J / 4096, 4096)
    moved = np.linalg.solve(step.end.frame[0], flow @ states.frame[0])
    reached = [
        abs(place[axis])
        for axis in (0, n // 2, n - 1)
        for place in ends(config, states, step, [(z, states.radius[0] * np.sign(moved[axis]))])
    ]
    assert min(reached) > 0.99


def test_steps_one_after_the_other():
    """The set at the end of a step is the beginning of the next one."""
    rng = np.random.default_rng(3)
    config = random_config("visco-elastic", "Z", 8)
    states, scale = random_set(config, 9, width=1e-3, error=0.0)
    z = rng.choice([-1.0, 1.0], 2)
    y = state_of(states, z.tolist(), np.zeros(12))
    for _ in range(2):
        step = stepped(config, states, scale)
        y = state_after(exact_system(config), y, float(step.h[0]))
        states = step.end
        assert np.all(np.abs(place_in_frame(states, z.tolist(), y)) <= states.radius[0])
    assert states.error.max() < 1e-9
