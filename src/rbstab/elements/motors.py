"""Motors: stabilizers, connectors and ties whose force has a limit, or lags.

A motor acts along coordinates x with the rates u = dx/dt: X of H, the Euler angles Θ of N, E of a
connector or tie. It is told the force -(K x + L u). All formulas but those of `Hard` are smooth.

*Limit.* With diagonal K and L each component has a limit M of its own, sat(y) = y/√(1 + (y/M)²):

    f = -sat(K x + L u)    stored: Σ ∫ sat(k x) dx    dissipated: (sat(K x + L u) - sat(K x))'u >= 0

*Lag.* The force follows with a time constant τ: (K + L s)/(s (1 + τ s)) = K/s + (L - τK)/(1 + τ s)
from u to -f. That is a spring beside a damper D = L - τK on z, which follows u with this lag:

    f = -K x - D z    dz/dt = (u - z)/τ    stored: ½ x'K x + ½ τ z'D z    dissipated: z'D z

So it is passive if D is positive definite: if τ is below the least eigenvalue of K⁻¹L.

*Embedded.* With the own state D of eq. 22 a limit acts on x = E - D, and u is F = dE/dt, not dx/dt.
The force of the spring alone, with the same limit, drives D. With S = Σ ∫ sat(k x) dx + ½ D'K_d D:

    L_d dD/dt = sat(K_c x) - K_d D
    dS/dt = sat(K_c x)'(F - dD/dt) + D'K_d dD/dt = sat(K_c x)'F - (dD/dt)'L_d dD/dt
    -f'F - dS/dt = (sat(K_c x + L_c F) - sat(K_c x))'F + (dD/dt)'L_d dD/dt >= 0

Were D driven by K_c x, or by the whole force, a product of either sign would be left.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from rbstab.elements.at_point import AtPoint
from rbstab.elements.declarations import Gain, OwnState
from rbstab.elements.element import Element, couple_on_body, force_at_centre, force_at_contact
from rbstab.elements.embedded import EmbeddedConnector, EmbeddedTie
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector, ViscoElasticTie
from rbstab.mechanics.algebra import quadratic_form
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number, entrywise, root_excess, sqrt


class Motor(Element):
    """A motor along coordinates x."""

    @property
    def matrices(self) -> tuple[Array, Array]:
        """K and L, shape (3, 3) each."""
        raise NotImplementedError

    def along(self, motion: Motion, states: Array) -> tuple[Array, Array]:
        """Return x and u, shape (3,) each."""
        raise NotImplementedError

    def acting(self, motion: Motion, force: Array) -> Wrench:
        """Return the wrench of a force f along x, shape (3,)."""
        raise NotImplementedError


class OfPosition(Motor, TranslationalStabilizer):
    """H: x is X."""

    @property
    def matrices(self) -> tuple[Array, Array]:
        """K_t and L_t."""
        return self.K_t, self.L_t

    def along(self, motion: Motion, states: Array) -> tuple[Array, Array]:
        """X and V."""
        return motion.X, motion.V

    def acting(self, motion: Motion, force: Array) -> Wrench:
        """Return a force, N, inertial, at the centre of gravity."""
        return force_at_centre(force)


class OfAngles(Motor, RotationalStabilizer):
    """N: x is Θ. So its damping acts on the rates of the Euler angles too: L_r dΘ/dt."""

    @property
    def matrices(self) -> tuple[Array, Array]:
        """K_r and L_r."""
        return self.K_r, self.L_r

    def along(self, motion: Motion, states: Array) -> tuple[Array, Array]:
        """Θ and BΩ."""
        return motion.Theta, motion.B @ motion.Omega

    def acting(self, motion: Motion, force: Array) -> Wrench:
        """Return B'f, N m, body, of couples f on the Euler angles."""
        return couple_on_body(motion.B.T @ force)


