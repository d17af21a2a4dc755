"""Protects proofs of bodies that are not held, with springs: nothing is missed or said too much.

Rest states and least energies are looked for by SciPy, with an energy written for these tests.
"""

import numpy as np
import pytest
from scipy.optimize import minimize
from support.balls import value
from support.pose import attitude
from support.tied_springs import (
    K_D,
    energy_of,
    ligament_of,
    rest_states_by_scipy,
    slope_of,
    spring_of,
    tied_system,
)

from rbstab.elements.guards.stop import Stop
from rbstab.proof.boxes import Box
from rbstab.proof.entries import NO_LENGTH
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.exact.lengths import NotSingleError, springs_of, with_squares
from rbstab.proof.reasons import NoReducedEnergy
from rbstab.proof.rest_states import Body
from rbstab.systems.parameters import map_parameters

BENT = spring_of((0.0, 0.0, 0.5), (0.1, 0.05, 1.3), 6000.0, 1.3)
"""It pushes from above, so that the body rests beside it."""

OTHER = spring_of((-0.2, 0.1, 0.0), (-0.6, 0.2, -0.1), 500.0, 0.7)

END = np.array([np.pi, np.pi / 2, np.pi])

FREE = (3, 4, 5)


def body_of(springs, soft=1.0, *others, K_d=None):
    """Return the body, with the doubles of its system as exact numbers."""
    system = tied_system(springs, soft, K_d, *others)
    return Body(system, lambda convert: map_parameters(system, lambda _, x: convert(x)))


def least_by_scipy(springs, Theta, **changes):
    """Return the least energy over X at Θ."""

    def energy(X):
        return energy_of(springs, Theta, X, **changes)

    starts = np.random.default_rng(0).normal(size=(4, 3)) * 0.3
    return min(float(minimize(energy, start, tol=1e-12).fun) for start in starts)


def test_bounds_contain_the_least_energy_over_the_position():
    """Where a stiff spring near its anchor has several rest positions, nothing is said."""
    springs, rng = [spring_of(), OTHER], np.random.default_rng(3)
    body, zero = body_of(springs, 0.4), np.zeros((3, 1))

    def least(Theta):
        return least_by_scipy(springs, Theta, soft=0.4)

    middle, width = rng.uniform(-0.9, 0.9, (3, 5)) * END[:, None], 0.05
    b = body.bounded.over(middle - width, middle + width)
    finite = np.flatnonzero(np.isfinite(b.value.lo))
    assert len(finite) > 2
    offset = body.bounded.at(zero)[0][0] - least(np.zeros(3))
    for k in finite:
        assert b.value.lo[k] - 1e-6 <= least(middle[:, k]) + offset <= b.value.hi[k] + 1e-6
        x = middle[:, k] + rng.uniform(-width, width, 3)
        slope = [(least(x + h) - least(x - h)) / 2e-4 for h in 1e-4 * np.eye(3)]
        assert np.all(b.slopes.lo[:, k] - 1e-3 <= slope)
        assert np.all(slope <= b.slopes.hi[:, k] + 1e-3)
    strong = spring_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 40_000.0, 1.0)
    assert not np.isfinite(body_of([strong]).bounded.over(zero, zero).value.lo[0])


@pytest.mark.heavy
@pytest.mark.parametrize("K_d", [None, K_D], ids=["visco-elastic", "embedded"])
def test_no_rest_state_that_scipy_finds_is_missed(K_d):
    """And each that is proved is one; with a limit of boxes each is proved or in one that is left.

    The body with the spring `BENT` has several.
    """
    springs, soft = ([BENT], 0.3) if K_d is None else ([spring_of()], 0.2)
    changes = {"soft": soft, "K_d": K_d}
    slope, body = slope_of(springs, **changes), body_of(springs, soft, K_d=K_d)
    reached = rest_states_by_scipy(springs, np.random.default_rng(0), 5, **changes)
    assert reached
    rest = body.proved(300 if K_d is None else 100_000)
    assert rest.proved == (K_d is not None)
    left = rest.zeros.undecided
    for y in reached:
        near = [np.abs(y[:3] - state.orientation).max() < 1e-5 for state in rest.states]
        assert any(near) or left.touch(Box(y[:3] - 1e-6, y[:3] + 1e-6)).any()
    for state in rest.states:
        y = np.concatenate([state.orientation, state.position])
        np.testing.assert_allclose(slope(y), 0.0, atol=1e-3)
        H = np.array([slope(y + h) - slope(y - h) for h in 1e-4 * np.eye(6)])
        assert not state.index_proved or state.index == np.sum(np.linalg.eigvalsh(H) < 0)


