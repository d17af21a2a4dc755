"""The search finds the zeros of a gradient in the range, each once, in order of energy."""

import time

import numpy as np
import pytest
from support.rest import SADDLES, inverted_pendulum, paper_system

from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.searches.zeros import search
from rbstab.analysis.proof.trigonometric import TrigonometricForm


def form_of(variant, K_r_scale=1.0, **options):
    return reduced_energy(paper_system(variant, K_r_scale, **options)).form


def test_saddles_of_the_paper_body():
    found = search(form_of("permanent", 0.1))
    np.testing.assert_allclose(found, [np.zeros(3), *SADDLES], rtol=0, atol=5.1e-4)


def test_lowest_comes_first():
    form = form_of("visco-elastic", 0.01)
    energies = form.value(search(form))
    assert len(energies) == 4
    assert np.all(np.diff(energies) > 0)


def test_dozens_are_in_order_of_their_energy(rng):
    form = TrigonometricForm(np.eye(3), rng.normal(size=3), rng.normal(size=(5, 5, 5)))
    energies = form.value(search(form))
    assert len(energies) > 5
    assert np.all(np.diff(energies) > 0)


def test_zeros_are_exact_to_round_off():
    form = form_of("permanent", 0.03)
    gradient = form.approximate(search(form), 1)[1]
    assert np.all(np.abs(gradient) <= 2 * form.round_off[1])


@pytest.mark.parametrize("seed", range(1, 6))
def test_seed_does_not_matter(seed):
    form = form_of("visco-elastic", 0.03)
    np.testing.assert_allclose(search(form, seed), search(form), rtol=0, atol=1e-12)


def test_same_seed_gives_the_same_digits():
    form = form_of("permanent", 0.1)
    np.testing.assert_array_equal(search(form, 3), search(form, 3))


def test_zeros_beyond_the_range_are_left_out():
    no_waves = np.zeros((1, 1, 1))
    for axis, end in enumerate(RANGE_END):
        zero = np.zeros(3)
        zero[axis] = 1.001 * end
        assert len(search(TrigonometricForm(np.eye(3), -zero, no_waves))) == 0
        zero[axis] = 0.999 * end
        assert len(search(TrigonometricForm(np.eye(3), -zero, no_waves))) == 1


def test_double_zero_is_listed_once():
    found = search(reduced_energy(inverted_pendulum([100, 250, 70], 100.0)).form)
    assert found.shape == (1, 3)
    np.testing.assert_allclose(found, 0, atol=1e-5)


def test_double_zero_anywhere_is_listed_once():
    # For ∂U/∂θ1 = 1 - cos(θ1 - 1) a step of Newton's method only halves the distance.
    waves = np.zeros((3, 3, 3))
    waves[2, 0, 0], waves[1, 0, 0] = -np.cos(1.0), np.sin(1.0)
    form = TrigonometricForm(np.diag([0.0, 1, 1]), np.array([1.0, 0, 0]), waves)
    found = search(form)
    assert found.shape == (1, 3)
    np.testing.assert_allclose(found, [[1, 0, 0]], rtol=0, atol=5e-8)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("stiffness", [1e-3, 1.0, 400.0])
def test_threefold_zero_anywhere_is_listed_once(stiffness, seed):
    # For ∂U/∂θ1 = θ1 - 1 - sin(θ1 - 1) two thirds of the distance remain after each step.
    waves = np.zeros((3, 3, 3))
    waves[1, 0, 0], waves[2, 0, 0] = np.cos(1.0), np.sin(1.0)
    linear = np.array([-1.0, 0, 0])
    form = TrigonometricForm(stiffness * np.eye(3), stiffness * linear, stiffness * waves)
    found = search(form, seed)
    assert found.shape == (1, 3)
    np.testing.assert_allclose(found, [[1, 0, 0]], rtol=0, atol=2e-4)


def test_zeros_close_to_each_other_are_told_apart():
    found = search(reduced_energy(inverted_pendulum([100 * (1 - 1e-7), 250, 70], 100.0)).form)
    # kθ = a sin θ has θ² = 6e-7 at its small roots.
    np.testing.assert_allclose(np.sort(found[:, 0]), [-7.746e-4, 0, 7.746e-4], rtol=0, atol=1e-6)


def test_nothing_found_is_an_empty_list():
    straight = TrigonometricForm(np.zeros((3, 3)), np.ones(3), np.zeros((1, 1, 1)))
    assert search(straight).shape == (0, 3)


def test_search_is_quick():
    form = form_of("permanent", 0.01)
    search(form)
    started = time.perf_counter()
    search(form)
    assert time.perf_counter() - started < 1.0
