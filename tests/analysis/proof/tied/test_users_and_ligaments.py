"""Protects W with ligaments and with elements of users: its bounds, and those on the position."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from rbstab.experiment.stored_proof.written_energies import tied_energy_of
from scipy.optimize import minimize
from support.ligaments import ligament_of, stored
from support.tied_springs import energy_of, spring_of, tied_system

from rbstab.analysis.proof.boxes import RANGE_END, Boxes
from rbstab.analysis.proof.tied.bounds import Pose
from rbstab.analysis.proof.tied.energy import tied_energy_of_doubles
from rbstab.analysis.proof.tied.extent import scale_of, slopes_with_shift
from rbstab.analysis.proof.tied.rest_states import tied_rest_states
from rbstab.analysis.proof_check.tied.energy import Pose as CheckerPose
from rbstab.analysis.proof_check.tied.extent import BoundedEnergy
from rbstab.elements import Element, Gain, exp, force_at_centre, force_at_contact, power
from rbstab.mechanics.numbers import Array

SOFT = np.diag([400.0, 300.0, 500.0])
"""N/m: a soft tie, so that what is added to it counts."""

CUBE = np.array([2000.0, 900.0, 4000.0])
"""N/m³."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cubic(Element):
    """A force by the cube of the position of the contact point, and a quadratic one."""

    name: str
    k: Array
    gains = (Gain("k", "N/m^3", "k", shape="diagonal"),)
    from_user = True

    def wrench(self, motion, own):
        return force_at_contact(-self.k * power(motion.E, 3) - 50.0 * motion.E)

    def stored(self, motion, own):
        return 0.25 * (self.k @ power(motion.E, 4)) + 25.0 * (motion.E @ motion.E)


@dataclass(frozen=True, eq=False, kw_only=True)
class Steep(Element):
    """A force that grows faster than any power of the distance from a point."""

    name: str
    b: Array
    gains = (Gain("b", "1/m^2", "b", shape="number"),)
    from_user = True

    def wrench(self, motion, own):
        d = motion.X - np.array([0.1, 0.0, 0.05])
        grows = exp(self.b * (d @ d))
        return force_at_centre(-2.0 * self.b * grows * d)

    def stored(self, motion, own):
        d = motion.X - np.array([0.1, 0.0, 0.05])
        return exp(self.b * (d @ d)) - 1.0


def cubic(k=CUBE):
    return Cubic(name="cubic", k=k)


def by_hand(Theta, X, *, springs=(), ligaments=(), k=None, b=None):
    """Return the stored energy of `tied_system` with these elements, without the program."""
    from support.held_springs import R
    from support.pose import attitude

    A = attitude(Theta)
    found = energy_of(list(springs), Theta, X, K_c=SOFT)
    E = X + A @ R - R
    for one in ligaments:
        found += stored(one, float(np.linalg.norm(X + A @ one.point - one.anchor)))
    if k is not None:
        found += 0.25 * float(k @ E**4) + 25.0 * float(E @ E)
    if b is not None:
        d = X - np.array([0.1, 0.0, 0.05])
        found += float(np.exp(b * (d @ d))) - 1.0
    return found


CASES: dict[str, tuple[dict[str, Any], list[Any]]] = {
    "cubic": ({"k": CUBE}, [cubic()]),
    "steep": ({"b": 3.0}, [Steep(name="steep", b=np.array(3.0))]),
    "ligament": ({"ligaments": [ligament_of()]}, [ligament_of()]),
    "a spring and a ligament": (
        {"springs": [spring_of()], "ligaments": [ligament_of()]},
        [spring_of(), ligament_of()],
    ),
    "all": (
        {"springs": [spring_of()], "ligaments": [ligament_of()], "k": CUBE},
        [spring_of(), ligament_of(), cubic()],
    ),
}


def energy_with(elements):
    return tied_energy_of_doubles(tied_system(elements, K_c=SOFT))


def differences(function, y, step=1e-4):
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


@pytest.mark.parametrize("case", CASES)
def test_the_derivatives_are_those_of_an_energy_written_by_hand(case):
    parts, elements = CASES[case]
    W = energy_with(elements)
    rng = np.random.default_rng(0)
    for _ in range(3):
        y = np.concatenate([rng.uniform(-1.2, 1.2, 3), 0.1 * rng.normal(size=3)])

        def energy(y):
            return by_hand(y[:3], W.configuration(y[:3], y[3:])[3:6], **parts)

        found = Pose(W, Boxes(y[None, :3], y[None, :3])).at(y[None, 3:])
        gradient, hessian = differences(energy, y)
        assert found.value.middle[0] == pytest.approx(energy(y), rel=1e-11)
        np.testing.assert_allclose(found.gradient.middle[0], gradient, rtol=1e-5, atol=1e-3)
        np.testing.assert_allclose(found.hessian.middle[0], hessian, rtol=1e-4, atol=1.0)


