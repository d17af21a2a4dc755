"""The bounds of a step of sets: its disc, its defect and its slopes hold what is seen."""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx
from support.polynomial_sets import BITS
from support.set_steps import a_step, corners_of_z, exact_system, p_at
from support.start_sets import VARIANTS, random_config

from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.sets.graph import Graph
from rbstab.analysis.motion_proof.sets.models import program
from rbstab.analysis.motion_proof.sets.set_step import (
    FOR_POINTS,
    FOR_SETS,
)
from rbstab.analysis.motion_proof.taylor import DiscBounds
from rbstab.mechanics.derivatives import jacobian


@pytest.mark.parametrize("orders", [FOR_SETS, FOR_POINTS])
@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_the_disc_holds_for_all_z_and_errors(variant, coordinates, orders):
    """For complex τ on the circle of radius ρ, all z, and complex errors within the margin."""
    rng = np.random.default_rng(3)
    step, system = a_step(variant, coordinates, width=3e-2, error=1e-2, orders=orders)
    with proof_precision():
        bounds = step.disc()
    assert np.isfinite(bounds.rates).all()
    assert np.isfinite(bounds.jacobian).all()
    n = len(step.scale)
    for z in corners_of_z(step):
        tau = orders.ratio * np.exp(2j * np.pi * rng.random())
        e = step.margin[0] * np.exp(2j * np.pi * rng.random(n))
        y = p_at(step, z, tau) + e
        assert np.all(np.abs(step.h[0] * system.rates(y)) <= bounds.rates[0])
        slopes = step.h[0] * complex_jacobian(system.rates, y)
        assert np.all(np.abs(slopes) <= bounds.jacobian[0] * (1 + 1e-6) + 1e-6)


def complex_jacobian(function, y):
    """Return ∂f/∂y at complex states, by central differences."""
    columns = [
        (function(y + 1e-5 * unit) - function(y - 1e-5 * unit)) / 2e-5 for unit in np.eye(len(y))
    ]
    return np.array(columns).T


@pytest.mark.parametrize("part", ["margin", 0, 1, 5])
def test_the_disc_reaches_as_far_as_z_and_the_errors(part):
    """Each by itself, for the velocity, which is the rate of the position."""
    step, _ = a_step(width=0.0, error=0.0)
    with proof_precision():
        least = step.disc().rates
        if part == "margin":
            wider = replace(step, margin=step.margin + step.scale)
        else:
            p = step.p.copy()
            p[0, :, 1, part] += step.scale / FOR_SETS.ratio**part  # the most at |τ| = ρ
            wider = replace(step, p=p)
        found = wider.disc().rates
    # |hf| of the position is h|V|. Its discs are those of V itself, up to rounding.
    more = (found - least)[0, 6:9] / (step.h * step.scale[9:12])
    assert np.all(more >= 1.0)
    assert np.all(more < 1.0 + 1e-6)


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_the_defect_is_above_what_is_seen(variant, coordinates):
    """|hf(p) - p'| at points, in balls; a wide set, so that degrees that are left out count."""
    step, _ = a_step(variant, coordinates, width=3e-2)
    config = random_config(variant, coordinates, 5)
    with proof_precision():
        (bound,) = step.defect(step.disc())
    seen = np.zeros(len(bound))
    for z in corners_of_z(step):
        for tau in (0.0, 0.5, 1.0):
            with ctx.workprec(BITS):
                y, rate = exact_p(step, z, tau)
                hf = [arb(step.h[0]) * x for x in exact_system(config).rates(y)]
                apart = [abs(a - b) for a, b in zip(hf, rate, strict=True)]
                assert all(x <= arb(b) for x, b in zip(apart, bound.tolist(), strict=True))
                seen = np.maximum(seen, [float(x) for x in apart])
    rough = seen > 1e-12 * step.scale
    assert rough.any()
    assert np.all(bound[rough] < 300 * seen[rough])


