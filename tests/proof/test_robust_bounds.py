"""The bounds of a family hold for each body in its box; a single number attains them."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from support.bodies import CASES, HEAVY, box_of, config_of, least_over_x, member, some_bodies

from rbstab.analysis.configuration import configurations
from rbstab.proof.exact.expr import variable
from rbstab.proof.robust.energies import energies_of
from rbstab.proof.robust.family import Family
from rbstab.proof.robust.majorants import lower_bound
from rbstab.proof.robust.numbers import FIRST
from rbstab.proof.robust.weights import REMAINDERS, weighted


def slopes(at_rest, points):
    """Return ∂U/∂Θ at points, shape (points, 3), from the equations in doubles."""
    return np.array([at_rest.gradient(least_over_x(at_rest, x))[:3] for x in points])


def some_boxes(rng, count, largest):
    centre = rng.uniform(-1, 1, size=(3, count)) * np.array([[3.0], [1.4], [3.0]])
    radius = largest * 10.0 ** rng.uniform(-3, 0.3, size=count) * np.ones((3, 1))
    return centre - radius, centre + radius


@pytest.mark.parametrize(("config", "texts"), CASES)
def test_slopes_of_each_body_are_within_the_bounds(config, texts):
    count, largest = seen_within_the_bounds(config, texts)
    # The bounds are not far too wide: some body comes near them.
    assert count > 500
    assert largest > 0.2


def seen_within_the_bounds(config, texts, radius=0.1):
    """Compare with slopes of single bodies, from the equations, without a box and without z.

    Return how many finite bounds hold, and the largest share of one that a body attains.
    """
    rng = np.random.default_rng(1)
    members, part = box_of(config, *texts)
    lo, hi = some_boxes(rng, 24, radius)
    with np.errstate(all="ignore"):
        local = Family(energies_of(members, part)).over(lo, hi)
        directions = [*np.eye(3), *rng.normal(size=(6, 3))]
        bounds = [local.along(np.repeat(y[:, None], 24, 1)) for y in directions]
    largest, count = 0.0, 0
    for numbers in some_bodies(part, rng, 5):
        at_rest = configurations(member(members, numbers))
        share = rng.uniform(size=lo.shape)  # in half of the boxes a corner
        share[:, ::2] = np.round(share[:, ::2])
        gradients = slopes(at_rest, (lo + (hi - lo) * share).T)
        slack = 1e-9 * (1 + np.abs(gradients).max())
        for y, (rise, _, spread) in zip(directions, bounds, strict=True):
            apart = np.abs(gradients @ y - rise)
            finite = np.isfinite(spread)
            assert np.all(apart[finite] <= spread[finite] + slack)
            largest = max(largest, float((apart[finite] / (spread[finite] + slack)).max()))
            count += int(finite.sum())
        assert np.all(local.plain.lo[1:] - slack <= gradients.T)
        assert np.all(local.plain.hi[1:] + slack >= gradients.T)
    return count, largest


ALONE = [
    ("permanent", "controller.K_r[0]=±30%", 0.999),
    ("permanent", "body.contact_point[2]=±0.01", 0.95),
    ("visco-elastic", "controller.K_c[0]=±10%", 0.9),
    ("embedded", "controller.K_d[0]=±10%", 0.9),
]


@pytest.mark.parametrize(("variant", "text", "share"), ALONE)
def test_a_single_number_attains_the_bounds(variant, text, share):
    """So no term of U may be missing, and none may be counted twice."""
    members, part = box_of(config_of(variant), text)
    point = np.array([[0.7], [-0.4], [1.1]])
    local = Family(energies_of(members, part)).over(point, point)
    ends = [
        slopes(configurations(member(members, (part.middle[0] + s * part.radius[0],))), point.T)[0]
        for s in (-1, 1)
    ]
    width = np.abs(ends[1] - ends[0]) / 2
    spread = np.array([local.along(axis[:, None])[2][0] for axis in np.eye(3)])
    seen = spread > 1e-6
    assert np.any(seen)
    assert np.all(width[seen] >= share * spread[seen])
    assert np.all(width <= spread * (1 + 1e-9) + 1e-9)


@pytest.mark.parametrize("percent", [10, 50])
def test_what_elimination_leaves_is_bounded(monkeypatch, percent):
    """With x_0 of the body in the middle, the remainder is a large part of the bounds at 50 %."""
    monkeypatch.setattr("rbstab.proof.robust.energies.PRODUCTS", 0)
    config = config_of("visco-elastic", gravity=HEAVY)
    texts = [f"controller.K_c[0]=±{percent}%"]
    count, largest = seen_within_the_bounds(config, texts, 1e-9)
    assert count > 500
    assert largest > 0.9


def test_a_single_body_attains_the_bounds_of_its_series():
    _, largest = seen_within_the_bounds(config_of("permanent"), ["controller=±0.0001%"])
    assert largest > 0.5


@pytest.mark.parametrize("z", [-1.0, -0.3, 0.0, 1.0])
def test_a_reciprocal_is_a_series_with_a_remainder(z):
    divisor = 3 + variable(FIRST).scaled(Fraction(1, 2))
    terms = {powers: float(x.constant or 0) for powers, x in weighted((divisor + 0) ** -2).items()}

    def at(w):
        return sum(
            c * np.prod([(z if a.argument == FIRST else w) ** n for a, n in powers])
            for powers, c in terms.items()
        )

    assert any(a.argument == REMAINDERS for powers in terms for a, _ in powers)
    ends = [at(w) for w in np.linspace(-1, 1, 9)]
    assert min(ends) - 1e-15 <= (3 + z / 2) ** -2 <= max(ends) + 1e-15
    assert max(ends) - min(ends) < 1e-3


def test_majorants_bound_all_matrices():
    rng = np.random.default_rng(5)
    A, others = rng.normal(size=(4, 4)), 0.02 * rng.normal(size=(5, 4, 4))
    middle, others = A @ A.T + np.eye(4), others + np.swapaxes(others, 1, 2)
    bound = lower_bound(middle, others, np.zeros((4, 4)))
    assert bound is not None
    F = bound.factor
    for signs in product((-1, 1), repeat=5):
        H = middle + np.einsum("f,fij->ij", signs, others)
        assert np.linalg.eigvalsh(F @ H @ F.T).min() >= bound.least
    assert lower_bound(middle, 30 * others, np.zeros((4, 4))) is None
    # A stiffness that changes by a half leaves a half.
    K = np.diag([1.0, 2.0, 3.0])
    half = lower_bound(K, np.array([0.25 * K, 0.25 * K]), np.zeros((3, 3)))
    assert half is not None
    assert half.least == pytest.approx(0.5, rel=1e-5)
    assert lower_bound(K, np.array([0.6 * K, 0.4 * K]), np.zeros((3, 3))) is None
    assert lower_bound(K, np.array([0.25 * K]), 0.8 * np.eye(3)) is None
