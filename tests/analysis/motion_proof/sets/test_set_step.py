"""Steps of sets of motions: all exact motions end in the set at the end, and each bound holds."""

import math
from dataclasses import replace
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from support.exact_motions import state_after
from support.polynomial_sets import BITS, place_in_frame, state_of
from support.start_sets import VARIANTS, random_config, random_set, together

from rbstab.analysis.exact import decimal_balls
from rbstab.analysis.motion_proof.linear_flow import LinearBounds, frames_of, linear_bounds
from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.sets import set_step as step_module
from rbstab.analysis.motion_proof.sets.equations import equations_of
from rbstab.analysis.motion_proof.sets.graph import Graph
from rbstab.analysis.motion_proof.sets.models import program
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.set_step import (
    FOR_POINTS,
    FOR_SETS,
    _error_bounds,
    _Steps,
    set_steps,
)
from rbstab.analysis.motion_proof.step import moved_frames
from rbstab.analysis.motion_proof.taylor import DiscBounds
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.mechanics.derivatives import jacobian

LONGEST = 0.0039
"""s: no power of 2, so that products with it are rounded."""


@cache
def equations(config):
    with proof_precision():
        return equations_of(partial(enclosed_system, config))


@cache
def exact_system(config):
    with ctx.workprec(BITS):
        return enclosed_system(config, decimal_balls)


def stepped(config, states, scale, longest=LONGEST):
    step = tried(config, states, scale, longest)
    assert step.proved.all()
    return step


def tried(config, states, scale, longest=LONGEST, orders=FOR_SETS):
    """Return steps that may not be proved; `longest` is a number, or one for each set."""
    with proof_precision():
        longest = np.full(len(states), longest)
        return set_steps(equations(config), states, scale, longest, orders)


def ends(config, states, step, starts):
    """Yield the place of exact ends in the frame at the end, relative to its radii."""
    for z, w in starts:
        y = state_of(states, z.tolist(), w.tolist())
        end = state_after(exact_system(config), y, float(step.h[0]))
        yield place_in_frame(step.end, z.tolist(), end) / step.end.radius[0]


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


def a_step(variant="visco-elastic", coordinates="Z", *, width=1e-2, error=1e-5, orders=FOR_SETS):
    """Return a step of one set that is to be proved, and the equations in doubles."""
    longest = LONGEST if orders is FOR_SETS else 3 * LONGEST
    config = random_config(variant, coordinates, 5)
    states, scale = random_set(config, 7, width=width, error=error)
    with proof_precision():
        h, p = step_module._polynomial(
            equations(config), states, scale, np.array([longest]), orders.order
        )
    margin = step_module.GROWTH * states.error + step_module.MARGIN * scale
    frame = frames_of(states.frame)
    step = _Steps(equations(config), states.space, frame, scale, h, p, margin, orders)
    return step, enclosed_system(config, lambda values: values)


def p_at(step, z, tau):
    """Return p at z and τ, which may be complex."""
    monomials = np.prod(np.array(z) ** np.array(step.space.exponents), axis=1)
    powers = tau ** np.arange(step.p.shape[-1])
    return np.einsum("imk,m,k->i", step.p[0], monomials, powers)


def corners_of_z(step):
    return [np.array(z) for z in product((-1.0, 0.3, 1.0), repeat=step.space.variables)]


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


def bounds_to_find(rng, sizes, n=4):
    """Return the arguments of `_error_bounds` for several steps; a larger size needs more."""
    shape, size = (len(sizes), n, n), np.array(sizes)[:, np.newaxis, np.newaxis]
    linear = LinearBounds(
        residual=1e-2 * size * rng.uniform(0, 1, shape),
        backward=np.eye(n) + size * rng.uniform(0, 1, shape),
        forward=np.eye(n) + size * rng.uniform(0, 1, shape),
        mismatch=0.2 * size * rng.uniform(0, 1, shape),
    )
    radius, d = rng.uniform(0, 1e-9, (2, len(sizes), n))
    G, margin = rng.uniform(0, 0.01, shape), rng.uniform(1e-7, 1e-6, (len(sizes), n))
    return linear, radius, d, G, margin


