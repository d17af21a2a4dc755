"""The sliding-mode connector (eq. 39) on a surface s of displacement and velocity."""

from dataclasses import dataclass
from typing import ClassVar

from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element, force_at_contact
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


class Sliding(Element):
    """Λ = -K_s sgn(s) at a point, axis by axis, with s = E (eq. 39) or s = F + κE.

    The sign is not computed from s, because that needs a branch. It is a parameter of each axis, σ.
    In a boundary layer of half-width δ, s/δ replaces the sign: an axis has β = 1 in the layer, and
    β = 0 outside. A law (a class) says what σ and β are.

    Attributes:
        K_s: Force of each axis, shape (3,), N, inertial.
        rate_weight: ρ in s = ρF + κE: 0 for s = E, 1 for s = F + κE.
        slope: κ: 1 for s = E; otherwise in 1/s.
        layer_width: δ, in the unit of s; it has no effect if β = 0.
    """

    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("K_s", "N", "force of each axis, inertial", shape="diagonal"),
    )

    K_s: Array
    rate_weight: Number
    slope: Number
    layer_width: Number

    def side_and_layer(self) -> tuple[Array, Array]:
        """Return σ and β, each of shape (3,)."""
        raise NotImplementedError

    def combined(self, E: Array, F: Array) -> Array:
        """s = ρF + κE, shape (3,), m or m/s; with Ė and Ḟ instead of E and F the result is ṡ."""
        return self.rate_weight * F + self.slope * E

    def force(self, motion: Motion, own: Array) -> Array:
        """Return Λ = -K_s (σ + β s/δ), shape (3,), N, inertial (eq. 39 without a layer)."""
        side, layer = self.side_and_layer()
        inside = layer * self.combined(motion.E, motion.F) / self.layer_width
        return -(self.K_s * (side + inside))

    def wrench(self, motion: Motion, own: Array) -> Wrench:
        """Λ, N, inertial."""
        return force_at_contact(self.force(motion, own))

    def stored(self, motion: Motion, own: Array) -> Number:
        """Σ K_s |E| for s = E, J: each axis stores K_s σE, in a layer K_s (E² + δ²)/(2δ).

        Both are equal at |E| = δ. For s = F + κE the force has no potential, and the result is 0.
        Then v - ε of eq. 28 replaces v.
        """
        (side, layer), E, width = self.side_and_layer(), motion.E, self.layer_width
        inside = layer * (E * E + width * width) / (2.0 * width)
        return (1.0 - self.rate_weight) * (self.K_s @ (side * E + inside))


@dataclass(frozen=True, eq=False)
class SlidingConnector(Sliding):
    """The sliding connector whose σ and β are numbers that an implicit step sets.

    An axis with σ = 0 is then held by a force of constraint (`PartlyHeldCoordinates`).

    Args:
        K_s: Force of each axis, shape (3,), N, inertial.
        rate_weight: ρ.
        slope: κ.
        mode: σ, shape (3,), -1, 0 or 1.
        layer: β, shape (3,), 0 or 1.
        layer_width: δ.
    """

    name = "connector"

    K_s: Array
    rate_weight: Number
    slope: Number
    mode: Array
    layer: Array
    layer_width: Number

    surface = Sliding.combined

    def side_and_layer(self) -> tuple[Array, Array]:
        """Return σ and β."""
        return self.mode, self.layer
