"""The visco-elastic connector (eq. 40, 41)."""

from dataclasses import dataclass
from typing import ClassVar

from rbstab.elements.at_point import AtPoint
from rbstab.elements.declarations import ANCHOR, POINT, Gain
from rbstab.elements.element import Element, force_at_contact
from rbstab.mechanics.algebra import quadratic_form
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False)
class ViscoElasticConnector(Element):
    """Λ = -K_c E - L_c F on the body at C (eq. 40).

    Args:
        K_c: Stiffness, shape (3, 3), N/m, inertial.
        L_c: Damping, shape (3, 3), N s/m, inertial.
    """

    smooth = True
    name = "connector"
    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("K_c", "N/m", "connector stiffness, inertial"),
        Gain("L_c", "N s/m", "connector damping, inertial", dissipates=True),
    )

    K_c: Array
    L_c: Array

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """Λ = -K_c E - L_c F, N, inertial (eq. 40)."""
        return force_at_contact(-(self.K_c @ motion.E) - self.L_c @ motion.F)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ E'K_c E, J (eq. 41)."""
        return 0.5 * quadratic_form(self.K_c, motion.E)

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """F'L_c F, W (eq. 43)."""
        return quadratic_form(self.L_c, motion.F)


@dataclass(frozen=True, eq=False, kw_only=True)
class ViscoElasticTie(AtPoint, ViscoElasticConnector):
    """The same connector at a point of its own."""

    gains: ClassVar[tuple[Gain, ...]] = (POINT, ANCHOR, *ViscoElasticConnector.gains)
