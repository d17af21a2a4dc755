"""Sets of motions are followed until they are decided, halved or given up; their energies."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from support.motion_steps import equations, exact_system, some_starts
from support.polynomial_sets import BITS, state_of
from support.start_sets import VARIANTS, random_config, random_set, together

from rbstab.proof.motion import motion
from rbstab.proof.motion.motion import MAX_STEPS, followed
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.proof.motion.step import SetSteps

SMOOTH: Any = SimpleNamespace(switches=(), field=lambda: None)


def any_set(**options):
    return random_set(random_config("permanent", "reduced", 5), 7, **options)


def steps_of(monkeypatch, length_of):
    """Replace the proof of steps; `length_of` of the starts and the longest steps; NaN is none."""

    def step(_field, start, _scale, longest):
        h = length_of(start, longest)
        end = replace(start, polynomial=start.polynomial + 0.25 + 0 * h[:, None, None])
        return SetSteps(h, end.polynomial, end.error, end, np.isfinite(h))

    monkeypatch.setattr(motion, "set_steps", step)


def undecided(states, _times, _numbers):
    return [None] * len(states)


def test_the_limits_of_a_set(monkeypatch):
    """Its steps, its width, and the time up to which sums of times are exact."""
    states, scale = any_set()
    for radius, h, steps, lost in (
        (1e-4, 0.001, MAX_STEPS, False),
        (0.1, 0.001, 0, True),
        (np.nan, 0.001, 0, True),
        (1e-4, 1000.0, 4, True),
    ):
        steps_of(monkeypatch, lambda _, longest, h=h: 0 * longest + h)
        wide = replace(states, radius=np.full((1, 6), radius))
        (path,) = followed(SMOOTH, wide, scale, undecided)
        assert (path.lost, path.variable is None) == (lost, not lost)
        assert path.steps in {steps, steps + (not lost and 0)}


def test_each_set_keeps_its_own_place(monkeypatch):
    """Steps of a mix: proved, not proved, too wide, and decided. Times stay with them."""
    states, scale = any_set(error=1e-9)
    sets = together(*[states] * 4)
    sets.polynomial[:, 0, 0] = [0.0, 1.0, 2.0, 3.0]
    sets.radius[3] = 1.0

    def length(start, _longest):
        number = np.floor(start.polynomial[:, 0, 0] + 1e-9)
        return np.where(number == 2, np.nan, 0.001 * (1 + number))

    def decide(now, times, numbers):
        there = now.polynomial[:, 0, 0]
        assert np.floor(there).tolist() == numbers.tolist()
        assert times == pytest.approx(0.004 * (1 + numbers) * (there - numbers))
        return ["far" if x in {0.5, 1.75} else None for x in there]

    steps_of(monkeypatch, length)
    ends = followed(SMOOTH, sets, scale, decide)
    assert [end.decision for end in ends] == ["far", "far", None, None]
    assert [end.steps for end in ends] == [2, 3, 0, 0]
    assert [end.lost for end in ends] == [False, False, True, True]


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_energies_and_angles_of_all_states_are_inside_the_bounds(variant, coordinates):
    config = random_config(variant, coordinates, 3)
    states, _ = random_set(config, 4, width=2e-2, error=1e-3)
    narrow = replace(states, radius=states.radius * 1e-12)
    for chosen in (states, narrow):
        (low,), (high,) = equations(config).energy_bounds(chosen)
        (least,), (most,) = chosen.angle_bounds()
        energies = []
        for z, w in some_starts(chosen, 12):
            with ctx.workprec(BITS):
                y = state_of(chosen, z.tolist(), w.tolist())
                value = sum(exact_system(config).observe(y).energy.tolist(), arb(0))
                assert arb(low) <= value <= arb(high)
                assert all(arb(a) <= b <= arb(c) for a, b, c in zip(least, y, most, strict=False))
            energies.append(float(value))
        assert max(energies) - min(energies) > 0.02 * (high - low)


def test_the_energy_on_a_surface_is_that_of_both_sides():
    """A ligament whose toe ends in the set: the formulas of both sides differ beyond it."""
    guard = {"kind": "guard", "method": "repelling", "couple": 1e3, "soft_angle": 0.25}
    config = random_config("free", "Z", 3, schema_version=2, elements={"it": guard})
    states, _ = random_set(config, 4, variables=0, degree=0, error=1e-9)
    states.polynomial[0, 1, 0] = -0.25
    # Only θ2 is wide: else the energy of motion hides that of the guard.
    states = replace(states, frame=np.eye(len(states.frame[0]))[np.newaxis])
    states.radius[0, 1] = 1e-2
    (low,), (high,) = equations(config).energy_bounds(states)
    system, energies = exact_system(config), []
    from rbstab.systems.modes import with_modes_at

    starts = [w for _, w in some_starts(states, 12)]
    for w in (np.abs(starts[0]), -np.abs(starts[0]), *starts):
        with ctx.workprec(BITS):
            y = state_of(states, [], w.tolist())
            energy = with_modes_at(system, y).observe(y).energy
            energies.append(sum(energy.tolist(), arb(0)))
            assert arb(low) <= energies[-1] <= arb(high)
    inside = MotionSet(states.space, states.polynomial + 0.0, states.frame, 0 * states.radius)
    inside.polynomial[0, 1, 0] = -0.24
    assert equations(config).energy_bounds(inside)[1][0] < high - 1.0
