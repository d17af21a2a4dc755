"""The elements that a config can name: energies, forces and switches against independent facts.

Virtual motions are rotations by SciPy. The energies are written anew here, in closed form, from the
pose of the body, and the tension of a ligament in the formula of the literature. That each force is
that of its energy is in `test_passivity.py`.
"""

from dataclasses import replace

import numpy as np
import pytest
from support.differences import derivative, jacobian, relative_error
from support.elements import SMOOTH, random_element, random_spd
from support.pose import angles, attitude, turned
from support.switching import random_guard, random_ligament
from support.systems import random_body, random_Z

from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.element import NO_STATE
from rbstab.elements.embedded import EmbeddedConnector, EmbeddedTie
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.guards.soft_guards import RepellingGuard, StiffGuard
from rbstab.elements.spring import Spring, ZeroLengthSpring
from rbstab.elements.visco_elastic import ViscoElasticConnector, ViscoElasticTie
from rbstab.mechanics.attitude import rotation
from rbstab.mechanics.motion import motion_from_centre

NO_MOTION = np.zeros(3)


def spring_energy(spring, X, A):
    e = X + A @ spring.point - spring.anchor
    return spring.stiffness / 2 * (np.sqrt(np.sum(e**2)) - spring.rest_length) ** 2


def tie_energy(tie, X, A):
    e = X + A @ tie.point - tie.anchor
    return np.einsum("i,ij,j", e, tie.K_c, e) / 2


def attitude_energy(element, _, A):
    return np.sum(element.K * (np.eye(3) - A)) / 2


def barrier_energy(barrier, _, A):
    roll, pitch, yaw = angles(A)
    outer = np.tan(roll / 2) ** 2 + np.tan(yaw / 2) ** 2
    return barrier.stiffness / 2 * np.tan(pitch) ** 2 + barrier.outer_stiffness / 2 * outer


ENERGIES = {
    Spring: spring_energy,
    ViscoElasticTie: tie_energy,
    EmbeddedTie: tie_energy,
    AttitudeSpring: attitude_energy,
    Barrier: barrier_energy,
}
"""The energy of each kind from X and A, in plain numpy; its own states are zero."""

assert set(ENERGIES) == set(SMOOTH)


@pytest.fixture(params=ENERGIES, ids=lambda kind: kind.__name__)
def element(request, rng):
    return random_element(rng, request.param)


def still(rng):
    """Return a body at rest at a random pose, whose θ1 and θ3 are far from ±π."""
    Z = random_Z(rng) * np.array([0.6, 1, 0.6, *np.zeros(3), *np.ones(3), *np.zeros(3)])
    return Z, motion_from_centre(random_body(rng), rng.normal(size=3), Z)


def test_stored_energy_is_that_of_the_pose(element, rng):
    for _ in range(20):
        Z, motion = still(rng)
        expected = ENERGIES[type(element)](element, Z[6:9], attitude(Z[:3]))
        assert element.stored(motion, np.zeros(element.state_size)) == pytest.approx(
            expected, rel=1e-12
        )


def loss(element, Z):
    """Return the dissipated power from the rates of the element's own displacement."""
    Omega, V, A = Z[3:6], Z[9:12], attitude(Z[:3])
    if isinstance(element, AttitudeSpring):
        return Omega @ element.L @ Omega
    if isinstance(element, Barrier):
        return 0.0

    def place(t):
        return Z[6:9] + t * V + turned(A, Omega, t) @ element.point - element.anchor

    if isinstance(element, Spring):
        return element.damping * derivative(lambda t: np.linalg.norm(place(t)), 1e-3) ** 2
    speed = derivative(place, 1e-3)
    return speed @ element.L_c @ speed


