"""The interface of passive elements."""

from typing import ClassVar

import numpy as np

from rbstab.elements.declarations import Gain, OwnState
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number

NO_STATE = np.zeros(0)
NO_STATE.flags.writeable = False


class Element:
    """A passive element, defined by its wrench, stored energy, dissipation and own states.

    A concrete element is a frozen dataclass. Its fields are its gains: arrays of floats, or of
    symbols of a compiled engine. It has a `name` (used for its energy and its parameters), and its
    class attributes declare its `gains` and its own `states`. In the methods `own` is the array of
    its own states, one after the other in the order of `states`, shape (state_size,).
    """

    name: str
    """An element of a config has a name of its own; then `name` is a field."""

    gains: ClassVar[tuple[Gain, ...]] = ()
    states: ClassVar[tuple[OwnState, ...]] = ()
    state_size: ClassVar[int] = 0
    """The number of own states, derived from `states`."""

    mode_count: ClassVar[int] = 0
    """The number of switches of an element whose force is smooth only between them. It has a field
    `mode`, shape (mode_count,), of numbers 0 or 1. Its formulas use them as numbers, and so need no
    branch. Its stored energy must be continuous at each switch."""

    from_user: ClassVar[bool] = False
    """Whether its class is from a file of a user. No proof evaluates the statements of such a
    class: nothing guarantees that they are the same formulas for all numbers."""

    def __init_subclass__(cls) -> None:
        """Derive `state_size` from the declared states."""
        super().__init_subclass__()
        cls.state_size = sum(state.size for state in cls.states)

    def wrench(self, motion: Motion, own: Array) -> Wrench:
        """Return the force, couple and contact force on the body."""
        raise NotImplementedError

    def stored(self, motion: Motion, own: Array) -> Number:
        """Return the stored energy, J."""
        return 0.0

    def dissipated(self, motion: Motion, own: Array) -> Number:
        """Return the dissipated power, W; it is zero or positive for positive definite gains."""
        return 0.0

    def rates(self, motion: Motion, own: Array) -> Array:
        """Return the derivatives of the own states, shape (state_size,)."""
        return NO_STATE

    def guards(self, motion: Motion, own: Array) -> Array:
        """Return the event functions, shape (mode_count,): mode i is 1 where entry i is positive.

        They must not depend on `mode`. Their rates must be continuous at a switch; so the motion
        goes through it, and cannot slide along it.
        """
        return NO_STATE


def force_at_centre(force: Array) -> Wrench:
    """Return the wrench of a force, N, inertial, at the centre of gravity."""
    return Wrench(force, ZERO, ZERO)


def couple_on_body(couple: Array) -> Wrench:
    """Return the wrench of a couple, N m, body coordinates."""
    return Wrench(ZERO, couple, ZERO)


def force_at_contact(force: Array) -> Wrench:
    """Return the wrench of a force, N, inertial, on the body at C."""
    return Wrench(ZERO, ZERO, force)
