"""Protects W(Θ, z), the energy of a tied body with springs, against energies written by hand."""

from functools import partial

import numpy as np
import pytest
from support.config_elements import CONTROLLER, config_data
from support.tied_springs import K_C, K_D, energy_of, spring_of, tied_system

from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy, reduced_energy
from rbstab.analysis.proof.tied.energy import tied_energy, tied_energy_of_doubles
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.elements.guards.stop import Stop
from rbstab.elements.spring import ZeroLengthSpring
from rbstab.elements.visco_elastic import ViscoElasticTie

OTHER = spring_of((-0.2, 0.1, 0.0), (-0.6, 0.2, -0.1), 500.0, 0.7)


def value_of(W, Theta, z):
    """Return W by its definition."""
    r = [np.array([form.value(Theta[None])[0] for form in line.offset]) for line in W.lines]
    lengths = sum(
        line.weight * np.linalg.norm(z + one) for line, one in zip(W.lines, r, strict=True)
    )
    return W.form.value(Theta[None])[0] + 0.5 * z @ W.stiffness @ z + lengths


@pytest.mark.parametrize("K_d", [None, K_D], ids=["visco-elastic", "embedded"])
@pytest.mark.parametrize("springs", [[spring_of()], [spring_of(), OTHER]], ids=["one", "two"])
def test_the_energy_is_that_of_the_formulas(springs, K_d):
    rng = np.random.default_rng(0)
    W = tied_energy_of_doubles(tied_system(springs, K_d=K_d))
    assert len(W.lines) == len(springs)
    for _ in range(10):
        Theta, z = rng.uniform(-1.5, 1.5, 3), 0.3 * rng.normal(size=3)
        q = W.configuration(Theta, z)
        expected = energy_of(springs, Theta, q[3:6], K_d=K_d)
        assert value_of(W, Theta, z) == pytest.approx(expected, rel=1e-12, abs=1e-9)
        # D has the least energy.
        assert W.configurations.energy(q) == pytest.approx(expected, rel=1e-12, abs=1e-9)


def test_the_compliance_is_the_inverse_of_the_stiffness():
    W = tied_energy_of_doubles(tied_system([spring_of()], K_d=K_D))
    np.testing.assert_allclose(W.compliance @ W.stiffness, np.eye(3), atol=1e-13)


def test_a_spring_without_a_rest_length_is_a_tie():
    """½ k ℓ² is the energy of a tie with K_c = k I: all coefficients of U are the same."""
    damped = spring_of(rest_length=0.0)
    spring = ZeroLengthSpring(
        name="spring", point=damped.point, anchor=damped.anchor, stiffness=damped.stiffness
    )
    tie = ViscoElasticTie(
        name="tie",
        point=spring.point,
        anchor=spring.anchor,
        K_c=spring.stiffness * np.eye(3),
        L_c=np.eye(3),
    )
    form, other = (
        reduced_energy(tied_system([], 1.0, K_C, None, one)).form for one in (spring, tie)
    )
    np.testing.assert_array_equal(form.coefficients, other.coefficients)
    np.testing.assert_array_equal(form.quadratic, other.quadratic)
    assert not form.lines
    # Where the damped one has no length, its force has no direction. The energy does not show it.
    with pytest.raises(NoReducedEnergy, match="no length"):
        reduced_energy(tied_system([damped]))
    with pytest.raises(NoReducedEnergy, match="no length"):
        tied_energy_of_doubles(tied_system([damped]))


def test_numbers_of_a_config_are_decimals():
    """0.1 + 0.2 is 0.3: with decimals, two springs have the weight of one, to the last bit."""
    ends = {"kind": "spring", "point": [0.1, 0.2, 0.3], "anchor": [0.5, 0.1, 0.9]}
    weights = []
    for stiffnesses in ([0.1, 0.2], [0.3]):
        springs = {
            f"s{k}": ends | {"stiffness": x, "rest_length": 1.0} for k, x in enumerate(stiffnesses)
        }
        config = load_config(config_data(springs, CONTROLLER))
        W = tied_energy(problem_of(config).system, partial(system_of, config))
        weights.append([line.weight for line in W.lines])
    assert weights == [[-0.3], [-0.3]]


def test_what_has_no_such_energy_is_refused():
    stop = Stop(name="range", angle=np.array(1.2), restitution=np.array(0.5))
    with pytest.raises(NoReducedEnergy) as caught:
        tied_energy_of_doubles(tied_system([spring_of()], 1.0, K_D, None, stop))
    assert caught.value.reason is NoEnergyReason.STOP_IN_SIX
    # A negative rest length would pull at any length: the energy has a lowest point at its kink.
    with pytest.raises(NoReducedEnergy):
        tied_energy_of_doubles(tied_system([spring_of(rest_length=-0.5)]))
