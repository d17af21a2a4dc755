"""Proofs hold at any size of the energies, or are refused with the reason."""

from functools import cache

import pytest

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.starts import start_state

LEVEL = 0.750629
"""J: the least energy on the border, at θ3 = ±π, of `body(1.0)`: U is 0 at rest."""


def body(size, **initial):
    """Return a body whose energies are all `size` times those of the same body of size 1."""
    return load_config(
        {
            "body": {"mass": size, "inertia": [size] * 3, "contact_point": [0.1, 0.2, -1]},
            "controller": {
                "variant": "permanent",
                "K_t": [size] * 3,
                "L_t": [size] * 3,
                "K_r": [0.1 * size, 0.2 * size, 0.15 * size],
                "L_r": [size] * 3,
            },
            "initial": initial,
            "integration": {"duration": 1},
        }
    )


@cache
def proof_of(size):
    return prove(body(size))


@pytest.mark.heavy
@pytest.mark.parametrize("power", [-80, -40, 0, 40, 85])
def test_claims_are_those_of_a_body_of_any_size(power):
    size = 10.0**power
    proof = proof_of(size)
    assert proof.proved
    assert [state.index for state in proof.states] == [0, 1]
    orientations = [state.orientation for state in proof.states]
    assert orientations[0] == pytest.approx([0, 0, 0], abs=1e-9)
    assert orientations[1] == pytest.approx([2.06, 1.558, 1.458], abs=1e-3)
    # The level is a lower bound, so it is never above the true one.
    assert LEVEL - 1e-5 < proof.region.lower_bound / size < LEVEL + 1e-6
    assert len(proof.unwrapped.states) == 10


@pytest.mark.parametrize("power", [-300, -162, -120, -91, 91, 120, 200])
def test_other_sizes_are_refused_with_the_reason(power):
    proof = prove(body(10.0**power))
    assert not proof.proved
    assert not proof.states
    assert proof.region is None
    assert "too small or too large: proofs take 1e-90 to 1e+90" in proof.outcome
    assert "body.mass" in proof.outcome


@pytest.mark.heavy
@pytest.mark.parametrize(("rate", "inside"), [(0.1, True), (1.5, False), (1e200, False)])
def test_a_start_whose_energy_overflows_is_not_inside(rate, inside):
    problem = problem_of(body(1.0, angular_velocity=[rate, 0, 0]))
    assert (start_state(problem, proof_of(1.0)) == 1) == inside
    statements = " ".join(stability_of(problem, proof_of(1.0)).statements)
    assert (", inside;" in statements) == inside
    assert (", not inside;" in statements) != inside
