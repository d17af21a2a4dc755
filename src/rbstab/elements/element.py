"""The interface of elements: what acts on the body, and the power that each of them states."""

from typing import ClassVar

import numpy as np

from rbstab.elements.declarations import Gain, OwnState
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number

NO_STATE = np.zeros(0)
NO_STATE.flags.writeable = False


class Element:
    """An element, defined by its wrench, stored energy, dissipation, supply and own states.

    A passive element supplies no power, and states nothing about it. An element that is not passive
    states `supplied`, the power that comes from outside.

    A concrete element is a frozen dataclass. Its fields are its gains: arrays of floats, or of
    symbols of a compiled engine. It has a `name` (used for its energy and its parameters), and its
    class attributes declare its `gains` and its own `states`. In the methods `states` is the array
    of its own states, one after the other in the declared order, shape (state_size,).
    """

    name: str
    """An element of a config has a name of its own; then `name` is a field."""

    gains: ClassVar[tuple[Gain, ...]] = ()
    states: ClassVar[tuple[OwnState, ...]] = ()
    state_size: ClassVar[int] = 0
    """The number of own states, derived from `states`."""

    smooth: ClassVar[bool] = False
    """Whether what it exerts has continuous derivatives wherever |θ2| < π/2, and where its line has
    a length. Of another element this is not known."""

    mode_count: ClassVar[int] = 0
    """The number of switches of an element whose force is smooth only between them. It has a field
    `mode`, shape (mode_count,), of numbers 0 or 1. Its formulas use them as numbers, and so need no
    branch. Its stored energy must be continuous at each switch."""

    clearance_count: ClassVar[int] = 0
    """The number of entries of `clearances`."""

    kinked: ClassVar[bool] = False
    """Whether its force jumps at its switches, so that its stored energy has a kink there. Then its
    stored energy is linear in each mode, and it has no own states."""

    exact_guards: ClassVar[bool] = False
    """Whether its event functions are the states E of coordinates W, axis by axis, while it holds
    no axis; others of its event functions are constants then. So their signs are exact, and their
    rates are the states F. Those of other elements may be wrong by round-off."""

    holds: ClassVar[bool] = False
    """Whether it can hold θ2, as a stop against which the body rests. Then it has no own states.
    Its methods `wrench` and `guards` get the hold as `states`: [τ, α], the couple on θ2 that keeps
    θ̇2 constant, N m, and the acceleration of θ2 that all other elements cause, rad/s². The system
    computes them (`systems.surface_forces`). At most
    one element of a system may hold."""

    supplies: ClassVar[bool] = False
    """Whether it may supply power: whether its class states `supplied`."""

    slides: ClassVar[bool] = False
    """Whether its axes slide on surfaces s = F + κE (`Filippov`). Then it has no own states, and
    its methods `wrench`, `dissipated` and `guards` get as `states` the equivalent forces that hold
    its axes there, shape (3,), N, inertial (`systems.surface_forces`). The system computes them,
    since they follow from the loads of all elements."""

    from_user: ClassVar[bool] = False
    """Whether its class is from a file of a user. Nothing guarantees that its statements are the
    same formulas for all numbers: proofs are of those that it states with expressions
    (`proof.passive.statements`)."""

    def __init_subclass__(cls) -> None:
        """Derive `state_size` from the declared states, and `supplies` from the statements."""
        super().__init_subclass__()
        cls.state_size = sum(state.size for state in cls.states)
        cls.supplies = cls.supplied is not Element.supplied

    @property
    def timed(self) -> bool:
        """Whether one of its statements depends on `Motion.time`."""
        return False

    @property
    def own_states(self) -> tuple[OwnState, ...]:
        """The own states with their names in a system, such as `connector_state`.

        An element of a config has a name of its own, which stands before: `second_tie.state`. So
        the own states of several elements of one class have different names.
        """
        if "name" not in vars(self):
            return self.states
        return tuple(state.of_element(self.name) for state in self.states)

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """Return the force, couple and contact force on the body."""
        raise NotImplementedError

    def stored(self, motion: Motion, states: Array) -> Number:
        """Return the stored energy, J."""
        return 0.0

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """Return the dissipated power, W; it is zero or positive for positive definite gains."""
        return 0.0

    def supplied(self, motion: Motion, states: Array) -> Number:
        """Return the power that comes from outside, W; negative where the element takes power."""
        return 0.0

    def rates(self, motion: Motion, states: Array) -> Array:
        """Return the derivatives of the own states, shape (state_size,)."""
        return NO_STATE

    def clearances(self, motion: Motion) -> Array:
        """Return how far a motion is from where the statements are not defined: (clearance_count,).

        A run ends where one of them falls to zero. They must be smooth, also there.
        """
        return NO_STATE

    def at_rest(self) -> "Element":
        """Return an element whose stored energy has the force of this one on a body at rest.

        Only an element whose force on a body at rest does work that it does not store is another
        one then.
        """
        return self

    def guards(self, motion: Motion, states: Array) -> Array:
        """Return the event functions, shape (mode_count,): mode i is 1 where entry i is positive.

        Their rates must be continuous at a switch; so the motion goes through it, and cannot slide
        along it. They must not depend on `mode`, except those of an element that `holds`: such an
        element decides by an impact what follows its event (`integrate.switching.driver`).
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
