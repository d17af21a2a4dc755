"""The list of rest states: all of them, in order, with index, proof and uniqueness."""

import time
from dataclasses import replace

import numpy as np
import pytest
from support.proofs import rest_states, slopes_of
from support.rest import (
    HEAVY,
    SADDLES,
    coordinates_of,
    inverted_pendulum,
    paper_system,
    random_rest_system,
)
from support.systems import VARIANTS

from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.rest_state import nearest_rest_state


@pytest.mark.parametrize("proof", [True, False])
def test_saddles_of_the_paper_body(proof):
    found = rest_states(paper_system("permanent", 0.1), proof=proof)
    np.testing.assert_allclose(
        [point.Theta for point in found.states], [np.zeros(3), *SADDLES], rtol=0, atol=5.1e-4
    )
    assert [point.stable for point in found.states] == [True, False, False]
    assert all(point.index in {1, 2} for point in found.states[1:])
    assert [point.proved for point in found.states] == [proof] * 3


@pytest.mark.parametrize(
    ("variant", "Theta", "tolerance"),
    [
        ("permanent", [0.03917, -0.05825, 0.00018], [5e-6] * 3),
        ("visco-elastic", [0.0347, -0.0517, 0.00012], [5e-5, 5e-5, 5e-6]),
    ],
)
def test_paper_body_under_gravity(variant, Theta, tolerance):
    found = rest_states(paper_system(variant, weight=HEAVY))
    (point,) = found.states
    assert found.unique is True
    assert np.all(np.abs(point.Theta - Theta) <= tolerance)


@pytest.mark.parametrize("variant", VARIANTS)
def test_body_under_gravity_whose_anchor_is_where_it_hangs_rests_upright(variant):
    found = rest_states(paper_system(variant, weight=HEAVY, anchor=(0.0, 0.0, -0.125)))
    (point,) = found.states
    assert found.unique is True
    np.testing.assert_allclose(point.Theta, 0, atol=1e-14)
    np.testing.assert_allclose(point.state.motion.X, [0, 0, -0.125], rtol=0, atol=1e-14)
    np.testing.assert_allclose(point.state.own, 0, atol=1e-14)


@pytest.mark.parametrize("variant", VARIANTS)
def test_no_rest_state_moves(rng, variant):
    system = random_rest_system(rng, variant)
    found = rest_states(system)
    assert found.states
    for point in found.states:
        motion = point.state.motion
        start = system.start(motion, point.state.own)
        np.testing.assert_allclose(system.rates(start), 0, atol=1e-8)
        assert system.potential_energy(start) == pytest.approx(point.state.energy, rel=1e-12)
        assert point.state.found
        assert point.state.gradient < 1e-9
        assert np.all(point.enclosure.low[0] <= point.Theta)
        assert np.all(point.Theta <= point.enclosure.high[0])


@pytest.mark.parametrize("variant", VARIANTS)
def test_they_are_in_order_and_begin_with_a_minimum(rng, variant):
    found = rest_states(random_rest_system(rng, variant))
    energies = [point.state.energy for point in found.states]
    assert energies == sorted(energies)
    assert found.states[0].stable


def test_order_is_that_of_the_energy_and_not_of_the_index():
    found = rest_states(random_rest_system(np.random.default_rng(21), "visco-elastic"))
    energies = [point.state.energy for point in found.states]
    indices = [point.index for point in found.states]
    assert energies == sorted(energies)
    assert indices != sorted(indices)


def hessian_by_differences(system, Theta):
    """Return the Hessian of the reduced energy by differences of its gradient."""
    rest = rest_states(system, proof=False)
    h = 1e-4
    rows = []
    for shift in h * np.eye(3):
        ahead, behind = (slopes_of(rest, Theta + s * shift) for s in (1, -1))
        rows.append((ahead - behind) / (2 * h))
    return np.array(rows)


@pytest.mark.parametrize("variant", ["permanent", "embedded"])
def test_index_counts_the_ways_down(rng, variant):
    system = random_rest_system(rng, variant)
    for point in rest_states(system).states:
        eigenvalues = np.linalg.eigvalsh(hessian_by_differences(system, point.Theta))
        assert point.index == np.sum(eigenvalues < 0)


def test_index_of_the_pendulum():
    # Upright it falls along θ1 only, since a < k2; leaning it is stable.
    found = rest_states(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    assert [point.index for point in found.states] == [0, 0, 1]
    np.testing.assert_allclose(found.states[2].Theta, 0, atol=1e-12)
    # It leans where θ = 2 sin θ.
    leaning = np.abs(found.states[0].Theta[0])
    assert leaning == pytest.approx(2 * np.sin(leaning), rel=1e-14)
    assert found.states[0].state.energy == pytest.approx(
        25 * leaning**2 - 100 * (1 - np.cos(leaning)), rel=1e-12
    )


def test_nearest_rest_state_is_among_them(rng):
    for variant in VARIANTS:
        system = random_rest_system(rng, variant)
        nearest = nearest_rest_state(system)
        if nearest.found and np.all(np.abs(nearest.motion.Theta[[0, 2]]) < np.pi):
            apart = [
                np.abs(point.Theta - nearest.motion.Theta).max()
                for point in rest_states(system).states
            ]
            assert min(apart) < 1e-9


def test_uniqueness_is_proved_or_disproved():
    unique = rest_states(paper_system("permanent"))
    assert unique.unique is True
    assert unique.counterexample is None
    assert replace(unique, states=()).unique is False
    several = rest_states(paper_system("permanent", 0.3))
    assert several.unique is False
    assert several.counterexample is several.states[1]
    assert several.counterexample.proved


def test_search_alone_decides_nothing():
    alone = rest_states(paper_system("permanent"), proof=False)
    assert alone.outcome is SearchOutcome.SEARCHED
    assert not alone.proved
    assert alone.unique is None
    assert alone.examined == 0
    seen = rest_states(paper_system("permanent", 0.3), proof=False)
    assert seen.unique is None
    assert seen.counterexample is not None
    assert not seen.counterexample.proved


def test_undecided_decides_nothing():
    found = rest_states(inverted_pendulum([100.0, 250.0, 70.0], 100.0))
    assert found.outcome is SearchOutcome.UNDECIDED
    assert found.unique is None
    assert len(found.undecided) > 0
    # The state is listed, but as not proved.
    (point,) = found.states
    assert not point.proved
    np.testing.assert_allclose(point.Theta, 0, atol=1e-5)


def test_two_proved_states_disprove_uniqueness_whatever_is_undecided():
    found = rest_states(paper_system("permanent", 0.01), box_limit=500)
    assert found.outcome is SearchOutcome.BOX_LIMIT
    assert sum(point.proved for point in found.states) > 1
    assert found.unique is False


@pytest.mark.parametrize("K_r_scale", [1.0, 0.01])
@pytest.mark.parametrize("variant", VARIANTS)
def test_proof_takes_seconds_at_most(variant, K_r_scale):
    started = time.perf_counter()
    found = rest_states(paper_system(variant, K_r_scale))
    assert found.proved
    assert found.examined < 22_000
    assert time.perf_counter() - started < 30


def test_coordinates_of_the_helper_hold_the_permanent_body():
    assert coordinates_of("permanent").holds_contact
    assert not coordinates_of("free").holds_contact
