"""Discs hold all values of functions of complex variables, and are hardly larger than needed.

The true values are computed in 200 bits, at complex points on the edges of discs and inside.
"""

import numpy as np
import pytest
from flint import acb, arb, ctx

from rbstab.analysis.motion_proof.sets import discs as discs_module
from rbstab.analysis.motion_proof.sets.discs import LARGEST_RADIUS, Discs, discs_of
from rbstab.analysis.motion_proof.sets.graph import Graph
from rbstab.analysis.motion_proof.sets.models import program

BITS = 200

FUNCTIONS = {
    "product": lambda x, y: x * y,
    "square": lambda x, _: x * x,
    "inverse": lambda x, _: 1 / x,
    "quotient": lambda x, y: y / (2 * x + 1),
    "sum": lambda x, y: 0.1 * x - 0.7 * y + 1.3,
    "sine": lambda x, _: x.sin(),
    "cosine": lambda x, _: x.cos(),
    "mixed": lambda x, y: (x * y - 0.3).sin() / (y.cos() + 3) - 0.2 * x,
    "constant": lambda x, _: 0 * x + 0.3,
}


def disc_of(function, *variables):
    """Return the disc of a function of discs."""
    graph = Graph()
    form = graph.form(function(*graph.variables(len(variables))))
    (found,) = discs_of(program(graph, [form]), list(variables))
    return found


def discs(centres, radii):
    return Discs(np.array(centres, dtype=float), np.array(radii, dtype=float))


def points(rng, disc, k):
    """Yield complex numbers of the k-th disc: exact doubles on its edge or a little inside."""
    centre, radius = float(disc.centre[k]), float(disc.radius[k])
    for angle in [0.0, np.pi, np.pi / 2, *rng.uniform(-np.pi, np.pi, 6)]:
        beside = radius * np.exp(1j * angle) * (1 - 1e-15)
        yield acb(arb(centre) + arb(beside.real), arb(beside.imag))


def largest_distances(rng, function, found, *variables):
    """Check that all values are inside, and return the largest distances from the centre."""
    seen = np.zeros(len(found.centre))
    with ctx.workprec(BITS):
        for k in range(len(seen)):
            for x in points(rng, variables[0], k):
                for y in points(rng, variables[1], k):
                    apart = abs(function(x, y) - arb(float(found.centre[k])))
                    assert apart <= arb(float(found.radius[k]))
                    seen[k] = max(seen[k], float(apart))
    return seen


@pytest.mark.parametrize("radius", [0.0, 1e-9, 0.2])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_all_values_are_inside(rng, name, radius):
    """Also without a radius, where what is left is rounding."""
    function = FUNCTIONS[name]
    x = discs([0.9, -1.3, 2.7, 100.1], [radius] * 4)
    y = discs([-0.4, 0.7, 1.1, 0.3], np.array([1.0, 0.5, 2.0, 0.1]) * radius)
    found = disc_of(function, x, y)
    assert found.centre.shape == found.radius.shape == (4,)
    seen = largest_distances(rng, function, found, x, y)
    assert np.all(found.radius <= 2.5 * seen + 1e-12 * (1 + np.abs(found.centre)))
    with ctx.workprec(BITS):
        for k in range(4):
            largest = max(
                float(abs(function(a, b))) for a in points(rng, x, k) for b in points(rng, y, k)
            )
            edge = abs(found.centre[k]) + found.radius[k]
            assert largest <= found.bound[k] <= edge * (1 + 1e-10) + 1e-200


@pytest.mark.parametrize("name", ["product", "inverse", "sum"])
def test_the_edges_are_reached(rng, name):
    """Nothing is counted twice: some value is as far from the centre as the bound."""
    x, y = discs([0.9, -1.3], [0.5, 0.3]), discs([0.4, -0.7], [0.2, 1.1])
    found = disc_of(FUNCTIONS[name], x, y)
    seen = largest_distances(rng, FUNCTIONS[name], found, x, y)
    assert seen == pytest.approx(found.radius, rel=1e-9)


@pytest.mark.parametrize("name", ["sine", "cosine"])
@pytest.mark.parametrize("radius", [1e-6, 0.5, 2.0, 5.0, LARGEST_RADIUS])
def test_angles_with_large_discs(rng, name, radius):
    x = discs([0.0, 0.5, np.pi / 2, -2.0, 1e6], [radius] * 5)
    found = disc_of(FUNCTIONS[name], x, x)
    seen = np.zeros(5)
    with ctx.workprec(BITS):
        for k in range(5):
            for z in points(rng, x, k):
                apart = abs(FUNCTIONS[name](z, z) - arb(float(found.centre[k])))
                assert apart <= arb(float(found.radius[k]))
                seen[k] = max(seen[k], float(apart))
    assert np.all(found.radius <= 2.0 * seen + 1e-14)