def exact_p(step, z, tau):
    """Return p and p' at a point as balls."""
    values, rates = [], []
    for row in step.p[0].tolist():
        value, rate = arb(0), arb(0)
        for exponents, coefficients in zip(step.space.exponents, row, strict=True):
            monomial = arb(1)
            for power, x in zip(exponents, z.tolist(), strict=True):
                monomial = monomial * arb(x) ** power
            for k, coefficient in enumerate(coefficients):
                value = value + monomial * coefficient * arb(tau) ** k
                if k:
                    rate = rate + monomial * coefficient * k * arb(tau) ** (k - 1)
        values.append(value)
        rates.append(rate)
    found = np.empty(len(values), dtype=object)
    found[:] = values
    return found, rates


@pytest.mark.parametrize("orders", [FOR_SETS, FOR_POINTS])
def test_the_defect_has_the_rounding_and_the_rest_of_its_series(orders):
    step, _ = a_step(width=0.0, error=0.0, orders=orders)
    n = len(step.scale)
    none = DiscBounds(np.zeros((1, n)), np.zeros((1, n, n)))
    unit = DiscBounds(np.ones((1, n)), np.zeros((1, n, n)))
    with proof_precision():
        rounding, whole = step.defect(none), step.defect(unit)
    assert np.all(rounding > 0)
    # Cauchy's estimate: Σ ρ⁻ᵏ from the first power of τ that is not computed.
    first = {FOR_SETS: 13, FOR_POINTS: 17}[orders]
    rest = sum(orders.ratio**-k for k in range(first, 80))
    assert whole - rounding == pytest.approx(np.full((1, n), rest), rel=1e-6)


def test_the_rounding_of_a_rate_that_is_a_state_is_in_the_defect():
    """The rate of the position is the velocity, without rounding; h times it is rounded."""
    step, _ = a_step("free", "Z", width=0.0, error=0.0)
    p, n = np.zeros_like(step.p), len(step.scale)
    p[0, 9:12, 0, 0] = step.p[0, 9:12, 0, 0] + 0.1
    p[0, 6:9, 0, 1] = step.h * p[0, 9:12, 0, 0]
    with proof_precision():
        none = DiscBounds(np.zeros((1, n)), np.zeros((1, n, n)))
        (bound,) = replace(step, p=p).defect(none)
    with ctx.workprec(BITS):
        for i in range(3):
            apart = abs(arb(step.h[0]) * arb(p[0, 9 + i, 0, 0]) - arb(p[0, 6 + i, 0, 1]))
            assert 0 < apart <= arb(bound[6 + i])


def test_the_rounding_of_a_slope_that_is_a_state_is_in_the_difference():
    """∂(xy)/∂x = y has no rounding; h times it is rounded."""
    step, _ = a_step("free", "Z", width=0.0, error=0.0)
    graph = Graph()
    x, y = graph.variables(2)
    slopes = program(graph, [graph.derivative(x * y, 0)])
    n = len(step.scale)
    made = step.equations._replace(jacobian=slopes, places=((0, 0),))
    step = replace(step, equations=made, margin=np.zeros((1, n)))
    with proof_precision():
        J, (G,) = step.jacobian(DiscBounds(np.zeros((1, n)), np.zeros((1, n, n))))
    middle, radius = J.middle[0, :, 0, 0].tolist(), J.radius[0, :, 0, 0].tolist()
    with ctx.workprec(BITS):
        given = zip(step.p[0, 1, 0, :12].tolist(), middle, strict=True)
        exact = [abs(arb(step.h[0]) * coefficient - computed) for coefficient, computed in given]
        assert all(x <= arb(bound) for x, bound in zip(exact, radius, strict=True))
        assert 0 < exact[0] <= sum(exact, arb(0)) <= arb(G[0, 0])
    assert G[0, 0] < 1e-14


def test_a_polynomial_that_does_not_follow_the_equations_has_a_defect():
    """Each coefficient of p, for z and for τ, counts."""
    step, _ = a_step(width=1e-2)
    with proof_precision():
        bounds = step.disc()
        (given,) = step.defect(bounds)
        for place in ((6, 0, 1), (6, 2, 3), (0, 1, 12), (9, 5, 2)):
            p = step.p.copy()
            p[0][place] += 1e-6
            k = place[2]
            (found,) = replace(step, p=p).defect(bounds)
            assert found[place[0]] - given[place[0]] > 0.5e-6 * k


