"""A cord of rubber that stiffens and creeps: its energy is not quadratic in its own state."""

from rbstab.elements import ANCHOR, POINT, Element, Gain, OwnState, exp, force_at, line


class RubberCord(Element):
    """A spring that stiffens, in series with a slow part: a spring and a damper side by side.

    ℓ is the length of the line from the point to the anchor. The slow part is longer than at rest
    by D, and the spring by x = ℓ - ℓ₀ - D. The tension of the spring is T = kλ (exp(x/λ) - 1), that
    of the slow part K D + c dD/dt. They are equal.
    """

    gains = (
        POINT,
        ANCHOR,
        Gain("length", "m", "ℓ₀, the length at rest", shape="number"),
        Gain("stiffness", "N/m", "k, the stiffness at rest", shape="number"),
        Gain("scale", "m", "λ: a stretch x = λ makes it e times as stiff", shape="number"),
        Gain("slow_stiffness", "N/m", "K, the stiffness of the slow part", shape="number"),
        Gain("damping", "N s/m", "c, the damping of the slow part", shape="number"),
    )
    states = (OwnState("creep", "D", "m", "how much longer the slow part is", size=1),)

    def relative_stretch(self, motion, states):
        """x/λ."""
        along = line(motion, self.point, self.anchor)
        return (along.length - self.length - states[0]) / self.scale

    def tension(self, motion, states):
        """T, N. For x < 0 it pushes, with less than kλ; a real cord would be slack."""
        s = self.relative_stretch(motion, states)
        return self.stiffness * self.scale * (exp(s) - 1)

    def rates(self, motion, states):
        """dD/dt, m/s."""
        return (self.tension(motion, states) - self.slow_stiffness * states) / self.damping

    def wrench(self, motion, states):
        """The tension pulls at the point."""
        along = line(motion, self.point, self.anchor)
        return force_at(motion, self.point, -self.tension(motion, states) * along.direction)

    def stored(self, motion, states):
        """The energy of both springs, J.

        Proofs need it to be convex in D. Its second derivative is k exp(x/λ) + K.
        """
        s = self.relative_stretch(motion, states)
        spring = self.stiffness * self.scale**2 * (exp(s) - s - 1)
        return spring + 0.5 * self.slow_stiffness * states[0] ** 2

    def dissipated(self, motion, states):
        """c (dD/dt)², W."""
        (rate,) = self.rates(motion, states)
        return self.damping * rate**2
