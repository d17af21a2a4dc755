"""Protects the least energy of ligaments over the position: its values, bounds and rest states."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.ligaments import (
    least_tied_energy,
    ligament_of,
    random_ligaments,
    tied_energy,
)
from support.tied_springs import K_C, K_D, spring_of, tied_system

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.ligaments import free_bounds
from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy, reduced_energy
from rbstab.analysis.proof.searches.limits import BRIEF_LIGAMENT_BOX_LIMIT, search_limit

seeds = st.integers(0, 2**32)


@pytest.mark.parametrize("seed", range(4))
def test_the_energy_is_the_least_over_the_position(seed):
    rng = np.random.default_rng(seed)
    ligaments = random_ligaments(rng, 2)
    energy = reduced_energy(tied_system(ligaments))
    points = np.vstack([np.zeros(3), rng.uniform(-1.4, 1.4, size=(3, 3))])
    values = energy.form.value(points)
    found = [least_tied_energy(ligaments, Theta) for Theta in points]
    exact = np.array([one[0] for one in found])
    assert values - values[0] == pytest.approx(exact - exact[0], rel=1e-8, abs=1e-7)
    for Theta, (_, X) in zip(points, found, strict=True):
        q = energy.configuration(Theta)
        assert q[3:6] == pytest.approx(X, abs=1e-6)
        least = tied_energy(ligaments, Theta, q[3:6])
        for step in 1e-4 * np.eye(3):
            assert least <= min(tied_energy(ligaments, Theta, q[3:6] + d) for d in (step, -step))


def test_own_states_follow_the_position():
    """With an embedded connector q is a minimum of the stored energy over X and D."""
    system = tied_system([ligament_of()], 1.0, K_C, K_D)
    energy = reduced_energy(system)
    q = energy.configuration(np.array([0.3, -0.4, 0.8]))
    gradient = energy.configurations.gradient(q)
    assert np.abs(gradient[3:]).max() < 1e-8
    assert np.abs(gradient[:3]).max() > 1.0


@settings(max_examples=12, deadline=None)
@given(seeds)
def test_slopes_are_those_of_the_values(seed):
    rng = np.random.default_rng(seed)
    form = reduced_energy(tied_system(random_ligaments(rng, 2))).form
    points = rng.uniform(-1.4, 1.4, size=(4, 3))
    _, gradient, hessian = form.approximate(points, 2)
    for i, step in enumerate(1e-5 * np.eye(3)):
        (before, slope_before), (after, slope_after) = (
            form.approximate(points + d, 1) for d in (-step, step)
        )
        scale = 1 + np.abs(hessian).max()
        assert (after - before) / 2e-5 == pytest.approx(gradient[:, i], abs=1e-5 * scale)
        # Where the law changes its form, the second derivatives have a kink.
        bends = (slope_after - slope_before) / 2e-5
        assert np.abs(bends - hessian[:, i]).max() <= 1e-2 * scale


STIFFNESSES = st.sampled_from([300.0, 3e3, 3e4, 3e5])


@settings(max_examples=30, deadline=None)
@given(seeds, st.floats(1e-4, 0.4), STIFFNESSES)
@np.errstate(all="ignore")  # as in the searches
def test_bounds_over_boxes_contain_what_is_inside(seed, radius, stiffest):
    rng = np.random.default_rng(seed)
    form = reduced_energy(tied_system(random_ligaments(rng, 2, stiffest))).form
    centre = rng.uniform(-1.4, 1.4, size=(20, 3))
    bounds = enclosure(form, Boxes(centre - radius, centre + radius))
    value = form.value(centre)
    error = bounds.value_error + 1e-9 * (1 + np.abs(value))
    assert np.all(np.abs(value - bounds.value) <= error)
    for _ in range(8):
        step = rng.uniform(-radius, radius, size=centre.shape)
        _, gradient, hessian = form.approximate(centre + step, 2)
        noise = 1e-8 * (1 + np.abs(hessian).max())
        assert np.all(np.abs(hessian - bounds.hessian) <= bounds.hessian_radius + noise)
        linear = bounds.gradient + np.einsum("mij,mj->mi", bounds.hessian, step)
        assert np.all(np.abs(gradient - linear) <= bounds.curvature + noise)


@np.errstate(all="ignore")
def test_bounds_become_sharp_as_boxes_shrink():
    """Stiff ligaments, whose direction must not be known well: both ways to bound ζ are used."""
    rng = np.random.default_rng(5)
    form = reduced_energy(tied_system(random_ligaments(rng, 3, 3e5))).form
    centre = rng.uniform(-1.4, 1.4, size=(30, 3))
    _, _, hessian = form.approximate(centre, 2)
    sizes = []
    for radius in (1e-2, 1e-3, 1e-4, 1e-5):
        bounds = enclosure(form, Boxes(centre - radius, centre + radius))
        sizes.append(np.median(bounds.hessian_radius.max(axis=(1, 2))))
    # In proportion to the radius, so the lost terms of second order do not matter.
    assert sizes[1] / sizes[2] == pytest.approx(10, rel=0.5)
    assert sizes[3] < 1e-3 * np.abs(hessian).max()


@settings(max_examples=25, deadline=None)
@given(seeds, st.floats(1e-4, 0.3), STIFFNESSES)
@np.errstate(all="ignore")
def test_the_shift_of_the_position_is_bounded(seed, radius, stiffest):
    """ζ = z - ẑ - Cδ, with the z of `shift`, is where it is said to be; both bounds are used."""
    rng = np.random.default_rng(seed)
    free = reduced_energy(tied_system(random_ligaments(rng, 2, stiffest))).ligaments
    assert free is not None
    centre = rng.uniform(-1.4, 1.4, size=(20, 3))
    t = max(free.forms, key=lambda form: len(form.coefficients)).basis(centre)
    over = free_bounds._Enclosure(free, t, Boxes(centre - radius, centre + radius))
    nothing = np.zeros_like(centre)
    widths = over._shifts(over._parts(Intervals(nothing, nothing)))[2]
    for _ in range(8):
        step = rng.uniform(-radius, radius, size=centre.shape)
        zeta = free.shift(centre + step) - over.z.middle
        zeta -= np.einsum("mki,mi->mk", over.C.middle, step)
        assert np.all(np.abs(zeta) <= widths + 1e-12)


@np.errstate(all="ignore")
@pytest.mark.parametrize("share", [1.01, 0.5, 0.0])
def test_wrong_shifts_only_make_bounds_wider(monkeypatch, share):
    """ẑ, C and B need not be accurate: with others the bounds still contain what is inside.

    With another C the mixed derivatives of W, which it makes small, are not.
    """
    rng = np.random.default_rng(6)
    energy = reduced_energy(tied_system(random_ligaments(rng, 2, 3e3)))
    form, free = energy.form, energy.ligaments
    assert free is not None
    centre, radius = rng.uniform(-1.4, 1.4, size=(40, 3)), 0.005
    step = rng.uniform(-radius, radius, size=centre.shape)
    value, slope, _ = form.approximate(centre, 2)
    _, gradient, hessian = form.approximate(centre + step, 2)
    boxes = Boxes(centre - radius, centre + radius)
    sharp = enclosure(form, boxes)
    shift = type(free).shift
    monkeypatch.setattr(type(free), "shift", lambda self, Theta: shift(self, Theta) + 1e-3)
    chosen = free_bounds._Enclosure._chosen

    def perturbed(self, S):
        C, B = chosen(self, S)
        return exact(C.middle * share), B * 0.9

    monkeypatch.setattr(free_bounds._Enclosure, "_chosen", perturbed)
    wide = enclosure(form, boxes)
    # The shift of 1 mm is seen in the energy and in its slopes.
    assert np.all(np.abs(value - wide.value) <= wide.value_error)
    assert np.all(np.abs(slope - wide.gradient) <= wide.gradient_error)
    assert np.abs(value - wide.value).max() > 1e-4
    assert np.abs(slope - wide.gradient).max() > 1e-3
    assert np.all(np.abs(hessian - wide.hessian) <= wide.hessian_radius)
    linear = wide.gradient + np.einsum("mij,mj->mi", wide.hessian, step)
    assert np.all(np.abs(gradient - linear) <= wide.curvature)
    assert wide.hessian_radius.mean() > sharp.hessian_radius.mean()


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_the_global_bounds_hold(seed):
    rng = np.random.default_rng(seed)
    free = reduced_energy(tied_system(random_ligaments(rng, 2))).ligaments
    assert free is not None
    value, slope = free.approximate(rng.uniform(-np.pi, np.pi, size=(500, 3)), 1)
    assert value.max() <= free.largest
    assert np.all(np.abs(slope).max(axis=0) <= free.steepest)


def test_springs_beside_ligaments_need_six_variables():
    system = tied_system([spring_of(), ligament_of()])
    with pytest.raises(NoReducedEnergy) as error:
        reduced_energy(system)
    assert error.value.reason is NoEnergyReason.SIX_VARIABLES


def test_more_ligaments_are_searched_with_fewer_boxes():
    one = search_limit(tied_system([ligament_of()]), brief=True)
    assert one.boxes == BRIEF_LIGAMENT_BOX_LIMIT
    three = tied_system(random_ligaments(np.random.default_rng(0), 3))
    few, many = search_limit(three, brief=True), search_limit(three, brief=False)
    assert (few.boxes, few.slow) == (BRIEF_LIGAMENT_BOX_LIMIT // 3, True)
    assert many.boxes > 10 * few.boxes


@np.errstate(all="ignore")
def test_bounds_hold_for_a_stiffness_of_very_different_eigenvalues():
    """B'SB is then 1 only roughly, and its eigenvalues are bounded rigorously."""
    turned = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    K_c = turned @ np.diag([1e-3, 1e4, 1e10]) @ turned.T
    form = reduced_energy(tied_system([ligament_of(stiffness=3e3)], 1.0, 0.5 * (K_c + K_c.T))).form
    centre = np.random.default_rng(1).uniform(-1.2, 1.2, size=(20, 3))
    radius = 0.01
    bounds = enclosure(form, Boxes(centre - radius, centre + radius))
    step = np.random.default_rng(2).uniform(-radius, radius, size=centre.shape)
    _, gradient, hessian = form.approximate(centre + step, 2)
    noise = 1e-6 * (1 + np.abs(hessian).max())
    assert np.all(np.abs(hessian - bounds.hessian) <= bounds.hessian_radius + noise)
    linear = bounds.gradient + np.einsum("mij,mj->mi", bounds.hessian, step)
    assert np.all(np.abs(gradient - linear) <= bounds.curvature + noise)