@pytest.mark.parametrize("case", ["steep", "a spring and a ligament"])
def test_bounds_over_a_box_contain_those_at_its_points(case):
    W = energy_with(CASES[case][1])
    rng = np.random.default_rng(2)
    with ctx.workprec(128):
        checked = BoundedEnergy(tied_energy_of(W).model_dump())
    for _ in range(3):
        Theta, z = rng.uniform(-1.2, 1.2, 3), 0.1 * rng.normal(size=3)
        boxes = Boxes(Theta[None] - 0.1, Theta[None] + 0.1)
        over = Pose(W, boxes).within(Boxes(z[None] - 0.01, z[None] + 0.01))
        with ctx.workprec(128):
            box = tuple(zip(boxes.low[0].tolist(), boxes.high[0].tolist(), strict=True))
            balls = CheckerPose(checked, box).at([arb(x, 0.01) for x in z.tolist()], "over")
        for _ in range(8):
            a, b = Theta + 0.1 * rng.uniform(-1, 1, 3), z + 0.01 * rng.uniform(-1, 1, 3)
            at = Pose(W, Boxes(a[None], a[None])).at(b[None])
            for name in ("value", "gradient", "hessian"):
                bounds, point = getattr(over, name), getattr(at, name)
                assert np.all(bounds.low <= point.high)
                assert np.all(point.low <= bounds.high)
            pairs = [(balls.value, at.value.middle[0])]
            pairs += zip(balls.gradient, at.gradient.middle[0], strict=True)
            pairs += zip(balls.hessian.entries(), at.hessian.middle[0].ravel(), strict=True)
            assert all(ball.overlaps(arb(x, 1e-9 * (1 + abs(x)))) for ball, x in pairs)


@pytest.mark.heavy
@pytest.mark.parametrize("case", CASES)
def test_the_position_with_the_least_energy_is_within_the_bounds(case):
    parts, elements = CASES[case]
    W = energy_with(elements)
    bound = scale_of(W)[3:]
    with ctx.workprec(128):
        checker_bound = [float(one) for one in BoundedEnergy(tied_energy_of(W).model_dump()).scale]
    assert np.all(np.isfinite(bound))
    rng = np.random.default_rng(3)
    largest = np.zeros(3)
    for _ in range(20):
        Theta = rng.uniform(-RANGE_END, RANGE_END)
        rest = W.configuration(Theta, np.zeros(3))[3:6]
        z = minimize(
            lambda z, Theta=Theta, rest=rest: by_hand(Theta, rest + z, **parts),
            np.zeros(3),
            method="Nelder-Mead",
            options={"xatol": 1e-7, "fatol": 1e-10, "maxiter": 4000},
        ).x
        largest = np.maximum(largest, np.abs(z))
    assert np.all(largest <= bound + 1e-6)
    assert np.all(largest <= np.array(checker_bound) + 1e-6)
    # They are of use: not far from what was seen, where ligaments and formulas are all.
    if not parts.get("springs"):
        assert np.all(bound <= 12 * largest.max() + 1e-3)


@pytest.mark.parametrize("case", ["cubic"])
def test_slopes_of_what_depends_on_the_position_are_bounded(case):
    W = energy_with(CASES[case][1])
    steepest, bound = slopes_with_shift(W), scale_of(W)[3:]
    rng = np.random.default_rng(4)
    Theta = rng.uniform(-RANGE_END, RANGE_END, size=(500, 3))
    z = rng.uniform(-bound, bound, size=(500, 3))
    found = Pose(W, Boxes(Theta, Theta)).at(z)
    form = W.form.approximate(Theta, 1)[1]
    assert np.all(np.abs(found.gradient.middle[:, :3] - form) <= steepest)
    assert np.all(steepest <= 30 * np.abs(found.gradient.middle[:, :3] - form).max(axis=0))


@pytest.mark.heavy
@pytest.mark.parametrize("case", sorted(CASES.keys() - {"all"}))  # all takes 300,000 boxes
def test_no_rest_state_that_scipy_finds_is_missed(case):
    parts, elements = CASES[case]
    rest = tied_rest_states(energy_with(elements))
    assert rest.proved
    states = [one.point.state for one in rest.states]
    places = [np.concatenate([one.motion.Theta, one.motion.X]) for one in states]
    rng = np.random.default_rng(6)
    end, found = np.concatenate([RANGE_END, np.full(3, 2.0)]), 0
    for _ in range(10):
        start = np.concatenate([rng.uniform(-0.6, 0.6, 3), 0.1 * rng.normal(size=3)])
        y = minimize(
            lambda y: by_hand(y[:3], y[3:], **parts),
            start,
            bounds=list(zip(-end, end, strict=True)),
            method="L-BFGS-B",
            options={"maxiter": 3000, "ftol": 1e-15, "gtol": 1e-9},
        ).x
        if np.all(np.abs(y[:3]) < RANGE_END - 1e-3):
            found += 1
            assert min(np.abs(y - other).max() for other in places) < 1e-3
    assert found
    # Nothing on the border has less energy than the bound of the region.
    region = rest.region
    assert region is not None
    assert region.energy_bound is not None
    for _ in range(1000):
        Theta = rng.uniform(-RANGE_END, RANGE_END)
        axis = rng.integers(3)
        Theta[axis] = rng.choice([-1, 1]) * RANGE_END[axis]
        X = rest.energy.configuration(Theta, 0.1 * rng.normal(size=3))[3:6]
        assert by_hand(Theta, X, **parts) >= region.energy_bound


@pytest.mark.heavy
def test_a_slack_ligament_changes_no_rest_state():
    """One that is slack everywhere has no energy near rest: the proofs agree."""
    springs = [spring_of()]
    plain = tied_rest_states(energy_with(springs))
    slack = ligament_of(slack_length=30.0)
    found = tied_rest_states(energy_with([*springs, slack]))
    assert found.proved
    assert plain.proved
    assert len(found.states) == len(plain.states)
    for one, other in zip(found.states, plain.states, strict=True):
        np.testing.assert_allclose(
            one.point.state.motion.Theta, other.point.state.motion.Theta, atol=1e-12
        )
        assert one.point.index == other.point.index
