"""The energy balance of each element and of the body is an identity, proved by exact algebra.

Lemma 1 of docs/proofs.md: v' = -Σ dissipation. All gains and states are independent variables.
"""

import numpy as np
import pytest
from support.rational_functions import Angle, RationalFunction, dot, is_zero_for, variables

from rbstab.elements.gravity import Gravity
from rbstab.elements.registry import ELEMENTS
from rbstab.elements.sliding import SlidingConnector
from rbstab.mechanics.algebra import cross_matrix
from rbstab.mechanics.attitude import rate_matrix, rotation
from rbstab.mechanics.body import Body
from rbstab.mechanics.contact import velocity
from rbstab.mechanics.motion import Motion, Wrench, free_rates
from rbstab.systems.coordinates import ReducedCoordinates

SMOOTH = [element for element in ELEMENTS if element is not SlidingConnector]
"""The elements of proofs: a sliding connector is refused there."""


def motion_of(symbols):
    """Return a motion in which A, B, E and F are independent of the rest."""
    Theta, Omega, X, V, E, F = (symbols.vector() for _ in range(6))
    return Motion(Theta, Omega, X, V, symbols.matrix(), symbols.matrix(), E, F)


def element_of(kind, symbols):
    """Return an element whose gains are variables."""
    if kind is Gravity:
        return Gravity(symbols.vector())
    made = {
        "matrix": symbols.symmetric,
        "diagonal": symbols.vector,
        "number": lambda: symbols.vector(1)[0],
    }
    return kind(**{gain.name: made[gain.shape]() for gain in kind.gains})


def power(wrench, motion):
    """Return the power of a wrench on the body, with the contact force at C."""
    at_centre = dot(wrench.force, motion.V) + dot(wrench.couple, motion.Omega)
    return at_centre + dot(wrench.contact_force, motion.F)


def balance(element, motion, states):
    """Return the rate of the stored energy, plus the dissipation, plus the power on the body."""
    stored = element.stored(motion, states)
    # Θ̇ = BΩ, Ẋ = V and Ė = F.
    pairs = [
        (motion.Theta, motion.B @ motion.Omega),
        (motion.X, motion.V),
        (motion.E, motion.F),
        (states, element.rates(motion, states)),
    ]
    rate = sum(
        stored.derivative(variable) * speed
        for vector, speeds in pairs
        for variable, speed in zip(vector, speeds, strict=True)
    )
    return rate + element.dissipated(motion, states) + power(element.wrench(motion, states), motion)


@pytest.mark.parametrize("kind", SMOOTH, ids=lambda kind: kind.__name__)
def test_element_stores_what_it_takes_and_does_not_dissipate(kind):
    symbols = variables(70)
    motion, element = motion_of(symbols), element_of(kind, symbols)
    states = symbols.vector(kind.state_size)
    residual = balance(element, motion, states)
    assert isinstance(residual, RationalFunction)
    assert residual.is_zero


def test_kinetic_energy_grows_by_the_power_of_all_forces():
    """Ṫ = (G + H)'V + N'Ω + Λ'F along eq. 9, with F = V - AŘΩ; A need not be a rotation."""
    symbols = variables(60)
    Theta, Omega, X, V, E = (symbols.vector() for _ in range(5))
    A, B = symbols.matrix(), symbols.matrix()
    (mass,) = symbols.vector(1)
    body = Body(mass, symbols.symmetric(), symbols.vector())
    F = V - A @ (cross_matrix(body.contact_point) @ Omega)
    motion = Motion(Theta, Omega, X, V, A, B, E, F)
    wrench = Wrench(symbols.vector(), symbols.vector(), symbols.vector())
    rates = free_rates(body, motion, wrench)
    kinetic = body.kinetic_energy(Omega, V)
    speeds = np.concatenate([rates[3:6], rates[9:12]])
    moving = np.concatenate([Omega, V])
    growth = sum(kinetic.derivative(x) * rate for x, rate in zip(moving, speeds, strict=True))
    assert (growth - power(wrench, motion)).is_zero
    # And Θ̇ = BΩ, Ẋ = V, as the elements' balance takes for granted.
    kinematics = np.concatenate([rates[0:3] - B @ Omega, rates[6:9] - V])
    assert all(entry.is_zero for entry in kinematics)


def rotating(symbols):
    """Return three angles as an array, with A and B."""
    angles = [Angle(symbols) for _ in range(3)]
    Theta = np.array(angles, dtype=object)
    return Theta, rotation(Theta), rate_matrix(Theta)


def test_contact_point_moves_with_its_velocity():
    """Ȧ = AΩ̌ with Θ̇ = BΩ, so that Ė = V + ȦR = V - AŘΩ = F (eq. 4)."""
    symbols = variables(20)
    Theta, A, B = rotating(symbols)
    Omega, R = symbols.vector(), symbols.vector()
    speeds = B @ Omega
    rate = sum(
        np.array([[angle.derivative(A[i, j] + 0 * R[0]) for j in range(3)] for i in range(3)])
        * speed
        for angle, speed in zip(Theta, speeds, strict=True)
    )
    for entry in (rate - A @ cross_matrix(Omega)).ravel():
        assert is_zero_for(Theta, entry)
    body = Body(1.0, np.eye(3), R)
    zero = np.zeros(3)
    F = velocity(body, A, Omega, zero)
    for entry in rate @ R - F:
        assert is_zero_for(Theta, entry)
    # The check is not empty: with -Ω it fails.
    assert not all(is_zero_for(Theta, entry) for entry in rate @ R + F)


def test_held_body_gains_the_power_of_the_applied_forces():
    """With F = 0 the force of constraint has no power (eq. 11 to 21)."""
    symbols = variables(40)
    Theta, A, B = rotating(symbols)
    (mass,) = symbols.vector(1)
    Omega, zero = symbols.vector(), np.zeros(3)
    body = Body(mass, symbols.symmetric(), symbols.vector())
    V = A @ (body.contact_cross @ Omega)
    motion = Motion(Theta, Omega, zero, V, A, B, zero, zero)
    wrench = Wrench(symbols.vector(), symbols.vector(), zero)
    rates, _ = ReducedCoordinates().dynamics(body, motion, wrench)
    about_contact = 0.5 * dot(Omega, body.inertia_about_contact @ Omega)
    assert is_zero_for(Theta, body.kinetic_energy(Omega, V) - about_contact)
    growth = dot([about_contact.derivative(x) for x in Omega], rates[3:6])
    power_of_all = dot(wrench.force, V) + dot(wrench.couple, Omega)
    assert is_zero_for(Theta, growth - power_of_all)
    assert not is_zero_for(Theta, growth + power_of_all)
