"""The sliding-mode connector (eq. 39) on a surface s of displacement and velocity: law and place.

A law is one class: its modes, its event functions and its force, at the contact point. A tie has a
law and then `SlidingTie`, the place at a point of its own, among its bases.
"""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from rbstab.elements.at_point import AtPoint
from rbstab.elements.declarations import ANCHOR, POINT, Gain
from rbstab.elements.element import Element, force_at_contact
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False, kw_only=True)
class Sliding(Element):
    """Λ = -K_s sgn(s) at a point, axis by axis, with s = E (eq. 39) or s = F + κE.

    The sign is not computed from s, because that needs a branch. It is a parameter of each axis, σ.
    In a boundary layer of half-width δ, s/δ replaces the sign: an axis has β = 1 in the layer, and
    β = 0 outside. A law says what σ and β are.

    Args:
        K_s: Force of each axis, shape (3,), N, inertial.
        rate_weight: ρ in s = ρF + κE: 0 for s = E, 1 for s = F + κE.
        slope: κ: 1 for s = E; otherwise in 1/s.
        layer_width: δ, in the unit of s; it has no effect if β = 0.
    """

    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("K_s", "N", "force of each axis, inertial", shape="diagonal"),
    )
    sticks: ClassVar[bool] = False
    """Whether axes may be held at E = F = 0 on s = E."""

    name = "connector"

    K_s: Array
    rate_weight: Number
    slope: Number
    layer_width: Number

    def side_and_layer(self) -> tuple[Array, Array]:
        """Return σ and β, each of shape (3,)."""
        raise NotImplementedError

    def at_point(self, motion: Motion) -> Motion:
        """Return the motion with E and F of the point: here those of the contact point."""
        return motion

    def place(self, body: Body) -> Array:
        """Return the point of the body, shape (3,), m, body: here the contact point."""
        return body.contact_point

    def surface(self, E: Array, F: Array) -> Array:
        """s = ρF + κE, shape (3,), m or m/s; with Ė and Ḟ instead of E and F the result is ṡ."""
        return self.rate_weight * F + self.slope * E

    def distance_along(self, motion: Motion) -> Array:
        """Return s at the point of a motion, shape (3,)."""
        here = self.at_point(motion)
        return self.surface(here.E, here.F)

    def force(self, motion: Motion, states: Array) -> Array:
        """Return Λ = -K_s (σ + β s/δ), shape (3,), N, inertial (eq. 39 without a layer).

        The motion has E and F of the point.
        """
        side, layer = self.side_and_layer()
        inside = layer * self.surface(motion.E, motion.F) / self.layer_width
        return -(self.K_s * (side + inside))

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """Λ, N, inertial."""
        return force_at_contact(self.force(motion, states))

    def stored(self, motion: Motion, states: Array) -> Number:
        """Σ K_s |E| for s = E, J: each axis stores K_s σE, in a layer K_s (E² + δ²)/(2δ).

        Both are equal at |E| = δ. For s = F + κE the force has no potential, and the result is 0.
        Then v - ε of eq. 28 replaces v.
        """
        (side, layer), E, width = self.side_and_layer(), motion.E, self.layer_width
        inside = layer * (E * E + width * width) / (2.0 * width)
        return (1.0 - self.rate_weight) * (self.K_s @ (side * E + inside))


@dataclass(frozen=True, eq=False, kw_only=True)
class SlidingConnector(Sliding):
    """The sliding connector whose σ and β are numbers that an implicit step sets.

    Args:
        mode: σ, shape (3,), -1 to 1.
        layer: β, shape (3,), 0 or 1.
    """

    mode: Array = field(default_factory=lambda: np.zeros(3))
    layer: Array = field(default_factory=lambda: np.zeros(3))

    def side_and_layer(self) -> tuple[Array, Array]:
        """Return σ and β."""
        return self.mode, self.layer


@dataclass(frozen=True, eq=False, kw_only=True)
class Crossing(Sliding):
    """Λ = -K_s sgn(E) on s = E, which each axis crosses.

    The force is in the second derivative of E, so Ė is continuous where it jumps: a motion that
    arrives goes through. The bounces become ever shorter and more frequent, and never end
    (docs/sliding.md).

    Its modes are 1 for each axis with E > 0, shape (3,).
    """

    mode_count: ClassVar[int] = 3
    kinked: ClassVar[bool] = True
    exact_guards: ClassVar[bool] = True

    mode: Array = field(default_factory=lambda: np.zeros(3))

    def side_and_layer(self) -> tuple[Array, Array]:
        """σ = 2m - 1, and no layer."""
        return 2.0 * self.mode - 1.0, np.zeros(3)

    def guards(self, motion: Motion, states: Array) -> Array:
        """E of each axis, m."""
        return self.distance_along(motion)


