"""Steps of many sets at once are those of each alone, bit for bit."""

import numpy as np
import pytest
from support.exact_motions import state_after
from support.polynomial_sets import place_in_frame, state_of
from support.set_steps import LONGEST, assert_equal, exact_system, tried
from support.start_sets import VARIANTS, random_config, random_set, together

from rbstab.analysis.motion_proof.sets import set_step as step_module
from rbstab.analysis.motion_proof.sets.set_step import (
    FOR_POINTS,
    FOR_SETS,
)
from rbstab.analysis.motion_proof.step import moved_frames


@pytest.mark.parametrize("orders", [FOR_SETS, FOR_POINTS])
@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_steps_of_many_sets_are_those_of_each_alone(variant, coordinates, orders):
    """Bit for bit, in any order: sets of different sizes, places and lengths of steps."""
    config = random_config(variant, coordinates, 5)
    shape = {"variables": 2, "degree": 4} if orders is FOR_SETS else {"variables": 0, "degree": 0}
    sets = [
        random_set(config, seed, width=width, error=error, **shape)
        for seed, width, error in [(7, 1e-2, 1e-6), (8, 1e-4, 0.0), (9, 3.0, 1.0), (10, 3e-2, 1e-9)]
    ]
    scale, sets = sets[0][1], [one for one, _ in sets]
    longest = np.array([1.0, 0.3, 0.7, 2.0]) * LONGEST
    many = tried(config, together(*sets), scale, longest, orders)
    backwards = tried(config, together(*sets[::-1]), scale, longest[::-1], orders)
    assert 1 < many.proved.sum() < 4
    for k, one in enumerate(sets):
        alone = tried(config, one, scale, longest[k], orders)
        assert many.proved[k] == alone.proved[0] == backwards.proved[3 - k]
        if alone.proved[0]:
            assert_equal(many, k, alone, 0)
            assert_equal(backwards, 3 - k, alone, 0)


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_motions_of_points_end_in_their_sets(variant, coordinates):
    """Several single starts with errors at once, with the orders of points."""
    config, rng = random_config(variant, coordinates, 5), np.random.default_rng(6)
    found = [
        random_set(config, 7 + k, error=error, variables=0, degree=0)
        for k, error in enumerate((1e-6, 1e-14, 1e-9))
    ]
    sets, scale = [one for one, _ in found], found[0][1]
    for k, one in enumerate(sets):
        one.polynomial[:] += 0.01 * k * scale[:, np.newaxis]
    step = tried(config, together(*sets), scale, 3 * LONGEST, FOR_POINTS)
    assert step.proved.all()
    for k, one in enumerate(sets):
        w = one.radius[0] * rng.choice([-1.0, 1.0], len(scale))
        y = state_of(one, [], w.tolist())
        end = state_after(exact_system(config), y, float(step.h[k]))
        there = step.end[k : k + 1]
        assert np.all(np.abs(place_in_frame(there, [], end)) <= there.radius[0])
        assert np.all(there.error < 10 * one.error + 3e-11 * scale)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_set_at_the_end_without_bounds_is_not_proved(monkeypatch, bad):
    """One radius that is not finite is enough, and only for its own set."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7, width=1e-3, error=1e-9)
    original = moved_frames

    def moved(*given):
        frame, radius = original(*given)
        radius[1, 4] = bad
        return frame, radius

    monkeypatch.setattr(step_module, "moved_frames", moved)
    found = tried(config, together(states, states, states), scale)
    assert found.proved.tolist() == [True, False, True]
