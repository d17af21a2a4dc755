"""Guards of θ2 that act only beyond a soft angle: a spring, and a constant couple."""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element, couple_on_body
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import PITCH

SOFT_ANGLE = Gain(
    "soft_angle",
    "rad",
    "θ_s, the guard acts where |θ2| is larger",
    shape="number",
    below=math.pi / 2,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class SoftGuard(Element):
    """A guard with an energy U(θ2) that is zero for |θ2| <= θ_s.

    Its modes are m₊, 1 if θ2 > θ_s, and m₋, 1 if -θ2 > θ_s.

    Args:
        name: The name of the element in its config.
        soft_angle: θ_s, rad.
        mode: [m₊, m₋], shape (2,), each 0 or 1.
    """

    mode_count: ClassVar[int] = 2

    name: str
    soft_angle: Number
    mode: Array = field(default_factory=lambda: np.zeros(2))

    def guards(self, motion: Motion, states: Array) -> Array:
        """θ2 - θ_s and -θ2 - θ_s, rad."""
        return self.beyond(motion.Theta[PITCH])

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """-B' ∂U/∂Θ, N m, body; the row of B for θ2 has unit length, so its size is |dU/dθ2|."""
        return couple_on_body(-(motion.B.T[:, PITCH] * self.slope(motion.Theta[PITCH])))

    def stored(self, motion: Motion, states: Array) -> Number:
        """U(θ2), J."""
        return self.energy(motion.Theta[PITCH])

    def energy(self, angle: Number) -> Number:
        """U at an angle θ2 that belongs to the modes, J."""
        raise NotImplementedError

    def slope(self, angle: Number) -> Number:
        """dU/dθ2 at an angle θ2 that belongs to the modes, N m; it never falls with θ2."""
        raise NotImplementedError

    def beyond(self, angle: Number) -> Array:
        """Return the event functions at an angle θ2: θ2 - θ_s and -θ2 - θ_s, rad."""
        return np.array([angle - self.soft_angle, -angle - self.soft_angle])

    def _excess(self, angle: Number) -> tuple[Number, Number]:
        """(θ2 - θ_s)₊ and (-θ2 - θ_s)₊, rad."""
        above, below = self.mode * self.beyond(angle)
        return above, below


@dataclass(frozen=True, eq=False, kw_only=True)
class StiffGuard(SoftGuard):
    """The energy ½ k (|θ2| - θ_s)₊²: a spring that acts only beyond a soft angle.

    Args:
        stiffness: k, N m/rad.
    """

    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("stiffness", "N m/rad", "k, couple by angle beyond the soft angle", shape="number"),
        SOFT_ANGLE,
    )

    stiffness: Number

    def energy(self, angle: Number) -> Number:
        """½ k (|θ2| - θ_s)₊², J."""
        above, below = self._excess(angle)
        return 0.5 * self.stiffness * (above * above + below * below)

    def slope(self, angle: Number) -> Number:
        """k sgn(θ2) (|θ2| - θ_s)₊, N m."""
        above, below = self._excess(angle)
        return self.stiffness * (above - below)


@dataclass(frozen=True, eq=False, kw_only=True)
class RepellingGuard(SoftGuard):
    """The energy K (|θ2| - θ_s)₊: a couple of constant size, which jumps at the soft angle.

    θ2 and its rate are continuous at the switch, so a motion that arrives with a rate goes through.
    But a load of less than K that keeps pressing θ2 against the soft angle makes a body hop about
    it: with damping, the hops become infinitely many, and the run ends at a limit. A stiff guard
    has no such end.

    Args:
        couple: K, N m.
    """

    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("couple", "N m", "K, couple beyond the soft angle", shape="number"),
        SOFT_ANGLE,
    )

    kinked: ClassVar[bool] = True

    couple: Number

    def energy(self, angle: Number) -> Number:
        """K (|θ2| - θ_s)₊, J."""
        above, below = self._excess(angle)
        return self.couple * (above + below)

    def slope(self, angle: Number) -> Number:
        """K sgn(θ2) if |θ2| > θ_s, N m."""
        return self.couple * (self.mode[0] - self.mode[1])