class OfContact(Motor, ViscoElasticConnector):
    """A connector: x is E."""

    @property
    def matrices(self) -> tuple[Array, Array]:
        """K_c and L_c."""
        return self.K_c, self.L_c

    def along(self, motion: Motion, states: Array) -> tuple[Array, Array]:
        """E and F."""
        return motion.E, motion.F

    def acting(self, motion: Motion, force: Array) -> Wrench:
        """Return a force, N, inertial, at C."""
        return force_at_contact(force)


class Embedded(Motor, EmbeddedConnector):
    """An embedded connector: x is E - D. It stands before `Limited` among the bases of a class."""

    @property
    def matrices(self) -> tuple[Array, Array]:
        """K_c and L_c."""
        return self.K_c, self.L_c

    def along(self, motion: Motion, states: Array) -> tuple[Array, Array]:
        """E - D and F."""
        return motion.E - states, motion.F

    def acting(self, motion: Motion, force: Array) -> Wrench:
        """Return a force, N, inertial, at C."""
        return force_at_contact(force)

    def stored(self, motion: Motion, states: Array) -> Number:
        """Return what the limited spring stores, and ½ D'K_d D, J."""
        return super().stored(motion, states) + 0.5 * quadratic_form(self.K_d, states)

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """Return what the limit leaves of the damper at C, and (dD/dt)'L_d dD/dt, W."""
        of_state = quadratic_form(self.L_d, self.rates(motion, states))
        return super().dissipated(motion, states) + of_state


@dataclass(frozen=True, eq=False, kw_only=True)
class Limited(Motor):
    """A motor whose force has a limit, component by component.

    Args:
        limit: M, shape (3,), N or N m.
    """

    limit: Array

    def saturated(self, y: Array) -> Array:
        """Return sat(y)."""
        ratio = y / self.limit
        return y / sqrt(1.0 + ratio * ratio)

    def of_spring(self, spring: Array) -> Array:
        """Return sat(K x)."""
        return self.saturated(spring)

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """Return that of -sat(K x + L u)."""
        (K, L), (x, u) = self.matrices, self.along(motion, states)
        return self.acting(motion, -self.saturated(K @ x + L @ u))

    def stored(self, motion: Motion, states: Array) -> Number:
        """Σ ∫ sat(k x) dx = Σ M²/k (√(1 + (k x/M)²) - 1), J."""
        K, _ = self.matrices
        ratio = K @ self.along(motion, states)[0] / self.limit
        roots = entrywise(root_excess, ratio)
        return self.limit * self.limit / K.diagonal() @ roots

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """(sat(K x + L u) - sat(K x))'u, W: not negative, as sat rises."""
        (K, L), (x, u) = self.matrices, self.along(motion, states)
        return (self.saturated(K @ x + L @ u) - self.of_spring(K @ x)) @ u


@dataclass(frozen=True, eq=False, kw_only=True)
class Hard(Limited):
    """A motor whose force follows exactly up to its limit, by component: sat(y) is y, M or -M.

    It switches at its limit. Its modes are 1 where K x + L u is above M, and below -M, three
    components each, and then where K x is. Beyond the limit it may dissipate nothing.

    Args:
        mode: The modes, shape (12,), each 0 or 1.
    """

    smooth = False
    mode_count: ClassVar[int] = 12

    mode: Array = field(default_factory=lambda: np.zeros(12))

    def guards(self, motion: Motion, states: Array) -> Array:
        """±(K x + L u) - M, and ±K x - M."""
        (K, L), (x, u) = self.matrices, self.along(motion, states)
        spring = K @ x
        total = spring + L @ u
        return np.concatenate([total, -total, spring, -spring]) - np.tile(self.limit, 4)

    def saturated(self, y: Array) -> Array:
        """Return sat(y) of y = K x + L u."""
        return self._clamped(y, *self._beyond[:2])

    def of_spring(self, spring: Array) -> Array:
        """Return sat(K x)."""
        return self._clamped(spring, *self._beyond[2:])

    def stored(self, motion: Motion, states: Array) -> Number:
        """Σ ½ k x², and M|x| - ½ M²/k beyond the limit, J."""
        K, _ = self.matrices
        x, _ = self.along(motion, states)
        _, _, above, below = self._beyond
        reach = (above - below) * x - (above + below) * self.limit / K.diagonal()
        return 0.5 * (self.of_spring(K @ x) @ x + self.limit @ reach)

    @property
    def _beyond(self) -> Array:
        return self.mode.reshape(4, 3)

    def _clamped(self, y: Array, above: Array, below: Array) -> Array:
        return (1.0 - above - below) * y + (above - below) * self.limit


