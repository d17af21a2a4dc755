"""The reduced energy U(Θ) is the stored energy minimised over all lengths, with proved errors."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from support.duals import arbs, energy_dual, reduced_derivatives
from support.paper_runs import paper_config
from support.rest import (
    DAMPING,
    HEAVY,
    coordinates_of,
    inverted_pendulum,
    paper_system,
    random_rest_system,
)
from support.systems import VARIANTS

import rbstab
from rbstab.analysis.configuration import configurations
from rbstab.analysis.proof.polynomial import Ring
from rbstab.analysis.proof.reduced_energy import (
    NoEnergyReason,
    NoReducedEnergy,
    eliminated,
    reduced_energy,
)
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import system_of as config_system
from rbstab.elements.element import Element
from rbstab.elements.gravity import Gravity
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Number
from rbstab.systems.coordinates import ContactCoordinates, ManifoldCoordinates


def settled_energy(system, Theta):
    """Return U, ∇U and the configuration, by complex steps and a linear solve."""
    still = configurations(system)
    lengths = still.size - 3
    unsettled = still.gradient(np.concatenate([Theta, np.zeros(lengths)]))[3:]
    columns = [still.gradient(np.concatenate([Theta, unit]))[3:] for unit in np.eye(lengths)]
    x = np.zeros(0)
    if lengths:
        x = -np.linalg.solve(np.array(columns).T - unsettled[:, np.newaxis], unsettled)
    q = np.concatenate([Theta, x])
    return still.energy(q), still.gradient(q)[:3], q


@pytest.fixture(params=VARIANTS)
def variant(request):
    return request.param


@pytest.fixture
def system(rng, variant):
    return random_rest_system(rng, variant)


def test_it_is_the_least_of_the_stored_energy(system, rng):
    energy = reduced_energy(system)
    for Theta in rng.uniform(-3, 3, size=(5, 3)):
        value, gradient, q = settled_energy(system, Theta)
        (found,), (slope,) = energy.form.approximate(Theta[np.newaxis], 1)
        scale = np.abs(value) + np.abs(gradient).max()
        assert found == pytest.approx(value, rel=0, abs=1e-12 * scale)
        np.testing.assert_allclose(slope, gradient, rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(energy.configuration(Theta), q, rtol=0, atol=1e-12)


def test_everything_else_has_settled(system, rng):
    energy = reduced_energy(system)
    still = energy.configurations
    q = energy.configuration(rng.uniform(-3, 3, size=3))
    np.testing.assert_allclose(still.gradient(q)[3:], 0, atol=1e-10)
    for _ in range(10):
        shifted = q + np.concatenate([np.zeros(3), rng.normal(size=still.size - 3) * 0.1])
        assert still.energy(shifted) >= still.energy(q)


def test_intervals_through_the_equations_agree_to_the_stated_error(system, rng):
    form = reduced_energy(system).form
    for Theta in rng.uniform(-3, 3, size=(3, 3)):
        with ctx.workprec(200):
            exact = reduced_derivatives(system, arbs(Theta))
        for found, interval in zip(form.rigorous(Theta[np.newaxis], 2), exact, strict=True):
            bounds: Any = np.asarray(interval, dtype=object)
            for place, value in np.ndenumerate(found.values[0]):
                widened = arb(float(value), float(found.error[place]))
                assert widened.contains(bounds[place])


def test_intervals_over_a_box_hold_the_values_in_it(system, rng):
    form = reduced_energy(system).form
    centre, radius = rng.uniform(-1, 1, size=3) * [3, 1.4, 3], 1e-3
    box = np.array([arb(x, radius) for x in centre.tolist()], dtype=object)
    intervals = reduced_derivatives(system, box)
    points = centre + rng.uniform(-radius, radius, size=(20, 3))
    for values, interval in zip(form.approximate(points, 2), intervals, strict=True):
        for place, bounds in np.ndenumerate(np.asarray(interval, dtype=object)):
            low, high = float(bounds.lower()), float(bounds.upper())
            inside = values[(slice(None), *place)]
            assert np.all((low <= inside) & (inside <= high))


def test_duals_agree_with_complex_steps(system, rng):
    still = configurations(system)
    q = rng.uniform(-1, 1, size=still.size)
    found = energy_dual(system, arbs(q))
    np.testing.assert_allclose(
        [float(entry) for entry in found.gradient],
        still.gradient(q),
        rtol=1e-12,
        atol=1e-12 * np.abs(still.gradient(q)).max(),
    )


def test_coordinates_do_not_matter(rng):
    held = random_rest_system(rng, "permanent")
    tied = random_rest_system(rng, "embedded")
    pairs = [(held, ManifoldCoordinates(2.0)), (tied, ContactCoordinates())]
    for system, other in pairs:
        one, two = (reduced_energy(s).form for s in (system, replace(system, coordinates=other)))
        np.testing.assert_array_equal(one.coefficients, two.coefficients)
        np.testing.assert_array_equal(one.quadratic, two.quadratic)


def test_free_body_keeps_its_rotational_stiffness_alone():
    form = reduced_energy(paper_system("free", weight=HEAVY)).form
    np.testing.assert_array_equal(form.quadratic, np.diag([400, 400, 320]))
    assert form.coefficients.size == 1
    # Half of the weight's work is stored in the spring of 3280 N/m.
    assert form.coefficients[0, 0, 0] == -0.5 * 410 * 0.125


def test_inverted_pendulum_is_what_its_helper_says(rng):
    Theta = rng.uniform(-1.5, 1.5, size=(10, 3))
    form = reduced_energy(inverted_pendulum([3.0, 5.0, 7.0], 2.0)).form
    upright = np.cos(Theta[:, 0]) * np.cos(Theta[:, 1])
    expected = 0.5 * Theta**2 @ np.array([3, 5, 7]) - 2 * (1 - upright)
    np.testing.assert_allclose(form.value(Theta), expected, rtol=0, atol=1e-14)


def test_rest_state_is_a_zero(variant):
    system = paper_system(variant, 0.3, HEAVY, (0.01, -0.02, 0.03))
    rest = nearest_rest_state(system)
    energy = reduced_energy(system)
    Theta = rest.motion.Theta
    np.testing.assert_allclose(energy.form.approximate(Theta[np.newaxis], 1)[1], 0, atol=1e-10)
    assert energy.form.value(Theta[np.newaxis])[0] == pytest.approx(rest.energy, rel=1e-12)
    q = energy.configuration(Theta)
    np.testing.assert_allclose(q[energy.configurations.pose_size :], rest.own, rtol=0, atol=1e-12)
    np.testing.assert_allclose(energy.configurations.motion(q).X, rest.motion.X, rtol=0, atol=1e-12)


def reason(*elements, variant="visco-elastic"):
    base = paper_system("permanent" if variant == "permanent" else "free")
    system = replace(base, elements=elements, coordinates=coordinates_of(variant))
    with pytest.raises(NoReducedEnergy) as raised:
        reduced_energy(system)
    assert str(raised.value) == raised.value.reason.value
    return raised.value.reason


STABILIZER = TranslationalStabilizer(np.eye(3), DAMPING)


def sliding(rate_weight):
    zero, slope = np.zeros(3), 20.0 if rate_weight else 1.0
    return SlidingConnector(np.full(3, 2e3), rate_weight, slope, zero, zero, 1e-3)


def test_sliding_connector_has_none():
    assert reason(STABILIZER, sliding(1.0)) is NoEnergyReason.NO_POTENTIAL
    assert reason(STABILIZER, sliding(0.0)) is NoEnergyReason.NOT_SMOOTH


@pytest.mark.parametrize("stiffness", [[0, 0, 0], [1, 1, 0], [1, -1, 1], [1, -1, -1]])
def test_body_that_nothing_holds_has_none(stiffness):
    loose = TranslationalStabilizer(np.diag(np.array(stiffness, dtype=float)), DAMPING)
    assert reason(Gravity(np.array(HEAVY)), loose) is NoEnergyReason.NOT_HELD


def test_body_without_elements_that_store_has_none_unless_held():
    assert reason() is NoEnergyReason.NOT_HELD
    held = replace(paper_system("permanent"), elements=())
    assert reduced_energy(held).form.coefficients.size == 1


@dataclass(frozen=True, eq=False)
class Spring(Element):
    """A spring that stores any given function of the motion."""

    name = "spring"

    law: Callable[[Motion], Number]

    def stored(self, motion, own):
        return self.law(motion)


@pytest.mark.parametrize(
    "law",
    [
        lambda motion: (motion.X @ motion.X) * (motion.X @ motion.X),
        lambda motion: motion.X @ motion.X * motion.Theta[0],
        lambda motion: motion.X @ motion.A @ motion.X,
    ],
)
def test_stiffness_that_is_not_constant_is_refused(law):
    assert reason(STABILIZER, Spring(law)) is NoEnergyReason.NOT_QUADRATIC


@pytest.mark.parametrize(
    "law",
    [
        lambda motion: motion.B[0, 0],
        lambda motion: motion.Theta[0] * motion.Theta[1] * motion.Theta[2],
        lambda motion: motion.Theta[0] * motion.A[0, 0],
    ],
)
def test_other_functions_of_the_angles_are_refused(law):
    assert reason(STABILIZER, Spring(law)) is NoEnergyReason.NOT_TRIGONOMETRIC


def test_spring_of_another_law_needs_no_word_of_its_own():
    # X[0] settles at -θ1, so U is -½ θ1².
    spring = Spring(lambda motion: motion.Theta[0] * motion.X[0])
    system = replace(paper_system("free"), elements=(STABILIZER, spring))
    np.testing.assert_array_equal(reduced_energy(system).form.quadratic, np.diag([-1, 0, 0]))


def loaded_free_config():
    """Return a config whose weight and energy at rest are not the products of its doubles."""
    gains = {"K_t": [0.9] * 3, "L_t": [1.0] * 3, "K_r": [0.9] * 3, "L_r": [1.0] * 3}
    return rbstab.load_config(
        {
            "body": {"mass": 0.7, "inertia": [1, 1, 1], "contact_point": [0, 0, 0]},
            "gravity": [0, 0, -0.3],
            "controller": {"variant": "free", **gains},
            "integration": {"duration": 1.0},
        }
    )


def test_energy_belongs_to_the_decimals_of_a_config():
    config = loaded_free_config()
    system = config_system(config)
    exact = reduced_energy(system, partial(config_system, config)).form.coefficients[0, 0, 0]
    # ½ (0.7 · 0.3)² / 0.9 in decimals.
    assert exact == -0.0245
    # Neither the rounded weight nor the doubles of the config give it.
    assert exact != reduced_energy(system).form.coefficients[0, 0, 0]
    in_doubles = -((Fraction(0.7) * Fraction(0.3)) ** 2) / 2 / Fraction(0.9)
    assert exact != float(in_doubles)


@pytest.mark.parametrize("variant", VARIANTS[1:])
def test_anchor_at_the_equilibrium_balances_the_weight_exactly(variant):
    """In doubles K_t⁻¹G is rounded, and the body would rest at a tiny angle."""
    controller = {"anchor": "equilibrium", "K_t": [0.3, 0.7, 0.9]}
    data = paper_config(variant, True, controller=controller)
    config = rbstab.load_config(data | {"gravity": [0.1, 0.2, -9.81]})
    exact = reduced_energy(config_system(config), partial(config_system, config))
    zero = np.zeros((1, 3))
    slope = exact.form.approximate(zero, 1)[1][0]
    # All that is left is the last digit of the sum of the coefficients.
    np.testing.assert_allclose(slope, 0, atol=2 * exact.form.round_off[1].max())
    rounded = reduced_energy(config_system(config)).form.coefficients
    assert np.any(rounded != exact.form.coefficients)


def test_config_beyond_double_precision_has_no_energy():
    data = paper_config("permanent", True) | {"gravity": [0.0, 0.0, -1e308]}
    config = rbstab.load_config(data)
    with np.errstate(all="ignore"):
        system = config_system(config)
    with pytest.raises(NoReducedEnergy, match="too large"):
        reduced_energy(system, partial(config_system, config))
    with pytest.raises(NoReducedEnergy, match="too large"):
        reduced_energy(system)


@pytest.mark.parametrize("variant", VARIANTS)
def test_energy_is_the_reduced_one_plus_a_square(variant):
    """Π(Θ, x) = U(Θ) + ½ (x - x*)'H(x - x*): an identity between exact polynomials in all of Θ, x.

    Lemma 2 of docs/proofs.md, for a config with full gains.
    """
    full = [[900, 20, 0.1], [20, 800.3, -30], [0.1, -30, 700]]
    controller = {"K_t": full, "K_r": full}
    config = rbstab.load_config(paper_config(variant, True, controller=controller))
    at_rest = configurations(config_system(config))
    ring = Ring(3, at_rest.size - 3)
    x = ring.variables()[3:]
    exact = configurations(config_system(config, ring.decimals))
    energy = exact.energy(ring.variables())
    reduced, minimizer = eliminated(energy)
    square = 0 * reduced
    for i, j in np.ndindex(len(x), len(x)):
        # ∂²Π/∂x_i∂x_j, as Π is of second degree in x.
        H = energy.length_coefficient(i, j) * (1 + (i == j))
        square = square + H * (x[i] - minimizer[i]) * (x[j] - minimizer[j]) * 0.5
    assert (energy - reduced - square).value == 0
    assert reduced.degree == 0
    if len(x):
        assert (energy - reduced).value != 0