def test_the_bounds_of_a_step_satisfy_their_inequality():
    """In many steps at once, whose bounds are found by different attempts, or by none."""
    rng = np.random.default_rng(11)
    linear, radius, d, G, margin = bounds_to_find(rng, [0.1, 0.3, 9.0, 0.5, 0.2, 0.9, 0.05, 0.7])
    linear.mismatch[4] = 2 * np.eye(4)  # hopeless
    b, W, found = _error_bounds(linear, radius, d, G, margin)
    assert 3 < found.sum() < 7
    assert not found[[2, 4]].any()

    def at_once(guess):
        """Whether the first guess is enough, for each step."""
        inner = np.einsum("sij,sj->si", G, guess) + d
        first = radius + np.einsum("sij,sj->si", linear.residual, guess)
        first = first + np.einsum("sij,sj->si", linear.backward, inner)
        reached = np.einsum("sij,sj->si", linear.forward, first)
        return np.all(reached + np.einsum("sij,sj->si", linear.mismatch, guess) < guess, axis=-1)

    start = radius + np.einsum("sij,sj->si", linear.backward, d)
    early = at_once(1.1 * np.einsum("sij,sj->si", linear.forward, start))
    assert (found & early).any()
    assert (found & ~early).any()
    for k in np.flatnonzero(found):
        assert np.all(b[k] <= margin[k])
        inner = G[k] @ b[k] + d[k]
        assert np.all(radius[k] + linear.residual[k] @ b[k] + linear.backward[k] @ inner <= W[k])
        assert np.all(linear.forward[k] @ W[k] + linear.mismatch[k] @ b[k] < b[k])
    # The margin is a condition: slopes are bounded within it only. Each step has its own.
    narrow = np.where(np.arange(len(b))[:, np.newaxis] % 2, margin, np.minimum(margin, 0.9 * b))
    *_, again = _error_bounds(linear, radius, d, G, narrow)
    assert again.tolist() == (found & (np.arange(len(b)) % 2 == 1)).tolist()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["radius", "d", "G", "margin", "linear"])
def test_bounds_that_are_not_numbers_prove_nothing(name, bad):
    """They do not change what is found of the steps beside them."""
    n = 3
    one = np.stack([np.eye(n)] * 3)
    good: dict[str, Any] = {
        "linear": LinearBounds(*(x * one for x in (0.0, 1.0, 1.0, 0.0))),
        "radius": np.full((3, n), 1e-9),
        "d": np.full((3, n), 1e-9),
        "G": np.zeros((3, n, n)),
        "margin": np.full((3, n), 1e-6),
    }
    b, W, found = _error_bounds(**good)
    assert found.all()
    names = ["residual", "backward", "forward", "mismatch"] if name == "linear" else [name]
    for part in names:
        array = (getattr(good["linear"], part) if name == "linear" else good[name]).copy()
        array[1].flat[1] = bad
        broken = replace(good["linear"], **{part: array}) if name == "linear" else array
        with np.errstate(all="ignore"):
            other_b, other_W, proved = _error_bounds(**good | {name: broken})
        # An infinite margin is a condition that always holds: `disc` has no bounds then.
        assert proved.tolist() == [True, part == "margin" and bad == np.inf, True]
        assert np.array_equal(b[::2], other_b[::2])
        assert np.array_equal(W[::2], other_W[::2])