@pytest.mark.parametrize("kind", [Spring, ViscoElasticTie, AttitudeSpring, Barrier])
def test_damping_is_the_slope_of_half_the_loss(kind, rng):
    """In the three velocities, inertial, and in the three spins, body coordinates."""
    element, body, Z = random_element(rng, kind), random_body(rng), random_Z(rng)
    spins_and_speeds = [9, 10, 11, 3, 4, 5]

    def moving(velocities):
        moved = Z.copy()
        moved[spins_and_speeds] = velocities
        return moved

    def wrench(velocities):
        loads = element.wrench(motion_from_centre(body, NO_MOTION, moving(velocities)), NO_STATE)
        return np.concatenate([loads.force, loads.couple])

    velocities = Z[spins_and_speeds]
    dissipated = element.dissipated(motion_from_centre(body, NO_MOTION, Z), NO_STATE)
    assert dissipated == pytest.approx(loss(element, Z), rel=1e-9)
    slope = jacobian(lambda v: 0.5 * loss(element, moving(v)), velocities)
    damping = wrench(velocities) - wrench(0 * velocities)
    np.testing.assert_allclose(damping, -slope, rtol=0, atol=1e-8 * (1 + np.abs(slope).max()))


@pytest.mark.parametrize(
    ("connector_class", "tie_class"),
    [(ViscoElasticConnector, ViscoElasticTie), (EmbeddedConnector, EmbeddedTie)],
    ids=["visco-elastic", "embedded"],
)
def test_tie_at_the_contact_point_is_the_connector(connector_class, tie_class, rng):
    """With p = R and the anchor R + X_a, where E = 0."""
    for _ in range(10):
        body, anchor, Z = random_body(rng), rng.normal(size=3), random_Z(rng)
        motion = motion_from_centre(body, anchor, Z)
        gains = {gain.name: random_spd(rng, 1000.0) for gain in connector_class.gains}
        connector = connector_class(**gains)
        states = rng.normal(size=connector.state_size)
        ends = {"point": body.contact_point, "anchor": body.contact_point + anchor}
        tie = tie_class(name="a", **ends, **gains)
        # X + AR - (R + X_a) loses digits where E is small.
        for of in ("stored", "dissipated"):
            of_tie, expected = (getattr(holder, of)(motion, states) for holder in (tie, connector))
            assert of_tie == pytest.approx(expected, rel=1e-13)
        if len(states):
            assert (
                relative_error(tie.rates(motion, states), connector.rates(motion, states)) < 1e-12
            )
        force = tie.wrench(motion, states)
        at_contact = connector.wrench(motion, states).contact_force
        assert relative_error(force.force, at_contact) < 1e-13
        moment = np.cross(body.contact_point, attitude(Z[:3]).T @ at_contact)
        assert relative_error(force.couple, moment) < 1e-13


def test_a_spring_without_a_length_is_one_whose_rest_length_is_zero(rng):
    given = random_element(rng, Spring)
    bare = replace(given, rest_length=0.0, damping=0.0)
    smooth = ZeroLengthSpring(
        name=given.name, point=given.point, anchor=given.anchor, stiffness=given.stiffness
    )
    Z, motion = still(rng)
    expected = spring_energy(bare, Z[6:9], attitude(Z[:3]))
    assert smooth.stored(motion, NO_STATE) == pytest.approx(expected, rel=1e-13)
    for computed, wanted in zip(
        smooth.wrench(motion, NO_STATE), bare.wrench(motion, NO_STATE), strict=True
    ):
        assert relative_error(computed, wanted, 1.0) < 1e-12
    short = np.concatenate([NO_MOTION, NO_MOTION, given.anchor - given.point, NO_MOTION])
    at_anchor = motion_from_centre(random_body(rng), NO_MOTION, short)
    assert smooth.stored(at_anchor, NO_STATE) == pytest.approx(0, abs=1e-25)


def stretched(rng, strain, mode):
    """Return a ligament with a strain, its motion, and its unit vector from the anchor."""
    element, body = random_ligament(rng, mode), random_body(rng)
    Z = random_Z(rng)
    place = Z[6:9] + rotation(Z[:3]) @ element.point
    out = rng.normal(size=3)
    out /= np.linalg.norm(out)
    element = replace(element, anchor=place - element.slack_length * (1 + strain) * out)
    return element, motion_from_centre(body, np.zeros(3), Z), out


