"""Rest states that the Euler angles show twice, or where there are none, and families of them.

An attitude spring K without a weight: U at a half turn about an axis is the sum of the two other
entries of K. Where two entries are equal, half turns about all axes between are at rest.
"""

import numpy as np
import pytest
from support.leg import BODY

import rbstab
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import statements_of

TIE = {"kind": "visco-elastic", "point": [0, 0, 0], "anchor": [0, 0, 0]}


def turned_by(K):
    elements = {
        "tie": TIE | {"K_c": [100, 100, 100], "L_c": [5, 5, 5]},
        "upright": {"kind": "attitude", "K": K, "L": [0.1, 0.1, 0.1]},
    }
    body = {"mass": 1, "inertia": [0.01, 0.01, 0.01], "contact_point": [0, 0, 0]}
    return {"schema_version": 2, "body": body, "elements": elements} | {
        "integration": {"duration": 1}
    }


@pytest.mark.parametrize(
    ("K", "energies", "indices", "families"),
    [
        ([1, 1.2, 1.5], [0, 2.2, 2.5, 2.7], [0, 1, 2, 3], []),
        ([1, 1, 1.5], [0, 2], [0, 1], [(2.5, 2, 1)]),
        ([1, 1, 1], [0], [0], [(2, 1, 2)]),
    ],
)
def test_each_half_turn_is_one_rest_state_and_a_family_is_none(K, energies, indices, families):
    proof = prove(turned_by(K))
    assert [state.index for state in proof.states] == indices
    assert [state.energy for state in proof.states] == pytest.approx(energies, abs=1e-9)
    found = [(one.energy, one.index, one.dimension) for one in proof.families]
    assert found == [pytest.approx(family) for family in families]
    # At θ2 = ±π/2 is no rest state, though ∂U/∂Θ is zero at (±π/2, ±π/2, ±π/2).
    assert max(abs(state.orientation[1]) for state in proof.states) < 1e-6
    assert ("a continuum (a family)" in proof.outcome) == bool(families)
    assert ("a family" in " ".join(statements_of(proof))) == bool(families)
    assert proof.proved == (not families)
    assert proof.examined == 0
    almost = proof.almost_every_start
    assert (almost.proved, almost.returns, almost.states) == (True, True, (1,))
    # Below the next energy every motion returns.
    assert proof.region is not None
    least = min([*energies[1:], *(energy for energy, _, _ in families)])
    assert proof.region.lower_bound == pytest.approx(least, abs=1e-9)
    assert proof.region.lower_bound < least + 1e-15


@pytest.mark.slow
def test_a_search_alone_counts_no_family_either():
    found = prove(turned_by([1, 1, 1]), search_only=True)
    assert [state.orientation for state in found.states] == [pytest.approx((0, 0, 0), abs=1e-9)]
    assert "a family" in found.outcome


@pytest.mark.heavy
def test_a_degenerate_rest_state_is_neither_stable_nor_unstable():
    """K_r + K_t l² = m g l about the first axis: there the leg is about to fall over."""
    m, g, h, K_t = 3.5, 9.81, 0.186, 1e-6
    config = {
        "schema_version": 2,
        "body": BODY,
        "gravity": [0, 0, -g],
        "controller": {
            "variant": "permanent",
            "K_t": [K_t] * 3,
            "L_t": [1e-6] * 3,
            "K_r": [6.386309965404, 7, 5],
            "L_r": [0.8, 0.8, 0.3],
        },
        "integration": {"duration": 1},
    }
    assert m * g * h - K_t * h**2 == pytest.approx(6.386309965404, abs=1e-12)
    proof = prove(rbstab.load_config(config))
    (upright,) = proof.states
    assert np.abs(upright.orientation).max() < 1e-4
    assert (upright.stable, proof.stable_count, proof.proved) == (None, 0, False)
    assert "1 rest state found: 1 not known to be stable" in statements_of(proof)[0]
    assert not proof.almost_every_start.proved
