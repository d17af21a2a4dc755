"""What every element states."""

from typing import ClassVar

import numpy as np

from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number

NO_STATE = np.zeros(0)
NO_STATE.flags.writeable = False


class Element:
    """A passive element: four statements, of which the defaults say "nothing".

    A concrete element is a frozen dataclass whose fields are its gains (arrays of floats, or of the
    symbols of a compiled engine) and whose class attributes are its name, the number of its own
    states and the fields by which it dissipates, each a matrix that has to be positive definite.
    `own` below is the array of its states, of shape (state_size,).
    """

    name: ClassVar[str]
    state_size: ClassVar[int] = 0
    damping: ClassVar[tuple[str, ...]] = ()

    def wrench(self, motion: Motion, own: Array) -> Wrench:
        """The force, couple and contact force that act on the body."""
        raise NotImplementedError

    def stored(self, motion: Motion, own: Array) -> Number:
        """The energy held, J."""
        return 0.0

    def dissipated(self, motion: Motion, own: Array) -> Number:
        """The power lost, W, never negative for positive definite gains."""
        return 0.0

    def rates(self, motion: Motion, own: Array) -> Array:
        """The derivatives of the element's own states, shape (state_size,)."""
        return NO_STATE


def force_at_centre(force: Array) -> Wrench:
    """A wrench of a force alone, N, inertial, at the centre of gravity."""
    return Wrench(force, ZERO, ZERO)


def couple_on_body(couple: Array) -> Wrench:
    """A wrench of a couple alone, N m, body coordinates."""
    return Wrench(ZERO, couple, ZERO)


def force_at_contact(force: Array) -> Wrench:
    """A wrench of a force alone, N, inertial, on the body at C."""
    return Wrench(ZERO, ZERO, force)
