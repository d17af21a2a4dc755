"""The list of rest states: all of them, in order, with index, proof and uniqueness."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from support.proofs import rest_state_of, rest_states, slopes_of
from support.rest import (
    SADDLES,
    inverted_pendulum,
    paper_system,
    random_rest_system,
)
from support.systems import VARIANTS

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.config.user_code.permission import without_code
from rbstab.proof.rest_points import SearchOutcome
from rbstab.proof.rest_states import Body

LATCH = Path(__file__).parents[2] / "configs/examples/latch.yaml"


@pytest.mark.parametrize("proof", [True, False])
def test_saddles_of_the_paper_body(proof):
    rest = rest_states(paper_system("permanent", 0.1), proof=proof)
    np.testing.assert_allclose(
        [point.orientation for point in rest.states], [np.zeros(3), *SADDLES], rtol=0, atol=5.1e-4
    )
    assert [point.stable for point in rest.states] == [True, False, False]
    assert all(point.index in {1, 2} for point in rest.states[1:])
    assert [point.proved for point in rest.states] == [proof] * 3
    assert rest.unique is (False if proof else None)
    assert rest.outcome is (SearchOutcome.PROVED if proof else SearchOutcome.SEARCHED)


@pytest.mark.parametrize("variant", VARIANTS)
def test_no_rest_state_moves(rng, variant):
    system = random_rest_system(rng, variant)
    rest = rest_states(system)
    assert rest.states
    for point in rest.states:
        Theta, state = np.array(point.orientation), rest_state_of(rest, point)
        start = system.start(state.motion, state.element_states)
        np.testing.assert_allclose(system.rates(start), 0, atol=1e-8)
        assert system.potential_energy(start) == pytest.approx(point.energy, rel=1e-12)
        assert state.rests_in_range
        assert state.gradient < 1e-9
        assert np.all(point.enclosure[0] <= Theta)
        assert np.all(Theta <= point.enclosure[1])
        # The index is the number of negative eigenvalues, by differences of the gradient.
        h = 1e-4 * np.eye(3)
        H = [slopes_of(rest, Theta + x) - slopes_of(rest, Theta - x) for x in h]
        assert point.index == np.sum(np.linalg.eigvalsh(np.array(H)) < 0)
    nearest = nearest_rest_state(system)
    if nearest.rests_in_range and np.all(np.abs(nearest.motion.Theta[[0, 2]]) < np.pi):
        apart = [np.abs(point.orientation - nearest.motion.Theta).max() for point in rest.states]
        assert min(apart) < 1e-9


def test_order_is_that_of_the_energy_and_not_of_the_index():
    rest = rest_states(random_rest_system(np.random.default_rng(21), "visco-elastic"))
    energies = [point.energy for point in rest.states]
    indices = [point.index for point in rest.states]
    assert energies == sorted(energies)
    assert indices != sorted(indices)


def test_index_of_the_pendulum():
    # Upright it falls along θ1 only, since a < k2; leaning it is stable.
    rest = rest_states(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    assert [point.index for point in rest.states] == [0, 0, 1]
    np.testing.assert_allclose(rest.states[2].orientation, 0, atol=1e-12)
    # It leans where θ = 2 sin θ.
    leaning = np.abs(rest.states[0].orientation[0])
    assert leaning == pytest.approx(2 * np.sin(leaning), rel=1e-14)
    assert rest.states[0].energy == pytest.approx(
        25 * leaning**2 - 100 * (1 - np.cos(leaning)), rel=1e-12
    )


def test_uniqueness_is_proved_or_disproved():
    """Two proved states disprove it, whatever is undecided."""
    unique = rest_states(paper_system("permanent"))
    assert unique.unique is True
    assert replace(unique, states=()).unique is False
    rest = rest_states(paper_system("permanent", 0.01), box_limit=500)
    assert rest.outcome is SearchOutcome.BOX_LIMIT
    assert rest.unique is False


def test_undecided_decides_nothing():
    rest = rest_states(inverted_pendulum([100.0, 250.0, 70.0], 100.0))
    assert rest.outcome is SearchOutcome.UNDECIDED
    assert rest.unique is None
    assert rest.zeros.undecided.count > 0
    # The state is listed, but as not proved.
    (point,) = rest.states
    assert not point.proved
    np.testing.assert_allclose(point.orientation, 0, atol=1e-5)


def test_a_search_knows_a_ridge_and_proves_nothing():
    """Of the latch: two minima, and the ridge between them."""
    config = load_config(LATCH, allow_python=True)
    rest = Body(problem_of(config).system, partial(system_of, without_code(config))).searched()
    kinds = [(state.index, state.held, state.ridge, state.proved) for state in rest.states]
    assert kinds == [(0, None, None, False), (0, None, None, False), (1, True, True, False)]
    assert rest.zeros.zeros[0].index is None
