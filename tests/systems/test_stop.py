"""Protects the impact and the hold at a stop, in all coordinates of the body.

An impact is compared with another formulation: of all velocities that the rate of θ2 after it
allows, those after it are nearest to those before it, in the metric of the kinetic energy (Gauss).
It is solved with Lagrange's multipliers, and with directions from differences of rotations.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.differences import along, derivative
from support.systems import random_body, random_elements, random_Z

from rbstab.elements.element import couple_on_body
from rbstab.elements.guards.stop import Stop
from rbstab.mechanics import pitch
from rbstab.mechanics.motion import motion_from_centre, motion_from_contact
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.impact import (
    HOP_HEIGHT,
    impact,
    laid_on_stop,
    resting_side,
    rests,
)
from rbstab.systems.modes import guards_at, modes_of, with_first_modes, with_modes, with_modes_at
from rbstab.systems.system import System

COORDINATES = {
    "Z": CentreCoordinates(),
    "W": ContactCoordinates(),
    "reduced": ReducedCoordinates(),
    "manifold": ManifoldCoordinates(7.0),
}
EACH = pytest.mark.parametrize("name", COORDINATES)
ANGLE = 0.7


def stopped(rng, name, restitution=0.4, side=1.0, mode=(0.0, 0.0)):
    """Return a random system with a stop, and a state at which θ2 is at the stop."""
    end = Stop(name="end", angle=ANGLE, restitution=restitution, mode=np.array(mode))
    variant = "free" if COORDINATES[name].holds_contact else "visco-elastic"
    elements = (*random_elements(rng, variant), end)
    system = System(random_body(rng), elements, COORDINATES[name], rng.normal(size=3))
    Z = random_Z(rng)
    Z[1] = side * ANGLE
    if COORDINATES[name].holds_contact:
        motion = motion_from_contact(system.body, system.anchor, np.r_[Z[:6], np.zeros(6)])
    else:
        motion = motion_from_centre(system.body, system.anchor, Z)
    return system, system.start(motion, np.zeros(0))


def velocities(system, y):
    motion = system.motion(y)
    return np.concatenate([motion.Omega, motion.V])


def rate_row(motion):
    """Return ∂θ̇2/∂(Ω, V), from differences of rotations about the axes of the body."""
    A = Rotation.from_matrix(motion.A)

    def turned(axis):
        return derivative(
            lambda t: (A * Rotation.from_rotvec(t * np.eye(3)[axis])).as_euler("XYZ")[1]
        )

    return np.array([*(turned(axis) for axis in range(3)), 0.0, 0.0, 0.0])


def nearest_velocities(system, y, rate_after):
    """Return the (Ω, V) with a given θ̇2 that are nearest to those of y in the kinetic metric."""
    body, motion, before = system.body, system.motion(y), velocities(system, y)
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = body.inertia, body.mass * np.eye(3)
    rows, values = [rate_row(motion)], [rate_after]
    if system.coordinates.holds_contact:
        # The velocity of C, V + A(Ω × R), stays zero.
        lever = np.array([motion.A @ np.cross(e, body.contact_point) for e in np.eye(3)]).T
        rows += np.hstack([lever, np.eye(3)]).tolist()
        values += [0.0, 0.0, 0.0]
    C = np.array(rows)
    size = len(C)
    matrix = np.block([[mass, C.T], [C, np.zeros((size, size))]])
    return np.linalg.solve(matrix, np.concatenate([mass @ before, values]))[:6]


@EACH
@pytest.mark.parametrize("restitution", [0.0, 0.4, 1.0])
def test_impact_is_the_least_change_in_the_kinetic_metric(rng, name, restitution):
    for side in (1.0, -1.0):
        system, y = stopped(rng, name, restitution, side)
        rate = rate_row(system.motion(y)) @ velocities(system, y)
        struck = impact(system, y)
        expected = nearest_velocities(system, y, -restitution * rate)
        np.testing.assert_allclose(velocities(system, struck.state), expected, atol=1e-10)
        assert abs(struck.rate - rate) < 1e-11
        before, after = (system.observe(z).energy.sum() for z in (y, struck.state))
        assert abs(before - after - struck.lost) < 1e-11 * (1 + before)
        assert (struck.lost > 1e-3) == (restitution < 1)


@EACH
@pytest.mark.parametrize("mode", [(1.0, 0.0), (0.0, 1.0)])
def test_hold_keeps_the_rate_of_theta2(rng, name, mode):
    """θ̈2 = 0 along the motion, by differences; without the hold it is α of the event function."""
    system, y = stopped(rng, name, side=mode[0] - mode[1], mode=mode)

    def theta2_rate(z):
        return pitch.rate(system.motion(z))

    held = along(theta2_rate, y, system.rates(y))
    free = with_modes(system, (0.0, 0.0))
    alone = along(theta2_rate, y, free.rates(y))
    assert abs(alone) > 1e-2
    assert abs(held) < 1e-9 * abs(alone)
    chosen = mode.index(1.0)
    pressing = (1.0, -1.0)[chosen] * alone
    assert abs(guards_at(system, y)[chosen] - pressing) < 1e-8 * abs(pressing)
    # While free, the event functions are the angles beyond the stop.
    angle = y[1]
    np.testing.assert_allclose(guards_at(free, y), [angle - ANGLE, -angle - ANGLE], atol=1e-15)


@EACH
def test_laid_on_the_stop(rng, name):
    system, y = stopped(rng, name, mode=(0.0, 1.0), side=-1.0)
    moved = y.copy()
    moved[1] += 1e-6
    laid = laid_on_stop(system, moved)
    assert laid[1] == -ANGLE
    assert abs(pitch.rate(system.motion(laid))) < 1e-14
    expected = nearest_velocities(system, y, 0.0)
    np.testing.assert_allclose(velocities(system, laid), expected, atol=1e-4)


def at_stop(rng, rate, load):
    """Return a spherical body at its stop with a rate of θ2, pressed by a load."""
    end = Stop(name="end", angle=ANGLE, restitution=0.5)
    body = replace(random_body(rng), inertia=np.eye(3) * 2.0)

    class Load(Stop):
        holds = False
        mode_count = 0

        def wrench(self, motion, states):
            return couple_on_body(load * motion.B[1])

    push = Load(name="push", angle=ANGLE, restitution=0.0)
    system = System(body, (push, end), CentreCoordinates(), np.zeros(3))
    y = np.zeros(12)
    y[[1, 4]] = ANGLE, rate
    return system, y


@pytest.mark.parametrize("share", [0.0, 0.99, 1.01])
def test_a_body_rests_when_its_next_hop_is_low(rng, share):
    """θ̇2²/(2α) is compared with the height, with α = load/J."""
    load = 3.0
    rate = -np.sqrt(2 * (load / 2.0) * HOP_HEIGHT * share)
    system, y = at_stop(rng, rate, load)
    assert rests(system, y, 1) == (share < 1)
    assert resting_side(system, y) == (1 if share < 1 else 0)
    assert not rests(system, y, -1)


def test_modes_of_a_state_and_of_a_start(rng):
    """A body that is pressed rests; one that moves away, or is inside, does not."""
    system, y = at_stop(rng, 0.0, 3.0)
    for choose in (with_modes_at, with_first_modes):
        assert modes_of(choose(system, y)) == (1.0, 0.0)
        assert modes_of(choose(system, y * np.where(np.arange(12) == 1, 0.9, 1))) == (0.0, 0.0)
        moving = y.copy()
        moving[4] = -1.0
        assert modes_of(choose(system, moving)) == (0.0, 0.0)
        assert modes_of(choose(system, -y)) == (0.0, 0.0)
    assert modes_of(with_modes_at(system, y + 1e-200j)) == (1.0, 0.0)
