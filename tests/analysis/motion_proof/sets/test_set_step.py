"""Steps of sets of motions: all exact motions end in the set at the end, and each bound holds."""

import math
from dataclasses import replace
from functools import cache, partial
from itertools import product

import numpy as np
import pytest
from flint import arb, ctx
from support.exact_motions import state_after
from support.polynomial_sets import BITS, place_in_frame, state_of
from support.start_sets import VARIANTS, random_config, random_set

from rbstab.analysis.exact import decimal_balls
from rbstab.analysis.motion_proof.linear_flow import LinearBounds, frame_of, linear_bounds
from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.sets import set_step as step_module
from rbstab.analysis.motion_proof.sets.equations import equations_of
from rbstab.analysis.motion_proof.sets.graph import Graph
from rbstab.analysis.motion_proof.sets.models import program
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.set_step import RATIO, _error_bounds, _Step, set_step
from rbstab.analysis.motion_proof.taylor import (
    DiscBounds,
    JacobianSeries,
    jacobian_series,
    jacobian_slopes,
)
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
    with proof_precision():
        step = set_step(equations(config), states, scale, longest)
    assert step is not None
    return step


def ends(config, states, step, starts):
    """Yield the place of exact ends in the frame at the end, relative to its radii."""
    for z, w in starts:
        y = state_of(states, z.tolist(), w.tolist())
        end = state_after(exact_system(config), y, step.h)
        yield place_in_frame(step.end, z.tolist(), end) / step.end.radius


