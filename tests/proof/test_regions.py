"""The region of each minimum ends at its pass, and every motion in it converges to the minimum."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from support.hang_guard import within
from support.proofs import body_of, regions_of, rest_states
from support.rest import inverted_pendulum

from rbstab.proof.boxes import Box
from rbstab.proof.regions.regions import regions_of as regions_in


def valley(stiffness, moment):
    """Return the energy of the pendulum at its leaning rest states: k θ = a sin θ."""
    theta = brentq(lambda x: stiffness * x - moment * np.sin(x), 0.1, np.pi, xtol=1e-14)
    return 0.5 * stiffness * theta**2 - moment * (1 - np.cos(theta))


def test_two_valleys_end_at_the_half_turn_if_it_is_lower_than_the_top():
    regions = regions_of(rest_states(inverted_pendulum([30.0, 1e3, 1e3], 100.0))).minima
    half_turn = 0.5 * 30.0 * np.pi**2 - 200
    assert half_turn < 0
    depth = half_turn - valley(30.0, 100.0)
    for region in regions:
        assert region.level == pytest.approx(depth, rel=1e-6)
        assert region.energy_bound == pytest.approx(half_turn, abs=2e-6 * depth)
    # Each valley ends at its own half turn, which does not lead to the other valley.
    assert {region.pass_face for region in regions} == {"θ1 = -π", "θ1 = π"}


def test_a_valley_so_shallow_that_round_off_hides_its_pass_ends_the_search():
    """With springs of 1e-6 N m/rad, the valleys of the hanging top differ by 1e-14 J."""
    rest = rest_states(inverted_pendulum([1e-6, 1e-6, 1e-6], 0.2943))
    regions = within(120, regions_of, rest)
    # A lean by π stores ½ 1e-6 π² J, and hangs 2 · 0.2943 J lower than upright.
    lowest = 0.5e-6 * np.pi**2 - 2 * 0.2943
    assert rest.states[0].energy == pytest.approx(lowest, abs=1e-9)
    for region in regions.minima:
        assert 0 < region.lower_bound <= region.level < 1e-5


def test_a_state_whose_index_is_not_proved_has_no_region():
    """Nor has any state of a search without a proof."""
    system = inverted_pendulum([50.0, 150.0, 70.0], 100.0)
    rest, body = rest_states(system), body_of(system)
    first, second, top = rest.zeros.zeros
    doubtful = replace(rest.zeros, zeros=(first, replace(second, index=None), top))
    regions = regions_in(body.energy, doubtful, Box(-rest.end, rest.end), body.bounded)
    assert {region.rest_state for region in regions.minima} == {1}
    alone = regions_of(rest_states(system, proof=False))
    assert alone.minima == ()
    assert alone.certified is None or alone.certified.energy_bound is None
