"""Protects the energy of a held body with ligaments: values, bounds and rest states."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import root
from support.held_springs import held_system, random_springs
from support.held_springs import length_of as spring_length
from support.ligaments import held_energy, ligament_of, random_ligaments
from support.proofs import rest_states

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.ligaments.held import LigamentLine
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.reduced_energy import reduced_energy

seeds = st.integers(0, 2**32)


@settings(max_examples=15, deadline=None)
@given(seeds)
def test_the_energy_is_that_of_the_equations(seed):
    rng = np.random.default_rng(seed)
    ligaments = random_ligaments(rng, 2)
    form = reduced_energy(held_system(ligaments)).form
    points = rng.uniform(-1.5, 1.5, size=(6, 3))
    at_zero = form.value(np.zeros((1, 3)))[0] - held_energy(ligaments, np.zeros(3))
    for Theta, value in zip(points, form.value(points), strict=True):
        exact = held_energy(ligaments, Theta) + at_zero
        assert value == pytest.approx(exact, rel=1e-10, abs=1e-9)


def test_springs_and_ligaments_add_up():
    rng = np.random.default_rng(3)
    ligaments, springs = random_ligaments(rng, 1), random_springs(rng, 1)
    form = reduced_energy(held_system([*springs, *ligaments])).form
    points = rng.uniform(-1.5, 1.5, size=(6, 3))
    (spring,) = springs
    extensions = [spring_length(spring, Theta) - spring.rest_length for Theta in points]
    added = [
        held_energy(ligaments, Theta) + 0.5 * spring.stiffness * extension**2
        for Theta, extension in zip(points, extensions, strict=True)
    ]
    difference = form.value(points) - np.array(added)
    assert np.ptp(difference) <= 1e-10 * np.abs(added).max()


@settings(max_examples=15, deadline=None)
@given(seeds, st.floats(1e-3, 0.5))
def test_bounds_over_boxes_contain_what_is_inside(seed, radius):
    rng = np.random.default_rng(seed)
    form = reduced_energy(held_system(random_ligaments(rng, 2, 2e4))).form
    centre = rng.uniform(-1.5, 1.5, size=(20, 3))
    boxes = Boxes(centre - radius, centre + radius)
    bounds = enclosure(form, boxes)
    for _ in range(10):
        step = rng.uniform(-radius, radius, size=centre.shape)
        value, gradient, hessian = form.approximate(centre + step, 2)
        noise = 1e-9 * (1 + np.abs(hessian).max())
        assert np.all(np.abs(hessian - bounds.hessian) <= bounds.hessian_radius + noise)
        linear = bounds.gradient + np.einsum("mij,mj->mi", bounds.hessian, step)
        assert np.all(np.abs(gradient - linear) <= bounds.curvature + noise)
        low, high = bounds.gradient_bounds
        assert np.all((low - noise <= gradient) & (gradient <= high + noise))
        assert np.all(np.isfinite(value))


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_the_global_bounds_hold(seed):
    rng = np.random.default_rng(seed)
    (line,) = reduced_energy(held_system(random_ligaments(rng, 1))).form.lines
    assert isinstance(line, LigamentLine)
    value, slope = line.approximate(rng.uniform(-np.pi, np.pi, size=(4000, 3)), 1)
    assert value.max() <= line.largest
    assert np.all(np.abs(slope).max(axis=0) <= line.steepest)


def test_all_rest_states_of_a_held_body_are_found_and_no_others():
    """scipy finds none but those listed, from 200 starts; a ligament makes two of them."""
    ligament = ligament_of(stiffness=600.0, slack_length=0.25, toe_strain=0.1)
    system = held_system([ligament], 1.0)
    found = rest_states(system)
    assert found.outcome is SearchOutcome.PROVED
    listed = np.array([point.Theta for point in found.states])

    def slope(Theta):
        ends = [(Theta + step, Theta - step) for step in 1e-6 * np.eye(3)]
        pairs = [[held_energy([ligament], one, 1.0) for one in end] for end in ends]
        return np.array([(after - before) / 2e-6 for after, before in pairs])

    rng, reached = np.random.default_rng(0), 0
    for start in rng.uniform([-np.pi, -1.57, -np.pi], [np.pi, 1.57, np.pi], size=(200, 3)):
        zero = root(slope, start, tol=1e-9)
        inside = np.all(np.abs(zero.x) < [np.pi, np.pi / 2, np.pi])
        if zero.success and inside and np.abs(zero.fun).max() < 1e-4:
            reached += 1
            assert np.abs(listed - zero.x).max(axis=1).min() < 1e-4
    assert reached > 20
    assert len(found.states) >= 1
    assert found.states[0].index == 0