def _limit(unit: str, what: str, key: str) -> Gain:
    return Gain("limit", unit, f"largest {what}, by component", "diagonal", key=key)


OF_CONNECTOR = _limit("N", "force of the connector", "connector_actuators.limit")
OF_TIE = _limit("N", "force of the tie", "actuators.limit")


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitedForce(Limited, OfPosition):
    """H with a limit."""

    gains: ClassVar[tuple[Gain, ...]] = (
        *TranslationalStabilizer.gains,
        _limit("N", "H", "actuators.limit.H"),
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitedCouple(Limited, OfAngles):
    """N with a limit for the couple on each Euler angle."""

    gains: ClassVar[tuple[Gain, ...]] = (
        *RotationalStabilizer.gains,
        _limit("N m", "N", "actuators.limit.N"),
    )


class LimitedBodyCouple(LimitedCouple):
    """N = -sat(n + L_r Ω) with n = B'K_r Θ, limited by component in body coordinates.

    It is not passive: with the stored energy of Euler axes it supplies (B'sat(K_r Θ) - sat(n))'Ω,
    which has either sign.
    """

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """N = -sat(n + L_r Ω), N m, body."""
        total = motion.B.T @ (self.K_r @ motion.Theta) + self.L_r @ motion.Omega
        return couple_on_body(-self.saturated(total))

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """(sat(n + L_r Ω) - sat(n))'Ω, W."""
        n = motion.B.T @ (self.K_r @ motion.Theta)
        rise = self.saturated(n + self.L_r @ motion.Omega) - self.saturated(n)
        return rise @ motion.Omega

    def supplied(self, motion: Motion, states: Array) -> Number:
        """(B'sat(K_r Θ) - sat(n))'Ω, W."""
        spring = self.K_r @ motion.Theta
        there = motion.B.T @ self.saturated(spring)
        return (there - self.saturated(motion.B.T @ spring)) @ motion.Omega


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitedConnector(Limited, OfContact):
    """A visco-elastic connector with a limit."""

    gains: ClassVar[tuple[Gain, ...]] = (*ViscoElasticConnector.gains, OF_CONNECTOR)


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitedTie(AtPoint, LimitedConnector):
    """A tie with a limit."""

    gains: ClassVar[tuple[Gain, ...]] = (*ViscoElasticTie.gains, OF_TIE)


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitedEmbeddedConnector(Embedded, Limited):
    """An embedded connector with a limit."""

    gains: ClassVar[tuple[Gain, ...]] = (*EmbeddedConnector.gains, OF_CONNECTOR)


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitedEmbeddedTie(AtPoint, LimitedEmbeddedConnector):
    """An embedded tie with a limit."""

    gains: ClassVar[tuple[Gain, ...]] = (*EmbeddedTie.gains, OF_TIE)
    states: ClassVar[tuple[OwnState, ...]] = EmbeddedTie.states


@dataclass(frozen=True, eq=False, kw_only=True)
class HardForce(Hard, LimitedForce):
    """H with a hard limit."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HardCouple(Hard, LimitedCouple):
    """N with a hard limit for the couple on each Euler angle."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HardConnector(Hard, LimitedConnector):
    """A visco-elastic connector with a hard limit."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HardTie(AtPoint, HardConnector):
    """A tie with a hard limit."""

    gains: ClassVar[tuple[Gain, ...]] = LimitedTie.gains


LAG = Gain("lag", "s", "τ, time constant of the motors", "number", key="actuators.lag")


@dataclass(frozen=True, eq=False, kw_only=True)
class Lagged(Motor):
    """A motor with a lag. Its own state is z, shape (3,), in the unit of u; it begins at zero.

    Args:
        lag: τ, s.
    """

    lag: Number

    @property
    def left(self) -> Array:
        """D = L - τK, shape (3, 3): the damping that the lag leaves."""
        K, L = self.matrices
        return L - K * self.lag

    @property
    def weight(self) -> Array:
        """The matrix of what z stores and dissipates: D."""
        return self.left

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """Return that of -K x - D z."""
        x, _ = self.along(motion, states)
        return self.acting(motion, -(self.matrices[0] @ x) - self.left @ states)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ x'K x + ½ τ z'D z, J."""
        x, _ = self.along(motion, states)
        of_lag = 0.5 * self.lag * quadratic_form(self.weight, states)
        return 0.5 * quadratic_form(self.matrices[0], x) + of_lag

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """z'D z, W."""
        return quadratic_form(self.weight, states)

    def rates(self, motion: Motion, states: Array) -> Array:
        """dz/dt = (u - z)/τ."""
        return (self.along(motion, states)[1] - states) / self.lag


class Late(Lagged):
    """A motor whose lag is too long to be passive: it stores and dissipates with L in place of D.

    So it supplies τ z'K u, which has either sign.
    """

    @property
    def weight(self) -> Array:
        """The matrix of what z stores and dissipates: L."""
        return self.matrices[1]

    def supplied(self, motion: Motion, states: Array) -> Number:
        """τ z'K u, W."""
        return self.lag * (states @ (self.matrices[0] @ self.along(motion, states)[1]))


def _state(name: str, unit: str, what: str) -> tuple[OwnState, ...]:
    return (OwnState(name, "z", unit, f"{what} as a motor with a lag follows it"),)


@dataclass(frozen=True, eq=False, kw_only=True)
class LaggedForce(Lagged, OfPosition):
    """H with a lag."""

    gains: ClassVar[tuple[Gain, ...]] = (*TranslationalStabilizer.gains, LAG)
    states: ClassVar[tuple[OwnState, ...]] = _state("H.lagged_velocity", "m/s", "V, inertial,")


@dataclass(frozen=True, eq=False, kw_only=True)
class LaggedCouple(Lagged, OfAngles):
    """N with a lag, in the Euler angles."""

    gains: ClassVar[tuple[Gain, ...]] = (*RotationalStabilizer.gains, LAG)
    states: ClassVar[tuple[OwnState, ...]] = _state("N.lagged_rate", "rad/s", "dΘ/dt")


@dataclass(frozen=True, eq=False, kw_only=True)
class LaggedConnector(Lagged, OfContact):
    """A visco-elastic connector with a lag."""

    gains: ClassVar[tuple[Gain, ...]] = (
        *ViscoElasticConnector.gains,
        LAG._replace(key="connector_actuators.lag"),
    )
    states: ClassVar[tuple[OwnState, ...]] = _state("connector.lagged_velocity", "m/s", "F")


@dataclass(frozen=True, eq=False, kw_only=True)
class LaggedTie(AtPoint, LaggedConnector):
    """A tie with a lag."""

    gains: ClassVar[tuple[Gain, ...]] = (*ViscoElasticTie.gains, LAG)
    states: ClassVar[tuple[OwnState, ...]] = _state("state", "m/s", "the rate of the point")


class LateForce(Late, LaggedForce):
    """H with a lag that is too long to be passive."""


class LateCouple(Late, LaggedCouple):
    """N with a lag that is too long to be passive."""


class LateConnector(Late, LaggedConnector):
    """A visco-elastic connector with a lag that is too long to be passive."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LateTie(AtPoint, LateConnector):
    """A tie with a lag that is too long to be passive."""

    gains: ClassVar[tuple[Gain, ...]] = LaggedTie.gains
    states: ClassVar[tuple[OwnState, ...]] = LaggedTie.states

    def supplied(self, motion: Motion, states: Array) -> Number:
        """τ z'K u, W."""
        return super().supplied(self.at_point(motion), states)
