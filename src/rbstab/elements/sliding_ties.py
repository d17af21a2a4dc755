"""The sliding connector (eq. 39) with modes 0 and 1, at the contact point or at points of ties.

Each law is one class of modes, event functions and force. It stands before the class that gives the
point.
"""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from rbstab.elements.at_point import AtPoint
from rbstab.elements.declarations import ANCHOR, POINT, Gain
from rbstab.elements.element import Element
from rbstab.elements.sliding import Sliding, SlidingConnector
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False, kw_only=True)
class SlidingByModes(Sliding):
    """A sliding connector whose sign σ and layer β are functions of modes 0 and 1."""

    sticks: ClassVar[bool] = False
    """Whether axes may be held at E = F = 0 on s = E."""

    K_s: Array
    rate_weight: Number
    slope: Number
    layer_width: Number

    def at_point(self, motion: Motion) -> Motion:
        """Return the motion with E and F of the point: here those of the contact point."""
        return motion

    def place(self, body: Body) -> Array:
        """Return the point of the body, shape (3,), m, body: here the contact point."""
        return body.contact_point

    def surface(self, motion: Motion) -> Array:
        """s = ρF + κE, shape (3,), m or m/s."""
        return self.combined(motion.E, motion.F)


@dataclass(frozen=True, eq=False, kw_only=True)
class SlidingTie(AtPoint, SlidingByModes):
    """A sliding connector at a point of its own; its surface and law choose one of the classes."""

    gains: ClassVar[tuple[Gain, ...]] = (POINT, ANCHOR, *Sliding.gains)
    mode_count: ClassVar[int] = 3

    def place(self, body: Body) -> Array:
        """Return the point of the tie."""
        return self.point

    def dissipated(self, motion: Motion, own: Array) -> Number:
        """The power that the force takes from the body, W: 0 for s = E, -F'Λ for s = F + κE.

        On s = F + κE it is negative where the force pulls the point towards E = 0.
        """
        here = self.at_point(motion)
        return -self.rate_weight * (self.force(here, own) @ here.F)


@dataclass(frozen=True, eq=False, kw_only=True)
class Crossing(SlidingByModes):
    """Λ = -K_s sgn(E) on s = E, which each axis crosses.

    The force is in the second derivative of E, so Ė is continuous where it jumps: a motion that
    arrives goes through. The bounces become ever shorter and more frequent, and never end
    (docs/sliding.md).

    Its modes are 1 for each axis with E > 0, shape (3,).
    """

    mode_count: ClassVar[int] = 3
    kinked: ClassVar[bool] = True

    mode: Array = field(default_factory=lambda: np.zeros(3))

    def side_and_layer(self) -> tuple[Array, Array]:
        """σ = 2m - 1, and no layer."""
        return 2.0 * self.mode - 1.0, np.zeros(3)

    def guards(self, motion: Motion, own: Array) -> Array:
        """E of each axis, m."""
        return self.surface(self.at_point(motion))


@dataclass(frozen=True, eq=False, kw_only=True)
class Layered(SlidingByModes):
    """Λ = -K_s sat(s/δ): inside the layer |s| <= δ, s/δ replaces the sign. No force jumps.

    Its modes are 1 for each axis with s > δ, then 1 for each with s < -δ, shape (6,).
    """

    mode_count: ClassVar[int] = 6

    mode: Array = field(default_factory=lambda: np.zeros(6))

    def side_and_layer(self) -> tuple[Array, Array]:
        """σ = m₊ - m₋ and β = 1 - m₊ - m₋."""
        above, below = self.mode[:3], self.mode[3:]
        return above - below, 1.0 - above - below

    def guards(self, motion: Motion, own: Array) -> Array:
        """s - δ and -s - δ of each axis, m or m/s."""
        s = self.surface(self.at_point(motion))
        return np.concatenate([s - self.layer_width, -s - self.layer_width])