@pytest.mark.parametrize(("error", "width"), [(1e-6, 1e-2), (0.0, 1e-3), (1e-13, 3e-3)])
@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_all_motions_end_in_the_set(variant, coordinates, error, width):
    """Corners and inner points, in wide sets and in those where only rounding counts."""
    config, rng = random_config(variant, coordinates, 5), np.random.default_rng(6)
    states, scale = random_set(config, 7, width=width, error=error)
    step = stepped(config, states, scale)
    starts = [
        (rng.choice([-1.0, 1.0], 2), states.radius * rng.choice([-1.0, 1.0], len(scale))),
        (rng.uniform(-1, 1, 2), states.radius * rng.uniform(-1, 1, len(scale))),
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
    h_J = step.h * jacobian(doubles.rates, np.array([float(x) for x in start]))
    flow = np.linalg.matrix_power(np.eye(n) + h_J / 4096, 4096)
    moved = np.linalg.solve(step.end.frame, flow @ states.frame)
    reached = [
        abs(place[axis])
        for axis in (0, n // 2, n - 1)
        for place in ends(config, states, step, [(z, states.radius * np.sign(moved[axis]))])
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
        y = state_after(exact_system(config), y, step.h)
        states = step.end
        assert np.all(np.abs(place_in_frame(states, z.tolist(), y)) <= states.radius)
    assert states.error.max() < 1e-9


def a_step(variant="visco-elastic", coordinates="Z", *, width=1e-2, error=1e-5, longest=LONGEST):
    """Return a step that is to be proved, and the equations in doubles."""
    config = random_config(variant, coordinates, 5)
    states, scale = random_set(config, 7, width=width, error=error)
    with proof_precision():
        h, p = step_module._polynomial(equations(config), states, scale, longest)
    margin = step_module.GROWTH * states.error + step_module.MARGIN * scale
    frame = frame_of(states.frame)
    assert frame is not None
    step = _Step(equations(config), states.space, frame, scale, h, p, margin)
    return step, enclosed_system(config, lambda values: values)


def p_at(step, z, tau):
    """Return p at z and τ, which may be complex."""
    monomials = np.prod(np.array(z) ** np.array(step.space.exponents), axis=1)
    powers = tau ** np.arange(step.p.shape[2])
    return np.einsum("imk,m,k->i", step.p, monomials, powers)


def corners_of_z(step):
    return [np.array(z) for z in product((-1.0, 0.3, 1.0), repeat=step.space.variables)]


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_the_disc_holds_for_all_z_and_errors(variant, coordinates):
    """For complex τ on the circle of radius ρ, all z, and complex errors within the margin."""
    rng = np.random.default_rng(3)
    step, system = a_step(variant, coordinates, width=3e-2, error=1e-2)
    with proof_precision():
        bounds = step.disc()
    assert bounds.finite
    n = len(step.scale)
    for z in corners_of_z(step):
        tau = RATIO * np.exp(2j * np.pi * rng.random())
        e = step.margin * np.exp(2j * np.pi * rng.random(n))
        y = p_at(step, z, tau) + e
        assert np.all(np.abs(step.h * system.rates(y)) <= bounds.rates)
        slopes = step.h * complex_jacobian(system.rates, y)
        assert np.all(np.abs(slopes) <= bounds.jacobian * (1 + 1e-6) + 1e-6)


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
            p[:, 1, part] += step.scale / RATIO**part  # the most at |τ| = ρ
            wider = replace(step, p=p)
        found = wider.disc().rates
    # |hf| of the position is h|V|. V reaches further in a square of complex numbers.
    more = (found - least)[6:9] / (step.h * step.scale[9:12])
    assert np.all(more >= 1.0)
    assert np.all(more < 1.5)


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_the_defect_is_above_what_is_seen(variant, coordinates):
    """|hf(p) - p'| at points, in balls; a wide set, so that degrees that are left out count."""
    step, _ = a_step(variant, coordinates, width=3e-2)
    config = random_config(variant, coordinates, 5)
    with proof_precision():
        bound = step.defect(step.disc())
    seen = np.zeros(len(bound))
    for z in corners_of_z(step):
        for tau in (0.0, 0.5, 1.0):
            with ctx.workprec(BITS):
                y, rate = exact_p(step, z, tau)
                hf = [arb(step.h) * x for x in exact_system(config).rates(y)]
                apart = [abs(a - b) for a, b in zip(hf, rate, strict=True)]
                assert all(x <= arb(b) for x, b in zip(apart, bound.tolist(), strict=True))
                seen = np.maximum(seen, [float(x) for x in apart])
    rough = seen > 1e-12 * step.scale
    assert rough.any()
    assert np.all(bound[rough] < 300 * seen[rough])


def exact_p(step, z, tau):
    """Return p and p' at a point as balls."""
    values, rates = [], []
    for row in step.p.tolist():
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


def test_the_defect_has_the_rounding_and_the_rest_of_its_series():
    step, _ = a_step(width=0.0, error=0.0)
    n = len(step.scale)
    none = DiscBounds(np.zeros(n), np.zeros((n, n)))
    unit = DiscBounds(np.full(n, 1.0), np.zeros((n, n)))
    with proof_precision():
        rounding, whole = step.defect(none), step.defect(unit)
    assert np.all(rounding > 0)
    # Cauchy's estimate: Σ ρ⁻ᵏ from the first power of τ that is not computed, which is 13.
    assert whole - rounding == pytest.approx(sum(8.0**-k for k in range(13, 60)), rel=1e-6)


def test_the_rounding_of_a_rate_that_is_a_state_is_in_the_defect():
    """The rate of the position is the velocity, without rounding; h times it is rounded."""
    step, _ = a_step("free", "Z", width=0.0, error=0.0)
    p, n = np.zeros_like(step.p), len(step.scale)
    p[9:12, 0, 0] = step.p[9:12, 0, 0] + 0.1
    p[6:9, 0, 1] = step.h * p[9:12, 0, 0]
    with proof_precision():
        bound = replace(step, p=p).defect(DiscBounds(np.zeros(n), np.zeros((n, n))))
    with ctx.workprec(BITS):
        for i in range(3):
            apart = abs(arb(step.h) * arb(p[9 + i, 0, 0]) - arb(p[6 + i, 0, 1]))
            assert 0 < apart <= arb(bound[6 + i])


def test_the_rounding_of_a_slope_that_is_a_state_is_in_the_difference():
    """∂(xy)/∂x = y has no rounding; h times it is rounded."""
    step, _ = a_step("free", "Z", width=0.0, error=0.0)
    graph = Graph()
    x, y = graph.variables(2)
    slopes = program(graph, [graph.derivative(x * y, 0)])
    n = len(step.scale)
    made = step.equations._replace(jacobian=slopes, places=((0, 0),))
    step = replace(step, equations=made, margin=np.zeros(n))
    middle = np.zeros((12, n, n))
    middle[:, 0, 0] = step.h * step.p[1, 0, :12]
    with proof_precision():
        G = step.apart(JacobianSeries(middle, np.zeros_like(middle), np.zeros((n, n))))
    with ctx.workprec(BITS):
        pairs = zip(step.p[1, 0, :12].tolist(), middle[:, 0, 0].tolist(), strict=True)
        exact = [arb(step.h) * coefficient - computed for coefficient, computed in pairs]
        assert 0 < abs(exact[0]) <= sum(map(abs, exact), arb(0)) <= arb(G[0, 0])
    assert G[0, 0] < 1e-15


def test_a_polynomial_that_does_not_follow_the_equations_has_a_defect():
    """Each coefficient of p, for z and for τ, counts."""
    step, _ = a_step(width=1e-2)
    with proof_precision():
        bounds = step.disc()
        given = step.defect(bounds)
        for place in ((6, 0, 1), (6, 2, 3), (0, 1, 12), (9, 5, 2)):
            p = step.p.copy()
            p[place] += 1e-6
            k = place[2]
            found = replace(step, p=p).defect(bounds)
            assert found[place[0]] - given[place[0]] > 0.5e-6 * k


def jacobian_of(step, bounds):
    with proof_precision():
        slopes = jacobian_slopes(step.field, step.middle, step_module.JACOBIAN_TERMS)
        return jacobian_series(slopes, step_module.JACOBIAN_TERMS, 1.0, RATIO, bounds)


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
@pytest.mark.parametrize(("width", "error"), [(3e-2, 1e-9), (1e-9, 1e-3), (3e-2, 1e-2)])
def test_slopes_differ_by_no_more_than_their_bound(variant, coordinates, width, error):
    """|h∂f/∂y(p + e) - hJ| at corners of z, of the error, and at times of the step."""
    rng = np.random.default_rng(3)
    step, system = a_step(variant, coordinates, width=width, error=error)
    with proof_precision():
        bounds = step.disc()
        J = jacobian_of(step, bounds)
        G = step.apart(J)
    seen, zero = np.zeros_like(G), np.zeros(step.space.variables)
    for z in corners_of_z(step):
        for tau in (0.0, 1.0):
            e = step.margin * rng.choice([-1.0, 1.0], len(step.scale))
            there = jacobian(system.rates, p_at(step, z, tau) + e)
            at_middle = jacobian(system.rates, p_at(step, zero, tau))
            seen = np.maximum(seen, np.abs(step.h * (there - at_middle)))
    size = np.abs(J.middle).sum(axis=0)
    assert np.all(seen <= G + 1e-13 * size.max())
    large = 0.1 * G.max() < G
    assert np.all(G[large] < (2 if error < 1e-6 else 40) * seen[large])


def test_the_rest_of_both_series_of_slopes_is_in_their_difference():
    """J and J̄ both have terms that are not computed, and J has errors."""
    step, _ = a_step(width=0.0, error=0.0)
    step = replace(step, margin=np.zeros(len(step.scale)))
    n = len(step.scale)
    with proof_precision():
        J = jacobian_of(step, DiscBounds(np.zeros(n), np.zeros((n, n))))
        given = step.apart(J)
        ones = np.ones((n, n))
        found = step.apart(replace(J, rest=ones, radius=J.radius + 0.25))
    assert found - given == pytest.approx((2.0 + 0.25 * len(J.middle)) * ones, rel=1e-6)
    # Without z and e, what remains is rounding.
    places = np.array(step.equations.places).T
    assert np.all(given[tuple(places)] > 0)
    assert given.max() < 1e-12 * np.abs(J.middle).max()


def test_no_higher_degree_of_z_is_lost_in_the_slopes():
    """p with z⁴ only, which models of degree 3 have in their remainders."""
    step, system = a_step(width=0.0, error=0.0)
    p = step.p.copy()
    p[0, step.space.place[4, 0], 0] = 0.3
    step = replace(step, p=p)
    with proof_precision():
        G = step.apart(jacobian_of(step, step.disc()))
    there, middle = (
        jacobian(system.rates, p_at(step, np.array([x, 0.0]), 1.0)) for x in (1.0, 0.0)
    )
    seen = step.h * np.abs(there - middle)
    assert seen.max() > 1e-4
    assert np.all(seen <= G + 1e-13)


def test_the_bounds_of_a_step_satisfy_their_inequality():
    rng = np.random.default_rng(11)
    n, found = 4, 0
    for size in (0.1, 0.3, 0.5, 0.9):
        linear = LinearBounds(
            residual=1e-2 * rng.uniform(0, size, (n, n)),
            backward=np.eye(n) + rng.uniform(0, size, (n, n)),
            forward=np.eye(n) + rng.uniform(0, size, (n, n)),
            mismatch=rng.uniform(0, 0.2 * size, (n, n)),
        )
        radius, d = rng.uniform(0, 1e-9, n), rng.uniform(0, 1e-9, n)
        G, margin = rng.uniform(0, 0.01, (n, n)), rng.uniform(1e-7, 1e-6, n)
        bounds = _error_bounds(linear, radius, d, G, margin)
        if bounds is None:
            continue
        found += 1
        b, W = bounds
        assert np.all(b <= margin)
        assert np.all(radius + linear.residual @ b + linear.backward @ (G @ b + d) <= W)
        assert np.all(linear.forward @ W + linear.mismatch @ b < b)
        # The margin is a condition: slopes are bounded within it only.
        assert _error_bounds(linear, radius, d, G, 0.9 * b) is None
    assert found > 1
    hopeless = replace(linear, mismatch=2 * np.eye(n))
    assert _error_bounds(hopeless, radius, d, G, margin) is None


@pytest.mark.parametrize("name", ["radius", "d", "G", "margin"])
def test_bounds_that_are_not_numbers_prove_nothing(name):
    n = 3
    linear = LinearBounds(*(x * np.eye(n) for x in (0.0, 1.0, 1.0, 0.0)))
    good = {
        "radius": np.full(n, 1e-9),
        "d": np.full(n, 1e-9),
        "G": np.zeros((n, n)),
        "margin": np.full(n, 1e-6),
    }
    assert _error_bounds(linear, **good) is not None
    bad = good[name].copy()
    bad.flat[1] = np.nan
    assert _error_bounds(linear, **good | {name: bad}) is None


def test_what_is_beside_the_linear_flow_is_in_the_set_at_the_end(monkeypatch):
    """The mismatch of Φ and Ψ, and the rounding of the sums of p at the end."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7, width=1e-3, error=1e-9)
    given = stepped(config, states, scale)
    seen = {}

    def moved(flow, frame, W, beside, size):
        seen["beside"], seen["W"] = beside, W
        return given.end.frame, given.end.radius

    monkeypatch.setattr(step_module, "moved_frame", moved)
    missed = 1e-3 * np.ones((6, 6))
    original = linear_bounds

    def with_mismatch(flow, frame):
        found = original(flow, frame)
        return replace(found, mismatch=found.mismatch + missed)

    stepped(config, states, scale)
    without = seen["beside"]
    size = np.abs(states.polynomial).sum(axis=1)
    assert np.all(without >= 10 * 2.0**-53 * size)
    assert np.all(without < 1e-12)
    monkeypatch.setattr(step_module, "linear_bounds", with_mismatch)
    stepped(config, states, scale)
    least = missed @ states.error * 0.9
    assert np.all(seen["beside"] >= least)
    assert np.all(seen["W"] >= states.radius)


def test_the_set_at_the_end_has_all_powers_of_tau():
    """The last one counts, where the coefficient of a monomial in z is small."""
    config = random_config("visco-elastic", "Z", 5)
    states, scale = random_set(config, 7, width=1e-3, error=0.0)
    with proof_precision():
        _, p = step_module._polynomial(equations(config), states, scale, LONGEST)
    end = stepped(config, states, scale, LONGEST).end.polynomial
    exact = np.array([[math.fsum(x) for x in row] for row in p.tolist()])
    rounding = 14 * 2.0**-53 * np.abs(p).sum(axis=2)
    assert np.any(np.abs(p[:, :, -1]) > 2 * rounding)
    assert np.all(np.abs(end - exact) <= rounding)


def test_numbers_beyond_those_of_the_bounds_on_underflow_are_refused():
    """The same parallelepiped, with long edges and small radii."""
    config = random_config("free", "Z", 5)
    states, scale = random_set(config, 7, width=1e-3, error=1e-9)
    with proof_precision():
        for factor, proved in ((1e10, True), (1e17, False)):
            frame, radius = np.diag(scale) * factor, states.radius / factor
            one = replace(states, frame=frame, radius=radius)
            assert (set_step(equations(config), one, scale, LONGEST) is not None) == proved


def test_no_step_is_proved_of_sets_without_bounds():
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7)
    broken = []
    for bad in (np.nan, np.inf, 1e200):
        p = states.polynomial.copy()
        p[3, 1] = bad
        broken.append(replace(states, polynomial=p))
        broken.append(replace(states, radius=np.full(6, bad)))
        frame = states.frame.copy()
        frame[2, 2] = bad
        broken.append(replace(states, frame=frame))
    broken.append(replace(states, frame=np.zeros((6, 6))))
    with proof_precision():
        for one in broken:
            assert set_step(equations(config), one, scale, LONGEST) is None
        for bad in (np.nan, np.inf, 0.0):
            sizes = scale.copy()
            sizes[4] = bad
            assert set_step(equations(config), states, sizes, LONGEST) is None
        assert set_step(equations(config), states, scale, LONGEST) is not None


@pytest.mark.parametrize("middle", [1.5, np.pi / 2])
def test_no_step_is_proved_where_cos_theta2_may_be_zero(middle):
    """The Euler angles are singular there."""
    config = random_config("free", "Z", 5)
    states, scale = random_set(config, 7, width=0.0)
    p = states.polynomial.copy()
    p[1, 0], p[1, 1] = middle, 0.1
    with proof_precision():
        for longest in LONGEST * 2.0 ** -np.arange(0, 40, 8):
            assert (
                set_step(equations(config), replace(states, polynomial=p), scale, longest) is None
            )
        p[1, 0], p[1, 1] = 1.2, 1e-4
        good = replace(states, polynomial=p)
        assert set_step(equations(config), good, scale, LONGEST / 4) is not None


def test_the_polynomial_begins_at_the_set():
    """p at τ = 0 is P itself, without any rounding: nothing else accounts for a difference."""
    config = random_config("embedded", "W", 5)
    states, scale = random_set(config, 7)
    with proof_precision():
        for longest in (LONGEST, 0.3 * LONGEST):
            h, p = step_module._polynomial(equations(config), states, scale, longest)
            assert 0 < h <= longest
            assert np.array_equal(p[:, :, 0], states.polynomial)
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
        assert len(stepped(config, states, scale).end.radius) == len(scale) == n
