"""A tie that muscles stiffen: its stiffness and its damping rise with their activation."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rbstab.elements.declarations import Gain, OwnState
from rbstab.elements.element import Element
from rbstab.elements.inputs.signals import Driven
from rbstab.elements.visco_elastic import ViscoElasticTie
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number, square, tanh

SMOOTHNESS = 10.0
"""b. The source prints 0.1, with which both time constants act alike in both directions; OpenSim
recommends 10."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CoactivatedTie(ViscoElasticTie, Driven):
    """A visco-elastic tie times the activation a of muscles that pull against each other.

    a follows the excitation u = u_0 + u_1 s(t), with a signal s:

        ȧ = (u - a)((½ + φ)/(τ_a z) + (½ - φ) z/τ_d)    φ = ½ tanh(b(u - a))    z = ½ + 3a/2

    So a stays between 0 and 1 if it begins there, and u stays there. The own state is r = a - u_0,
    shape (1,): it vanishes at rest without the signal. ½ȧ e'K_c e is supplied.

    Args:
        K_c: Stiffness at a = 1, shape (3, 3), N/m, inertial.
        L_c: Damping at a = 1, shape (3, 3), N s/m, inertial.
        excitation: u_0, between 0 and 1.
        amplitude: u_1.
        activation_time: τ_a, s.
        deactivation_time: τ_d, s.

    Source: F. De Groote, A. L. Kinney, A. V. Rao and B. J. Fregly, Ann. Biomed. Eng. 44 (2016)
    2922-2936, for ȧ, with τ_a = 0.015 s and τ_d = 0.06 s.
    """

    gains: ClassVar[tuple[Gain, ...]] = (
        *ViscoElasticTie.gains,
        Gain("excitation", "1", "u_0, excitation without the signal", "number", at_most=1.0),
        Gain("amplitude", "1", "u_1, excitation by the signal", "number", positive=False),
        Gain("activation_time", "s", "τ_a, time constant of a rise", "number"),
        Gain("deactivation_time", "s", "τ_d, time constant of a fall", "number"),
    )
    states: ClassVar[tuple[OwnState, ...]] = (
        OwnState("rise", "a - u_0", "1", "activation above that without the signal", size=1),
    )

    excitation: Number
    amplitude: Number
    activation_time: Number
    deactivation_time: Number

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """-a(K_c e + L_c ė), N, inertial, at the point."""
        force, couple, _ = super().wrench(motion, states)
        activation = self.excitation + states[0]
        return Wrench(activation * force, activation * couple, ZERO)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ a e'K_c e, J."""
        return (self.excitation + states[0]) * super().stored(motion, states)

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """a ė'L_c ė, W."""
        return (self.excitation + states[0]) * super().dissipated(motion, states)

    def supplied(self, motion: Motion, states: Array) -> Number:
        """½ ȧ e'K_c e, W."""
        return self.rates(motion, states)[0] * super().stored(motion, states)

    def rates(self, motion: Motion, states: Array) -> Array:
        """ȧ, 1/s."""
        lack = self.amplitude * self.signal.value(motion.time) - states[0]
        share, z = 0.5 * tanh(SMOOTHNESS * lack), 0.5 + 1.5 * (self.excitation + states[0])
        rise = (0.5 + share) / (self.activation_time * z)
        return np.array([lack * (rise + (0.5 - share) * z / self.deactivation_time)])

    def at_rest(self) -> Element:
        """The tie with a = u_0, kept there by a spring."""
        return _RestingTie(**vars(self))


class _RestingTie(CoactivatedTie):
    """The tie with a = u_0: r has the energy ½ r², in J, so that its minimum is at r = 0."""

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ u_0 e'K_c e + ½ r², J."""
        return super().stored(motion, 0.0 * states) + 0.5 * square(states[0])