def test_what_is_beside_the_linear_flow_is_in_the_set_at_the_end(monkeypatch):
    """The mismatch of Φ and Ψ, and the rounding of the sums of p at the end."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7, width=1e-3, error=1e-9)
    given = stepped(config, states, scale)
    seen = {}

    def moved(flow, frame, W, beside, size):
        seen["beside"], seen["W"] = beside, W
        return given.end.frame, given.end.radius

    monkeypatch.setattr(step_module, "moved_frames", moved)
    missed = 1e-3 * np.ones((6, 6))
    original = linear_bounds

    def with_mismatch(flow, frame):
        found = original(flow, frame)
        return replace(found, mismatch=found.mismatch + missed)

    stepped(config, states, scale)
    without = seen["beside"]
    size = np.abs(states.polynomial).sum(axis=-1)
    assert np.all(without >= 10 * 2.0**-53 * size)
    assert np.all(without < 1e-12)
    monkeypatch.setattr(step_module, "linear_bounds", with_mismatch)
    stepped(config, states, scale)
    least = missed @ states.error[0] * 0.9
    assert np.all(seen["beside"] >= least)
    assert np.all(seen["W"] >= states.radius)


def test_the_set_at_the_end_has_all_powers_of_tau():
    """The last one counts, where the coefficient of a monomial in z is small."""
    config = random_config("visco-elastic", "Z", 5)
    states, scale = random_set(config, 7, width=1e-3, error=0.0)
    with proof_precision():
        longest = np.array([LONGEST])
        _, (p,) = step_module._polynomial(equations(config), states, scale, longest, 12)
    (end,) = stepped(config, states, scale).end.polynomial
    exact = np.array([[math.fsum(x) for x in row] for row in p.tolist()])
    rounding = 14 * 2.0**-53 * np.abs(p).sum(axis=2)
    assert np.any(np.abs(p[:, :, -1]) > 2 * rounding)
    assert np.all(np.abs(end - exact) <= rounding)


def test_numbers_beyond_those_of_the_bounds_on_underflow_are_refused():
    """The same parallelepiped, with long edges and small radii."""
    config = random_config("free", "Z", 5)
    states, scale = random_set(config, 7, width=1e-3, error=1e-9)
    sets = [
        replace(states, frame=np.diag(scale)[np.newaxis] * factor, radius=states.radius / factor)
        for factor in (1e17, 1e10, 1e17)
    ]
    assert tried(config, together(*sets), scale).proved.tolist() == [False, True, False]


def test_no_step_is_proved_of_sets_without_bounds():
    """By themselves, and beside good ones, which do not notice."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7)
    broken = []
    for bad in (np.nan, np.inf, -np.inf, 1e200, 1e300):
        p = states.polynomial.copy()
        p[0, 3, 1] = bad
        broken.append(replace(states, polynomial=p))
        p = states.polynomial.copy()
        p[0, 0, 0] = bad
        broken.append(replace(states, polynomial=p))
        broken.append(replace(states, radius=np.full((1, 6), abs(bad))))
        frame = states.frame.copy()
        frame[0, 2, 2] = bad
        broken.append(replace(states, frame=frame))
    broken.append(replace(states, frame=np.zeros((1, 6, 6))))
    for one in broken[::4]:
        assert not tried(config, one, scale).proved.any()
    good = stepped(config, states, scale)
    mixed = tried(config, together(*(x for one in broken for x in (states, one))), scale)
    assert mixed.proved.tolist() == [True, False] * len(broken)
    for k in range(0, len(mixed.h), 2):
        assert_equal(mixed, k, good, 0)
    for bad in (np.nan, np.inf, 0.0):
        sizes = scale.copy()
        sizes[4] = bad
        assert not tried(config, states, sizes).proved.any()
        assert tried(config, states, scale, [LONGEST]).proved.all()
        assert not tried(config, states, scale, [bad]).proved.any()
    two = tried(config, together(states, states), scale, [np.nan, LONGEST])
    assert two.proved.tolist() == [False, True]


@pytest.mark.parametrize("middle", [1.5, np.pi / 2])
def test_no_step_is_proved_where_cos_theta2_may_be_zero(middle):
    """The Euler angles are singular there."""
    config = random_config("free", "Z", 5)
    states, scale = random_set(config, 7, width=0.0)
    p = states.polynomial.copy()
    p[0, 1, 0], p[0, 1, 1] = middle, 0.1
    near = p.copy()
    near[0, 1, 0], near[0, 1, 1] = 1.2, 1e-4
    bad, good = (replace(states, polynomial=one) for one in (p, near))
    several = together(bad, good, bad, bad, bad, bad)
    longest = LONGEST * 2.0 ** -np.array([0, 2, 8, 16, 24, 32])
    assert tried(config, several, scale, longest).proved.tolist() == [False, True, *[False] * 4]


def test_the_polynomial_begins_at_the_set():
    """p at τ = 0 is P itself, without any rounding: nothing else accounts for a difference."""
    config = random_config("embedded", "W", 5)
    states, scale = random_set(config, 7)
    with proof_precision():
        for longest in (LONGEST, 0.3 * LONGEST):
            (h,), (p,) = step_module._polynomial(
                equations(config), states, scale, np.array([longest]), 12
            )
            assert 0 < h <= longest
            assert np.array_equal(p[:, :, 0], states.polynomial[0])
            last = np.abs(p[:, :, -2:]).sum(axis=1) / scale[:, np.newaxis]
            assert last.max() <= step_module.TOLERANCE * (1 + 1e-9)


def test_a_held_body_and_a_free_one_have_sets_of_their_size():
    for variant, coordinates, n in (
        ("permanent", "reduced", 6),
        ("embedded", "Z", len(random_set(random_config("embedded", "Z"))[1])),
    ):
        config = random_config(variant, coordinates, 1)
        states, scale = random_set(config, 2)
        assert isinstance(states, MotionSet)
        assert stepped(config, states, scale).end.radius.shape == (1, n) == (1, len(scale))


def assert_equal(many, k, one, j):
    """Check that two steps are the same, bit for bit."""
    assert many.h[k] == one.h[j]
    assert many.proved[k] == one.proved[j]
    for name in ("polynomial", "frame", "radius"):
        assert np.array_equal(getattr(many.end, name)[k], getattr(one.end, name)[j]), name


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
