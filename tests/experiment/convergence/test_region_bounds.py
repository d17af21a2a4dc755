"""The level that is shown for a start is that of a region of its rest state."""

from types import SimpleNamespace
from typing import Any

import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.experiment.convergence import decisions
from rbstab.experiment.convergence.decisions import level_of, region_energies
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


def test_of_several_regions_the_lowest_that_has_the_motion_counts(monkeypatch):
    upright, lying = (0.0, 0.0, 0.0), (0.0, 1.5, 0.0)
    bounds = [(upright, 5.0), (lying, 6.0), (upright, 8.0), (lying, 9.0)]
    monkeypatch.setattr(decisions, "region_energies", lambda *_, **__: bounds)
    states = [SimpleNamespace(orientation=upright, energy=1.0)]
    states.append(SimpleNamespace(orientation=lying, energy=2.0))
    proof: Any = SimpleNamespace(states=states)
    assert level_of(proof, 1, 4.0) == pytest.approx(5.0 - 1.0)
    assert level_of(proof, 1, 5.5) == pytest.approx(8.0 - 1.0)
    assert level_of(proof, 2, 5.5) == pytest.approx(6.0 - 2.0)
    # v is below its level: the largest double below the bound.
    assert level_of(proof, 1, 4.0) < 4.0


def test_round_off_above_every_bound_is_no_error(proof):
    highest = max(bound for _, bound in region_energies(proof))
    energy = highest * (1 + 1e-15)
    assert level_of(proof, 1, energy) == pytest.approx(highest - proof.states[0].energy)