@dataclass(frozen=True, eq=False, kw_only=True)
class Layered(Sliding):
    """Λ = -K_s sat(s/δ): inside the layer |s| <= δ, s/δ replaces the sign. No force jumps.

    Its modes are 1 for each axis with s > δ, then 1 for each with s < -δ, shape (6,).
    """

    mode_count: ClassVar[int] = 6

    mode: Array = field(default_factory=lambda: np.zeros(6))

    def side_and_layer(self) -> tuple[Array, Array]:
        """σ = m₊ - m₋ and β = 1 - m₊ - m₋."""
        above, below = self.mode[:3], self.mode[3:]
        return above - below, 1.0 - above - below

    def guards(self, motion: Motion, states: Array) -> Array:
        """s - δ and -s - δ of each axis, m or m/s."""
        s = self.distance_along(motion)
        return np.concatenate([s - self.layer_width, -s - self.layer_width])


@dataclass(frozen=True, eq=False, kw_only=True)
class Filippov(Sliding):
    """Λ = -K_s sgn(s) on s = F + κE, where each axis slides while the force is strong enough.

    The force is in the rate of s. So an axis that has arrived at s = 0 is held there by the
    equivalent force λ that keeps ṡ = 0, while |λ| < K_s (Filippov's rule).

    Its modes are the sides m, 1 for each axis with s > 0, then the holds h, 1 for each axis that is
    held, shape (6,). Both are 1 for a held axis. In the methods `states` is λ (`Element.slides`).
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

    def force(self, motion: Motion, states: Array) -> Array:
        """Return Λ = -K_s σ, and λ on the held axes, shape (3,), N, inertial."""
        return super().force(motion, states) + self.held * states

    def guards(self, motion: Motion, states: Array) -> Array:
        """s, and -1; on a held axis 1 - λ/K_s and 1 + λ/K_s, which fall to 0 where it is released.

        They depend on the mode, and what follows them is Filippov's choice (`systems.filippov`).
        """
        load, free = states / self.K_s, 1.0 - self.held
        side = free * self.distance_along(motion) + self.held * (1.0 - load)
        return np.concatenate([side, self.held * (1.0 + load) - free])

    def constrained(self, E: Array, F: Array) -> Array:
        """Return what is kept at zero on held axes, shape (3,), m/s: s. Its rate has Ė and Ḟ."""
        return self.surface(E, F)

    def surface_rate(self, motion: Motion, acceleration: Array) -> Array:
        """Return the rate of `held_rate`, m/s², from the acceleration of the point, inertial."""
        return self.constrained(self.at_point(motion).F, acceleration)

    def held_rate(self, motion: Motion) -> Array:
        """Return what is zero on held axes of a motion, shape (3,), m/s."""
        here = self.at_point(motion)
        return self.constrained(here.E, here.F)

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
    exact_guards: ClassVar[bool] = True

    def constrained(self, E: Array, F: Array) -> Array:
        """Return F: the position is right already."""
        return F

    def distance(self, motion: Motion) -> Array:
        """Return the larger one of |E| and |F| of each axis, shape (3,), m or m/s."""
        here = self.at_point(motion)
        return np.maximum(np.abs(here.E), np.abs(here.F))


@dataclass(frozen=True, eq=False, kw_only=True)
class SlidingTie(AtPoint, Sliding):
    """A sliding connector at a point of its own; its surface and law choose one of the classes."""

    gains: ClassVar[tuple[Gain, ...]] = (POINT, ANCHOR, *Sliding.gains)
    mode_count: ClassVar[int] = 3

    def place(self, body: Body) -> Array:
        """Return the point of the tie."""
        return self.point

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """The power that the force takes from the body, W: 0 for s = E, -F'Λ for s = F + κE.

        On s = F + κE it is negative where the force pulls the point towards E = 0.
        """
        here = self.at_point(motion)
        return -self.rate_weight * (self.force(here, states) @ here.F)


@dataclass(frozen=True, eq=False, kw_only=True)
class CrossingTie(Crossing, SlidingTie):
    """A sliding tie on s = E, which each axis crosses."""

    exact_guards: ClassVar[bool] = False


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
        on_position = {"rate_weight": 0.0, "slope": 1.0, "layer_width": 1.0, "mode": np.zeros(3)}
        return CrossingTie(**vars(self) | on_position)
