"""The couple that holds θ2, and what an impulse on θ2 does to the body.

An element that `holds` acts on θ2 alone. The body's answer is that of its coordinates: about its
centre of gravity if it is free, about C if its contact point is held.
"""

import numpy as np

from rbstab.elements.element import couple_on_body
from rbstab.mechanics import pitch
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import OMEGA
from rbstab.systems.coordinates import Coordinates


def hold(body: Body, coordinates: Coordinates, motion: Motion, loads: Wrench) -> Array:
    """Return [τ, α]: the couple on θ2 that makes θ̈2 zero, N m, and θ̈2 without it, rad/s².

    θ̈2 = α + μτ, so τ = -α/μ.

    Args:
        body: The body.
        coordinates: The coordinates of its motion.
        motion: The motion.
        loads: The wrench of all other elements.
    """
    rates, _ = coordinates.dynamics(body, motion, loads)
    acceleration = pitch.acceleration(motion, rates[OMEGA])
    _, mobility = response(body, coordinates, motion)
    return np.array([-acceleration / mobility, acceleration])


def response(body: Body, coordinates: Coordinates, motion: Motion) -> tuple[Array, Number]:
    """Return the jump of the coordinates by a unit impulse on θ2, and μ, the jump of θ̇2.

    An impulse does to the velocities what the same couple does to the accelerations of a body that
    is at rest in the same pose: gyroscopic and centripetal terms have no time to act. So the jump
    follows from the equations of motion. For the free body it is J⁻¹b in Ω, and zero in V.

    Args:
        body: The body.
        coordinates: The coordinates of its motion.
        motion: The motion; only its pose counts.

    Returns:
        The jump, shape (coordinates.size,), by N m s; μ = b'M⁻¹b, 1/(kg m²).
    """
    at_rest = motion._replace(Omega=ZERO, V=ZERO, E=ZERO, F=ZERO)
    along = pitch.direction(motion)
    jump, _ = coordinates.dynamics(body, at_rest, couple_on_body(along))
    return jump, along @ jump[OMEGA]
