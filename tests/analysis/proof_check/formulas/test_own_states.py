"""Protects the checker's least energy over own states: against the prover's, and false claims."""

import numpy as np
import pytest
from flint import arb, ctx
from support.formulas import recorded_of_own_states

from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.traced.own_states import OwnStatesEnergy
from rbstab.analysis.proof_check.formulas.own_states import Over, OwnStates
from rbstab.mechanics import numbers


@pytest.fixture(autouse=True)
def _precision():
    with ctx.workprec(128):
        yield


def along(Theta):
    return numbers.sin_of(Theta[0]) * numbers.cos_of(Theta[1]) + 0.4 * numbers.sin_of(Theta[2])


def cord(Theta, D):
    x = 2.0 * (along(Theta) - D[0])
    return 3.0 * (numbers.exp_of(x) - x - 1.0) + 1.5 * D[0] * D[0]


def chain(Theta, D):
    first, second = along(Theta) - D[0], D[0] - 0.5 * D[1]
    return first**2 + 0.3 * first**4 + 2.0 * numbers.cosh_of(second) + D[1] ** 2


FORMULAS = {"cord": (cord, 1), "chain": (chain, 2)}


def both(name):
    """Return the energy of the prover and that of the checker."""
    formula, count = FORMULAS[name]
    program = recorded_of_own_states(formula, count)
    data = {"name": name, "states": count, "operations": program.operations}
    return OwnStatesEnergy(name, program, count), OwnStates(data)


def balls(numbers_):
    return [arb(float(one)) for one in numbers_]


@pytest.mark.parametrize("name", FORMULAS)
def test_values_at_points_are_those_of_the_prover_and_are_closer(name):
    prover, checker = both(name)
    Theta = np.random.default_rng(0).uniform(-2, 2, (30, 3))
    value, slopes, bend = prover.at(Theta, 2)
    for row, point in enumerate(Theta):
        found = checker.over(balls(point), [arb(0)] * 3)
        assert checker.value(balls(point)).overlaps(found.value)
        assert found.value.rad() < 4e-15  # constants stand for all numbers that round to them
        assert found.value.overlaps(arb(value.middle[row], value.radius[row]))
        for i in range(3):
            assert found.gradient[i].overlaps(arb(slopes.middle[row, i], slopes.radius[row, i]))
            for j in range(3):
                one = arb(bend.middle[row, i, j], bend.radius[row, i, j])
                assert found.hessian[i, j].overlaps(one)
                assert found.hessian[i, j].rad() < 1e-13


@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("radius", [0.02, 0.12])
def test_bounds_over_boxes_hold_all_values(name, radius):
    prover, checker = both(name)
    rng = np.random.default_rng(1)
    known = 0
    for point in rng.uniform(-1.5, 1.5, (25, 3)):
        found = checker.over(balls(point), [arb(0, radius)] * 3)
        if not found.value.is_finite():
            continue
        known += 1
        inside = point + rng.uniform(-radius, radius, (12, 3))
        values, slopes, bends = prover.approximate(inside, 2)
        for row in range(len(inside)):
            assert found.values.overlaps(arb(values[row], 1e-12))
            for i in range(3):
                assert found.slopes[i].overlaps(arb(slopes[row, i], 1e-11))
                for j in range(3):
                    assert found.hessian[i, j].overlaps(arb(bends[row, i, j], 1e-9))
    assert known > (22 if radius < 0.1 else 8)


@pytest.mark.heavy
def test_slopes_in_all_of_the_range_are_bounded():
    prover, checker = both("cord")
    Theta = np.random.default_rng(2).uniform(-RANGE_END, RANGE_END, (500, 3))
    most = np.abs(prover.approximate(Theta, 1)[1]).max(axis=0)
    for axis in range(3):
        assert most[axis] <= float(checker.steepest(axis)) < 100 * most[axis]


@pytest.mark.parametrize(
    "formula",
    [
        lambda T, D: numbers.exp_of(D[0] + along(T)),
        lambda T, D: (D[0] - along(T)) ** 4,
        lambda T, D: (D[0] + D[1] - along(T)) ** 2,
    ],
    ids=["no least value", "flat at the bottom", "flat along a line"],
)
def test_without_one_lowest_point_there_are_no_bounds(formula):
    operations = recorded_of_own_states(formula, 2).operations
    checker = OwnStates({"name": "x", "states": 2, "operations": operations})
    found = checker.over(balls([0.3, 0.2, 0.9]), [arb(0, 0.01)] * 3)
    assert found.value.is_nan()
    assert found.values.is_nan()
    assert all(one.is_nan() for one in (*found.gradient, *found.slopes, *found.hessian.entries()))


@pytest.mark.parametrize(
    ("formula", "states"),
    [
        (lambda T, D: numbers.cos_of(D[0] - T[0]), 1),
        (lambda T, D: (D[0] ** 2 - along(T)) ** 2, 1),
        (cord, 0),
        (cord, 7),
        (chain, 1),
    ],
    ids=["not convex", "two wells", "none", "too many", "one that is not there"],
)
def test_what_is_no_such_energy_is_refused(formula, states):
    operations = recorded_of_own_states(formula, 2).operations
    with pytest.raises(ValueError, match=r"own states|formula"):
        OwnStates({"name": "x", "states": states, "operations": operations})


@pytest.mark.parametrize("name", FORMULAS)
def test_bounds_hold_for_any_slopes_of_the_own_states(name, monkeypatch):
    """C only makes them close. With C = 0, what the minimum takes off the Hessian is large."""
    prover, checker = both(name)
    point, lowest = np.array([0.3, 0.2, 0.9]), Over._lowest

    def without_slopes(over, fixed):
        found = lowest(over, fixed)
        assert found is not None
        D, C, B = found
        return D, [[0.0] * 3 for _ in C], B

    exact = prover.approximate(point[np.newaxis], 2)[2][0]
    monkeypatch.setattr(Over, "_lowest", without_slopes)
    found = checker.over(balls(point), [arb(0, 0.01)] * 3)
    assert found.value.is_finite()
    for i in range(3):
        for j in range(3):
            assert found.hessian[i, j].overlaps(arb(exact[i, j], 1e-12))
    assert max(float(one.rad()) for one in found.hessian.entries()) > 0.1