@pytest.mark.parametrize("radius", [np.nextafter(LARGEST_RADIUS, 9), 50.0, 1e300, np.inf, np.nan])
def test_angles_with_larger_discs_have_no_bound(radius):
    for name in ("sine", "cosine"):
        found = disc_of(FUNCTIONS[name], discs([0.1, 0.1], [radius, 0.1]), discs([0, 0], [0, 0]))
        assert np.isfinite(found.radius).tolist() == [False, True]


@pytest.mark.parametrize("terms", [4, 7])
def test_the_terms_that_are_left_out_count(monkeypatch, terms):
    """With few terms, what is left out of cosh r - 1 and sinh r is much more than rounding."""
    monkeypatch.setattr(discs_module, "SERIES_TERMS", terms)
    r = np.array([0.1, 1.0, 3.0])
    even, odd = discs_module._hyperbolic(r)
    assert np.all(even >= np.cosh(r) - 1)
    assert np.all(odd >= np.sinh(r))


def test_hyperbolic_functions_are_bounded_closely():
    r = np.linspace(0.01, LARGEST_RADIUS, 50)
    even, odd = discs_module._hyperbolic(r)
    with ctx.workprec(BITS):
        for k, x in enumerate(r.tolist()):
            assert arb(x).cosh() - 1 <= arb(even[k]) <= (arb(x).cosh() - 1) * (1 + 1e-9)
            assert arb(x).sinh() <= arb(odd[k]) <= arb(x).sinh() * (1 + 1e-9)


@pytest.mark.parametrize(
    ("centre", "radius"),
    [
        (0.0, 0.0),
        (1.0, 1.0),
        (-1.0, 1.5),
        (1.0, np.inf),
        (np.nan, 0.1),
        (1.0, np.nan),
        (np.inf, 0.1),
        (-np.inf, 0.0),
        (1e-320, 0.0),
        (1.0, np.nextafter(1.0, 2)),
    ],
)
def test_a_disc_that_may_contain_zero_has_no_inverse(centre, radius):
    """Neither has one without bounds. It does not change what is found of the discs beside it."""
    x, y = discs([0.7, centre, 0.7], [0.1, radius, 0.1]), discs([1, 1, 1], [0.1, 0.1, 0.1])
    alone = disc_of(FUNCTIONS["inverse"], x, y)
    for name in ("inverse", "quotient"):
        shifted = x if name == "inverse" else x._replace(centre=x.centre / 2 - 0.5)
        found = disc_of(FUNCTIONS[name], shifted._replace(radius=x.radius), y)
        assert np.isfinite(found.bound).tolist() == [True, False, True]
    after = disc_of(lambda x, y: (1 / x).sin() * y + 0.5, x, y)
    assert np.isfinite(after.bound).tolist() == [True, False, True]
    assert alone.radius[0] == alone.radius[2]


def test_a_bound_does_not_get_lost_where_products_overflow():
    """1/x on a disc that nearly reaches zero, of a number with a large square."""
    x = discs([1e200], [1e200 * (1 - 1e-14)])
    found = disc_of(FUNCTIONS["inverse"], x, x)
    assert not found.radius[0] < 0.9e-186


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name != "constant"])
def test_numbers_that_are_not_finite_are_no_bounds(name, bad):
    good = discs([0.7, 0.7], [0.1, 0.1])
    for x in (discs([bad, 0.7], [0.1, 0.1]), discs([0.7, 0.7], [bad, 0.1])):
        found = disc_of(FUNCTIONS[name], x, good)
        assert np.isfinite(found.bound).tolist() == [False, True]


def test_factors_that_are_balls(rng):
    """(2 ± 0.1)x + 3 ± 0.5: all errors at their ends."""
    graph = Graph()
    (x,) = graph.variables(1)
    form = arb(2, 0.1) * x + arb(3, 0.5)
    (found,) = discs_of(program(graph, [form]), [discs([1.0], [0.25])])
    assert found.centre.tolist() == [5.0]
    expected = 2 * 0.25 + 0.1 * 1.25 + 0.5
    assert expected <= found.radius[0] < expected * (1 + 1e-6)


def test_constants_have_the_shape_of_the_variables():
    graph = Graph()
    graph.variables(1)
    (found,) = discs_of(program(graph, [graph.form(0.1)]), [discs([1.0, 2.0], [0.1, 0.1])])
    assert found.centre.tolist() == [0.1, 0.1]
    assert found.radius.shape == (2,)