@pytest.mark.parametrize("orders", [FOR_SETS, FOR_POINTS])
@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_the_slopes_are_those_of_the_middle(variant, coordinates, orders):
    """J at z = 0 is h∂f/∂y along p: its terms lie within their radii of the true slopes."""
    step, system = a_step(variant, coordinates, width=1e-2, error=1e-9, orders=orders)
    with proof_precision():
        J, _ = step.jacobian(step.disc())
    zero = np.zeros(step.space.variables)
    for tau in (0.0, 0.5, 1.0):
        powers = tau ** np.arange(orders.jacobian_terms)
        series = np.einsum("kij,k->ij", J.middle[0], powers)
        allowed = np.einsum("kij,k->ij", J.radius[0], powers) + J.rest[0]
        true = step.h * jacobian(system.rates, p_at(step, zero, tau))
        assert np.all(np.abs(true - series) <= allowed + 1e-12 * np.abs(true).max())
        assert allowed.max() < 1e-3 * np.abs(true).max()


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
@pytest.mark.parametrize(("width", "error"), [(3e-2, 1e-9), (1e-9, 1e-3), (3e-2, 1e-2)])
def test_slopes_differ_by_no_more_than_their_bound(variant, coordinates, width, error):
    """|h∂f/∂y(p + e) - hJ| at corners of z, of the error, and at times of the step."""
    rng = np.random.default_rng(3)
    step, system = a_step(variant, coordinates, width=width, error=error)
    with proof_precision():
        J, (G,) = step.jacobian(step.disc())
    seen, zero = np.zeros_like(G), np.zeros(step.space.variables)
    for z in corners_of_z(step):
        for tau in (0.0, 1.0):
            e = step.margin[0] * rng.choice([-1.0, 1.0], len(step.scale))
            there = jacobian(system.rates, p_at(step, z, tau) + e)
            at_middle = jacobian(system.rates, p_at(step, zero, tau))
            seen = np.maximum(seen, np.abs(step.h * (there - at_middle)))
    size = np.abs(J.middle[0]).sum(axis=0)
    assert np.all(seen <= G + 1e-13 * size.max())
    large = 0.1 * G.max() < G
    assert np.all(G[large] < (2 if error < 1e-6 else 40) * seen[large])


def test_the_rest_of_both_series_of_slopes_is_in_their_difference():
    """J and J̄ both have terms that are not computed, and J has errors."""
    step, _ = a_step(width=0.0, error=0.0)
    n = len(step.scale)
    step, ones = replace(step, margin=np.zeros((1, n))), np.ones((1, n, n))
    with proof_precision():
        J, given = step.jacobian(DiscBounds(np.zeros((1, n)), 0.0 * ones))
        more, found = step.jacobian(DiscBounds(np.zeros((1, n)), ones))
    rest = sum(8.0**-k for k in range(12, 80))
    assert more.rest == pytest.approx(rest * ones, rel=1e-6)
    assert found - given == pytest.approx(2.0 * rest * ones, rel=1e-3)
    assert np.all(given >= 2 * J.radius.sum(axis=1))
    # Without z and e, what remains is rounding.
    assert all(given[0, i, j] > 0 for i, j in step.equations.places)
    assert given.max() < 1e-12 * np.abs(J.middle).max()


def test_no_higher_degree_of_z_is_lost_in_the_slopes():
    """p with z⁴ only, which models of degree 3 have in their remainders."""
    step, system = a_step(width=0.0, error=0.0)
    p = step.p.copy()
    p[0, 0, step.space.place[4, 0], 0] = 0.3
    step = replace(step, p=p)
    with proof_precision():
        _, (G,) = step.jacobian(step.disc())
    there, middle = (
        jacobian(system.rates, p_at(step, np.array([x, 0.0]), 1.0)) for x in (1.0, 0.0)
    )
    seen = step.h * np.abs(there - middle)
    assert seen.max() > 1e-4
    assert np.all(seen <= G + 1e-13)