@dataclass(frozen=True, eq=False, kw_only=True)
class Filippov(SlidingByModes):
    """Λ = -K_s sgn(s) on s = F + κE, where each axis slides while the force is strong enough.

    The force is in the rate of s. So an axis that has arrived at s = 0 is held there by the
    equivalent force λ that keeps ṡ = 0, while |λ| < K_s (Filippov's rule).

    Its modes are the sides m, 1 for each axis with s > 0, then the holds h, 1 for each axis that is
    held, shape (6,). Both are 1 for a held axis. In the methods `own` is λ (`Element.slides`).
    """

    mode_count: ClassVar[int] = 6
    slides: ClassVar[bool] = True

    mode: Array = field(default_factory=lambda: np.zeros(6))

    @property
    def held(self) -> Array:
        """h, shape (3,)."""
        return self.mode[3:]

    def side_and_layer(self) -> tuple[Array, Array]:
        """σ = (2m - 1)(1 - h), and no layer."""
        return (2.0 * self.mode[:3] - 1.0) * (1.0 - self.held), np.zeros(3)

    def force(self, motion: Motion, own: Array) -> Array:
        """Return Λ = -K_s σ, and λ on the held axes, shape (3,), N, inertial."""
        return super().force(motion, own) + self.held * own

    def guards(self, motion: Motion, own: Array) -> Array:
        """s, and -1; on a held axis 1 - λ/K_s and 1 + λ/K_s, which fall to 0 where it is released.

        They depend on the mode, and what follows them is Filippov's choice (`systems.filippov`).
        """
        load, free = own / self.K_s, 1.0 - self.held
        side = free * self.surface(self.at_point(motion)) + self.held * (1.0 - load)
        return np.concatenate([side, self.held * (1.0 + load) - free])

    def surface_rate(self, motion: Motion, acceleration: Array) -> Array:
        """Return ṡ = F' + κF, shape (3,), m/s², from the acceleration of the point, inertial."""
        F = self.at_point(motion).F
        return self.combined(F, acceleration)

    def held_rate(self, motion: Motion) -> Array:
        """Return what is zero on held axes and changes by `surface_rate`: s, shape (3,), m/s."""
        return self.surface(self.at_point(motion))

    def distance(self, motion: Motion) -> Array:
        """Return how far each axis is from being held, shape (3,): |s|, m/s."""
        return np.abs(self.held_rate(motion))


class Sticking(Filippov):
    """Λ = -K_s sgn(E) on s = E, which each axis crosses, but for those that stick at E = F = 0.

    No axis comes to rest there by itself. One that begins at rest is held, and those whose bounces
    have become weak stick (`integrate.switching.chatter`). The equivalent force keeps Ė = 0. The
    modes are those of `Filippov`.
    """

    sticks: ClassVar[bool] = True

    def surface_rate(self, motion: Motion, acceleration: Array) -> Array:
        """Return F', shape (3,), m/s²."""
        return acceleration

    def held_rate(self, motion: Motion) -> Array:
        """Return F, shape (3,), m/s."""
        return self.at_point(motion).F

    def distance(self, motion: Motion) -> Array:
        """Return the larger one of |E| and |F| of each axis, shape (3,), m or m/s."""
        here = self.at_point(motion)
        return np.maximum(np.abs(here.E), np.abs(here.F))


@dataclass(frozen=True, eq=False, kw_only=True)
class CrossingTie(Crossing, SlidingTie):
    """A sliding tie on s = E, which each axis crosses."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LayeredTie(Layered, SlidingTie):
    """A sliding tie with a boundary layer."""

    def at_rest(self) -> Element:
        """The tie on s = E whose layer is that of κE: at rest F = 0."""
        if not self.rate_weight:
            return self
        width = self.layer_width / self.slope
        return replace(self, rate_weight=0.0, slope=1.0, layer_width=width)


@dataclass(frozen=True, eq=False, kw_only=True)
class FilippovTie(Filippov, SlidingTie):
    """A sliding tie on s = F + κE, on which each axis slides."""

    def at_rest(self) -> Element:
        """The tie on s = E: at rest F = 0, and any force up to K_s holds an axis at E = 0."""
        return CrossingTie(
            name=self.name,
            point=self.point,
            anchor=self.anchor,
            K_s=self.K_s,
            rate_weight=0.0,
            slope=1.0,
            layer_width=1.0,
        )


class AtContact(SlidingByModes):
    """The connector of a controller, at the contact point.

    On s = F + κE it has no potential and dissipates nothing: v - ε of eq. 28 replaces v, as for
    `Sliding`.
    """

    name = "connector"

    @property
    def connector(self) -> SlidingConnector:
        """The connector of eq. 39 with σ and β of the modes."""
        side, layer = self.side_and_layer()
        return SlidingConnector(
            self.K_s, self.rate_weight, self.slope, side, layer, self.layer_width
        )


class CrossingConnector(Crossing, AtContact):
    """The connector of a controller on s = E, which each axis crosses."""

    exact_guards: ClassVar[bool] = True


class LayeredConnector(Layered, AtContact):
    """The connector of a controller with a boundary layer."""


class FilippovConnector(Filippov, AtContact):
    """The connector of a controller on s = F + κE, on which each axis slides."""


class StickingConnector(Sticking, AtContact):
    """The connector of a controller on s = E, whose axes may stick there."""

    exact_guards: ClassVar[bool] = True