def border_by_scipy(springs):
    """Return the least energy on θ2 = ±π/2, over X and all other angles."""

    def energy(y, pitch):
        return energy_of(springs, np.array([y[0], pitch, y[1]]), y[2:])

    rng = np.random.default_rng(0)
    starts = [np.concatenate([rng.uniform(-1, 1, 2), 0.1 * rng.normal(size=3)]) for _ in range(6)]
    runs = [minimize(energy, start, (sign * np.pi / 2,)) for start in starts for sign in (-1, 1)]
    return min(float(run.fun) for run in runs)


def without_length_by_scipy(spring):
    """Return the least energy with the point of a spring on its anchor."""

    def energy(Theta):
        return energy_of([spring], Theta, spring.anchor - attitude(Theta) @ spring.point)

    rng = np.random.default_rng(0)
    runs = [minimize(energy, rng.uniform(-1, 1, 3)) for _ in range(8)]
    return min(float(run.fun) for run in runs)


@pytest.mark.heavy
@pytest.mark.parametrize("at_border", [True, False])
def test_the_region_ends_at_the_border_or_where_a_spring_has_no_length(at_border):
    spring = spring_of() if at_border else spring_of(anchor=(0.2, 0.2, 0.4))
    expected = border_by_scipy([spring]) if at_border else without_length_by_scipy(spring)
    body = body_of([spring])
    rest = body.proved(100_000)
    assert rest.unique
    region = body.regions(rest).certified
    assert region is not None
    height = expected - rest.states[0].energy
    assert (region.face == NO_LENGTH) is not at_border
    assert 0.999 * height <= region.lower_bound <= height + 1e-6


Z0, Z1, Z2 = (variable(k) for k in FREE)
OFFSET = (variable(0).sin(), variable(0).cos(), expr(1))


def with_line(more):
    """Return ½ (100 z0² + 200 z1² + 300 z2²) - 2 |z + r(Θ)| and more."""
    length = sum((a + b) ** 2 for a, b in zip((Z0, Z1, Z2), OFFSET, strict=True)).sqrt()
    return with_squares(50 * Z0**2 + 100 * Z1**2 + 150 * Z2**2 - 2 * length + more, FREE)


def test_an_energy_is_taken_apart_into_lines_and_what_is_convex():
    """Norms are convex; and where the line has no length, only its own term is left out."""
    more = Z0**4 + (1 + (Z1 - Z0) ** 2).sqrt() + ((Z0 + 1) ** 2 + Z1**2 + Z2**2 + 2).sqrt()
    springs = springs_of(with_line(more), FREE)
    (line,) = springs.lines
    assert line.weight == 2
    assert line.offset == OFFSET
    assert 100 * (1 - 1e-7) < springs.stiffness <= 100
    place = {3: -np.sin(0.7), 4: -np.cos(0.7), 5: -1.0, 0: 0.7}
    (collapsed,) = springs.collapsed(with_line(more), FREE)
    rest = value(with_line(more) - with_line(expr(0)), place)
    squares = 50 * np.sin(0.7) ** 2 + 100 * np.cos(0.7) ** 2 + 150
    assert float(value(collapsed, {0: 0.7})) == pytest.approx(squares + float(rest), rel=1e-12)


@pytest.mark.parametrize("more", [-(Z0**4), Z1**3, Z0**2 * Z1, -(Z0.exp()), Z0 * variable(0).sin()])
def test_beside_lines_all_else_must_be_convex(more):
    with pytest.raises(NotSingleError):
        springs_of(with_line(more), FREE)


def test_ligaments_beside_springs_are_part_of_what_is_convex():
    body = body_of([spring_of()], 1.0, ligament_of())
    springs = springs_of(body.energy.U, body.energy.free)
    assert len(springs.lines) == 1
    assert springs.convex.terms
    assert body.bounded.rest is not None
    with pytest.raises(NoReducedEnergy, match="beside a stop"):
        body_of([spring_of()], 1.0, Stop(name="stop", angle=1.2, restitution=0.0))
