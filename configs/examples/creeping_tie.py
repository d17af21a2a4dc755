"""A tie that creeps under a load: an element with an own state, for `kind: python`."""

from rbstab.elements import ANCHOR, POINT, Element, Gain, OwnState, force_at, position, velocity


class CreepingTie(Element):
    """A spring from the body to a point D; a spring and a damper from D to the anchor."""

    gains = (
        POINT,
        ANCHOR,
        Gain("K_c", "N/m", "stiffness between the body and D, inertial"),
        Gain("L_c", "N s/m", "damping of the point of the body, inertial", dissipates=True),
        Gain("K_d", "N/m", "stiffness between D and the anchor, inertial"),
        Gain("L_d", "N s/m", "damping of D along each inertial axis", shape="diagonal"),
    )

    # Own states: name, symbol, unit, meaning and size (3 by default). The statements get them as
    # `states`, and `rates` returns their derivatives. `initial_state` in configs is D at the start.
    states = (OwnState("state", "D", "m", "the point between the springs, inertial"),)

    def stretch(self, motion, states):
        """The displacement of the point from its anchor, less D, m, inertial."""
        return position(motion, self.point) - self.anchor - states

    def rates(self, motion, states):
        """The derivatives of D, m/s: its damper takes the difference of both springs."""
        return (self.K_c @ self.stretch(motion, states) - self.K_d @ states) / self.L_d

    def wrench(self, motion, states):
        """Spring and damper pull at the point of the body."""
        spring = self.K_c @ self.stretch(motion, states)
        return force_at(motion, self.point, -spring - self.L_c @ velocity(motion, self.point))

    def stored(self, motion, states):
        """The energy of both springs, J."""
        stretch = self.stretch(motion, states)
        return 0.5 * (stretch @ self.K_c @ stretch) + 0.5 * (states @ self.K_d @ states)

    def dissipated(self, motion, states):
        """The power of both dampers, W."""
        F, rate = velocity(motion, self.point), self.rates(motion, states)
        return F @ self.L_c @ F + rate @ (self.L_d * rate)
