"""Protects a barrier on θ2 beside springs of a tied body: its bounds, and all rest states."""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx
from rbstab.experiment.stored_proof.written_energies import tied_energy_of
from support.tied_springs import barrier_of, energy_of, found_by_scipy, spring_of, tied_system

from rbstab.analysis.proof.boxes import RANGE_END, Boxes
from rbstab.analysis.proof.tied.bounds import Pose
from rbstab.analysis.proof.tied.energy import tied_energy_of_doubles
from rbstab.analysis.proof.tied.rest_states import tied_rest_states
from rbstab.analysis.proof_check.tied.energy import Pose as CheckerPose
from rbstab.analysis.proof_check.tied.energy import TiedEnergy

STIFFNESS = 70.0
"""N m."""


def energy_with(springs, stiffness=STIFFNESS, **changes):
    system = tied_system(springs, **changes)
    elements = (*system.elements, barrier_of(stiffness))
    return tied_energy_of_doubles(replace(system, elements=elements))


def differences(function, y, step=1e-4):
    """Return the gradient and the Hessian of a function by central differences."""
    moves = step * np.eye(6)
    gradient = [(function(y + h) - function(y - h)) / (2 * step) for h in moves]
    hessian = [
        [
            (function(y + a + b) - function(y + a - b) - function(y - a + b) + function(y - a - b))
            / (4 * step**2)
            for b in moves
        ]
        for a in moves
    ]
    return np.array(gradient), np.array(hessian)


def test_the_derivatives_are_those_of_an_energy_written_by_hand():
    springs = [spring_of()]
    W = energy_with(springs)
    rng = np.random.default_rng(0)
    for _ in range(4):
        y = np.concatenate([rng.uniform(-1.2, 1.2, 3), 0.1 * rng.normal(size=3)])

        def by_hand(y):
            X = W.configuration(y[:3], y[3:])[3:6]
            return energy_of(springs, y[:3], X, barrier=STIFFNESS)

        found = Pose(W, Boxes(y[None, :3], y[None, :3])).at(y[None, 3:])
        gradient, hessian = differences(by_hand, y)
        assert found.value.middle[0] == pytest.approx(by_hand(y), rel=1e-12)
        np.testing.assert_allclose(found.gradient.middle[0], gradient, rtol=1e-5, atol=1e-3)
        np.testing.assert_allclose(found.hessian.middle[0], hessian, rtol=1e-4, atol=1.0)


def test_the_checker_has_the_same_derivatives_by_its_own_formulas():
    W = energy_with([spring_of()])
    rng = np.random.default_rng(1)
    with ctx.workprec(128):
        checked = TiedEnergy(tied_energy_of(W).model_dump())
        for _ in range(4):
            Theta, z = rng.uniform(-1.4, 1.4, 3), 0.1 * rng.normal(size=3)
            box = tuple((x, x) for x in Theta.tolist())
            one = CheckerPose(checked, box).at([arb(x) for x in z.tolist()])
            other = Pose(W, Boxes(Theta[None], Theta[None])).at(z[None])
            pairs = [(one.value, other.value.middle[0])]
            pairs += list(zip(one.gradient, other.gradient.middle[0], strict=True))
            pairs += list(zip(one.hessian.entries(), other.hessian.middle[0].ravel(), strict=True))
            for ball, number in pairs:
                assert float(ball) == pytest.approx(number, rel=1e-9, abs=1e-7)


def test_bounds_over_a_box_contain_those_at_its_points():
    W = energy_with([spring_of()])
    rng = np.random.default_rng(2)
    for _ in range(5):
        Theta, z = rng.uniform(-1.2, 1.2, 3), 0.1 * rng.normal(size=3)
        boxes = Boxes(Theta[None] - 0.1, Theta[None] + 0.1)
        over = Pose(W, boxes).within(Boxes(z[None] - 0.01, z[None] + 0.01))
        with ctx.workprec(128):
            checked = TiedEnergy(tied_energy_of(W).model_dump())
            box = tuple(zip(boxes.low[0].tolist(), boxes.high[0].tolist(), strict=True))
            balls = CheckerPose(checked, box).at([arb(x, 0.01) for x in z.tolist()], "over")
        for _ in range(10):
            a, b = Theta + 0.1 * rng.uniform(-1, 1, 3), z + 0.01 * rng.uniform(-1, 1, 3)
            at = Pose(W, Boxes(a[None], a[None])).at(b[None])
            for name in ("value", "gradient", "hessian"):
                bounds, point = getattr(over, name), getattr(at, name)
                assert np.all(bounds.low <= point.high)
                assert np.all(point.low <= bounds.high)
            pairs = zip(balls.gradient, at.gradient.middle[0], strict=True)
            assert all(ball.overlaps(arb(x, 1e-9)) for ball, x in pairs)
            pairs = zip(balls.hessian.entries(), at.hessian.middle[0].ravel(), strict=True)
            assert all(ball.overlaps(arb(x, 1e-9)) for ball, x in pairs)


@pytest.mark.heavy
@pytest.mark.parametrize("seed", range(4))
def test_no_rest_state_that_scipy_finds_is_missed(seed):
    rng = np.random.default_rng(seed)
    springs = [
        spring_of(
            rng.uniform(-0.3, 0.3, 3),
            rng.uniform(-0.3, 0.3, 3) + np.array([0.0, 0.0, rng.choice([-1.2, 1.2])]),
            float(rng.uniform(300, 900)),
            float(rng.uniform(0.3, 0.8)),
        )
    ]
    soft, stiffness = float(rng.uniform(0.4, 1.0)), float(rng.uniform(20, 200))
    W = energy_with(springs, stiffness, soft=soft)
    rest = tied_rest_states(W)
    assert rest.proved
    assert rest.end[1] < RANGE_END[1]
    places = [
        np.concatenate([one.point.state.motion.Theta, one.point.state.motion.X])
        for one in rest.states
    ]
    reached = found_by_scipy(springs, rng, 30, soft=soft, barrier=stiffness)
    assert reached
    for y in reached:
        assert min(np.abs(y - other).max() for other in places) < 1e-5
    # Nothing on the border, nor beyond it, has less energy than the bound of the region.
    assert rest.region is not None
    bound = rest.region.energy_bound
    assert bound is not None
    for _ in range(2000):
        Theta = rng.uniform(-RANGE_END, RANGE_END)
        Theta[1] = rng.choice([-1, 1]) * rng.uniform(rest.end[1], RANGE_END[1])
        X = W.configuration(Theta, 0.2 * rng.normal(size=3))[3:6]
        assert energy_of(springs, Theta, X, soft=soft, barrier=stiffness) >= bound