@pytest.mark.parametrize("share", [-0.5, 0.3, 1.0, 1.999, 2.001, 5.0])
def test_tension_is_that_of_the_literature(rng, share):
    """0, k ε²/(4 ε_t) and k(ε - ε_t), with the damper on the taut line, as a branch."""
    for _ in range(5):
        element, motion, out = stretched(rng, 0.0, (0.0, 0.0))
        strain = share * element.toe_strain
        moved = element.anchor - element.slack_length * strain * out
        g = replace(element, anchor=moved).guards(motion, NO_STATE)
        element = replace(element, anchor=moved, mode=(g > 0).astype(float))
        k, end, c = element.stiffness, element.toe_strain, element.damping
        speed = motion.V + motion.A @ np.cross(motion.Omega, element.point)
        if strain <= 0:
            expected = 0.0
        elif strain <= 2 * end:
            expected = k * strain**2 / (4 * end) + c * out @ speed
        else:
            expected = k * (strain - end) + c * out @ speed
        wrench = element.wrench(motion, NO_STATE)
        np.testing.assert_allclose(wrench.force, -expected * out, atol=1e-11)
        lever = np.cross(element.point, motion.A.T @ wrench.force)
        np.testing.assert_allclose(wrench.couple, lever, atol=1e-11)
        assert wrench.contact_force.tolist() == [0, 0, 0]


@pytest.mark.parametrize(("strain_in_toes", "mode"), [(0.0, 0), (2.0, 1)])
def test_energy_and_elastic_tension_of_a_ligament_meet_at_a_switch(rng, strain_in_toes, mode):
    element, motion, out = stretched(rng, 0.0, (0.0, 0.0))
    element = replace(element, damping=0.0)
    strain = strain_in_toes * element.toe_strain
    element = replace(element, anchor=element.anchor - element.slack_length * strain * out)
    before, after = np.array([float(mode), 0.0]), np.array([1.0, float(mode)])
    low, high = replace(element, mode=before), replace(element, mode=after)
    assert abs(low.stored(motion, NO_STATE) - high.stored(motion, NO_STATE)) < 1e-12
    forces = np.array([ligament.wrench(motion, NO_STATE).force for ligament in (low, high)])
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-11)
    assert abs(element.guards(motion, NO_STATE)[mode]) < 1e-14
    # And not at another strain: the modes are different.
    longer = [replace(ligament, anchor=ligament.anchor - 0.3 * out) for ligament in (low, high)]
    assert abs(np.subtract(*(ligament.stored(motion, NO_STATE) for ligament in longer))) > 1e-3


@pytest.mark.parametrize("kind", [StiffGuard, RepellingGuard])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_couple_of_a_guard_turns_theta2_back(rng, kind, side):
    """The generalized force on θ2 is that of ½ k (|θ2| - θ_s)² or K (|θ2| - θ_s) alone."""
    element = random_guard(rng, kind, (0.0, 0.0))
    beyond = float(rng.uniform(0.01, 0.2))
    Z = random_Z(rng)
    Z[1] = side * (element.soft_angle + beyond)
    motion = motion_from_centre(random_body(rng), np.zeros(3), Z)
    g = element.guards(motion, NO_STATE)
    np.testing.assert_allclose(np.sort(g), np.sort([beyond, -beyond - 2 * element.soft_angle]))
    element = replace(element, mode=(g > 0).astype(float))
    wrench = element.wrench(motion, NO_STATE)
    # The power of the couple is N'Ω = N'B⁻¹Θ̇: the generalized forces are B⁻ᵀN.
    generalized = np.linalg.inv(motion.B).T @ wrench.couple
    size = element.stiffness * beyond if kind is StiffGuard else element.couple
    np.testing.assert_allclose(generalized, [0, -side * size, 0], atol=1e-11)
    energy = 0.5 * size * beyond if kind is StiffGuard else size * beyond
    assert abs(element.stored(motion, NO_STATE) - energy) < 1e-12
    assert wrench.force.tolist() == wrench.contact_force.tolist() == [0, 0, 0]
