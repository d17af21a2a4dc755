"""The embedded connector, which has own states (eq. 22, 44)."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from rbstab.elements.at_point import AtPoint
from rbstab.elements.declarations import ANCHOR, POINT, Gain, OwnState
from rbstab.elements.element import Element, force_at_contact
from rbstab.mechanics.algebra import inverse, quadratic_form
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False)
class EmbeddedConnector(Element):
    """Λ = -K_c(E - D) - L_c F with Ḋ = L_d⁻¹(K_c(E - D) - K_d D) (eq. 22).

    The own state is D, shape (3,), m, inertial.

    Args:
        K_c: Stiffness between C and D, shape (3, 3), N/m, inertial.
        L_c: Damping at C, shape (3, 3), N s/m, inertial.
        K_d: Stiffness between D and the anchor, shape (3, 3), N/m, inertial.
        L_d: Damping of D, shape (3, 3), N s/m, inertial.
    """

    smooth = True
    name = "connector"
    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("K_c", "N/m", "connector stiffness, inertial"),
        Gain("L_c", "N s/m", "connector damping, inertial", dissipates=True),
        Gain("K_d", "N/m", "stiffness of the connector's own state, inertial"),
        Gain("L_d", "N s/m", "damping of the connector's own state, inertial", dissipates=True),
    )
    states: ClassVar[tuple[OwnState, ...]] = (
        OwnState("connector_state", "D", "m", "own state of the connector, inertial (eq. 22)"),
    )

    K_c: Array
    L_c: Array
    K_d: Array
    L_d: Array

    @cached_property
    def _damping_inverse(self) -> Array:
        return inverse(self.L_d)

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """Λ = -K_c(E - D) - L_c F, N, inertial (eq. 22)."""
        return force_at_contact(-(self.K_c @ (motion.E - states)) - self.L_c @ motion.F)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ (E - D)'K_c(E - D) + ½ D'K_d D, J (eq. 44)."""
        stretch = quadratic_form(self.K_c, motion.E - states)
        return 0.5 * stretch + 0.5 * quadratic_form(self.K_d, states)

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """F'L_c F + Ḋ'L_d Ḋ, W (eq. 46)."""
        at_contact = quadratic_form(self.L_c, motion.F)
        return at_contact + quadratic_form(self.L_d, self._state_rate(motion.E, states))

    def rates(self, motion: Motion, states: Array) -> Array:
        """Ḋ, m/s (eq. 22)."""
        return self._state_rate(motion.E, states)

    def _state_rate(self, E: Array, D: Array) -> Array:
        """Ḋ = L_d⁻¹(K_c(E - D) - K_d D), m/s (eq. 22)."""
        return self._damping_inverse @ (self.of_spring(self.K_c @ (E - D)) - self.K_d @ D)

    def of_spring(self, spring: Array) -> Array:
        """Return the force by which the spring K_c drives D, N: itself, unless it has a limit."""
        return spring


@dataclass(frozen=True, eq=False, kw_only=True)
class EmbeddedTie(AtPoint, EmbeddedConnector):
    """The same connector at a point of its own, with a state D of its own."""

    gains: ClassVar[tuple[Gain, ...]] = (POINT, ANCHOR, *EmbeddedConnector.gains)
    states: ClassVar[tuple[OwnState, ...]] = (
        OwnState("state", "D", "m", "own state of the embedded tie, inertial (eq. 22)"),
    )
