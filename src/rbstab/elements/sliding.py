"""The sliding-mode connector (eq. 39) on a surface s of displacement and velocity."""

from dataclasses import dataclass
from typing import ClassVar

from rbstab.elements.element import Element, force_at_contact
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False)
class SlidingConnector(Element):
    """Λ = -K_s sgn(s) on the body at C, axis by axis, with s = E (eq. 39) or s = F + κE.

    The sign is not read off s, which would be a branch: it is a parameter of each axis, the mode σ,
    and whoever follows the motion changes it where s changes sign. An axis that is stuck has σ = 0
    here; the force that holds it is one of constraint (`PartlyHeldCoordinates`). Inside a boundary
    layer of half-width δ the sign is replaced by s/δ, an axis there has β = 1, outside β = 0.

    Args:
        K_s: Force of each axis, shape (3,), N, inertial.
        rate_weight: ρ, 0 for s = E and 1 for s = F + κE; in s = ρF + κE.
        slope: κ, 1 for s = E, else 1/s.
        mode: σ, shape (3,), -1, 0 or 1.
        layer: β, shape (3,), 0 or 1.
        layer_width: δ, in the unit of s; of no effect where β = 0.
    """

    name: ClassVar[str] = "connector"

    K_s: Array
    rate_weight: Number
    slope: Number
    mode: Array
    layer: Array
    layer_width: Number

    def surface(self, E: Array, F: Array) -> Array:
        """s = ρF + κE, shape (3,), m or m/s; of Ė and Ḟ it is ṡ, for it is linear."""
        return self.rate_weight * F + self.slope * E

    def wrench(self, motion: Motion, own: Array) -> Wrench:
        """Λ = -K_s (σ + β s/δ), N, inertial (eq. 39; β = 0 but in a boundary layer)."""
        inside = self.layer * self.surface(motion.E, motion.F) / self.layer_width
        return force_at_contact(-(self.K_s * (self.mode + inside)))

    def stored(self, motion: Motion, own: Array) -> Number:
        """Σ K_s |E| for s = E, J: of each axis K_s σE, in a layer K_s (E² + δ²)/(2δ).

        Both meet at |E| = δ. For s = F + κE the force has no potential, and this is 0: there v - ε
        of eq. 28 takes its place.
        """
        E, width = motion.E, self.layer_width
        inside = self.layer * (E * E + width * width) / (2.0 * width)
        return (1.0 - self.rate_weight) * (self.K_s @ (self.mode * E + inside))
