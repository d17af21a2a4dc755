"""Protects the formulas of the elements that switch: ligament, stiff and repelling guard.

In each mode the force and the couple are those of the stored energy, by finite differences. The
tension is that of the literature, in a formula of its own. At a switch the energy is continuous.
"""

from dataclasses import replace

import numpy as np
import pytest
from support.switching import random_guard, random_ligament
from support.systems import random_body, random_Z

from rbstab.elements.element import NO_STATE
from rbstab.elements.guards.soft_guards import RepellingGuard, StiffGuard
from rbstab.mechanics.attitude import rotation
from rbstab.mechanics.motion import motion_from_centre


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
    forces = np.array([one.wrench(motion, NO_STATE).force for one in (low, high)])
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-11)
    assert abs(element.guards(motion, NO_STATE)[mode]) < 1e-14
    # And not at another strain: the modes are different.
    longer = [replace(one, anchor=one.anchor - 0.3 * out) for one in (low, high)]
    assert abs(np.subtract(*(one.stored(motion, NO_STATE) for one in longer))) > 1e-3


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
