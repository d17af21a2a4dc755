"""The level that is shown for a start is that of a region of its rest state."""

import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.experiment.convergence.region_bounds import level_of, region_energies
from rbstab.experiment.proof import prove


@pytest.fixture(scope="module")
def proof():
    return prove(rbstab.load_config(paper_config("permanent")))


def test_the_first_region_above_the_energy_counts(proof):
    bounds = [bound for _, bound in region_energies(proof)]
    assert level_of(proof, 1, 0.0) == pytest.approx(bounds[0] - proof.states[0].energy)
    beyond = [bound for _, bound in region_energies(proof, in_range=False)]
    assert beyond == bounds[-len(beyond) :]
    assert level_of(proof, 1, 0.0, in_range=False) == pytest.approx(beyond[0])


def test_round_off_above_every_bound_is_no_error(proof):
    highest = max(bound for _, bound in region_energies(proof))
    energy = highest * (1 + 1e-15)
    assert level_of(proof, 1, energy) == pytest.approx(highest - proof.states[0].energy)
