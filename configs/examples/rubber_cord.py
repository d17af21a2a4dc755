"""A cord of rubber that stiffens and creeps: an own state whose energy is no quadratic."""

from rbstab.elements import ANCHOR, POINT, Element, Gain, OwnState, exp, force_at, line


class RubberCord(Element):
    """A spring that stiffens, in a row with a slow part: a spring and a damper side by side.

    The slow part is D longer than at rest, and the spring x = ℓ - ℓ₀ - D. Its tension is
    T = kλ (exp(x/λ) - 1), that of the slow part K D + c dD/dt.
    """

    gains = (
        POINT,
        ANCHOR,
        Gain("length", "m", "ℓ₀, the length at rest", shape="number"),
        Gain("stiffness", "N/m", "k, the stiffness at this length", shape="number"),
        Gain("scale", "m", "λ: longer by so much, it is e times as stiff", shape="number"),
        Gain("slow_stiffness", "N/m", "K, the stiffness of the slow part", shape="number"),
        Gain("damping", "N s/m", "c, the damping of the slow part", shape="number"),
    )
    states = (OwnState("creep", "D", "m", "how much longer the slow part is", size=1),)

    def share(self, motion, own):
        """x/λ."""
        along = line(motion, self.point, self.anchor)
        return (along.length - self.length - own[0]) / self.scale

    def tension(self, motion, own):
        """T, N. If the cord is short it pushes, with less than kλ."""
        return self.stiffness * self.scale * (exp(self.share(motion, own)) - 1)

    def rates(self, motion, own):
        """dD/dt, m/s."""
        return (self.tension(motion, own) - self.slow_stiffness * own) / self.damping

    def wrench(self, motion, own):
        """The tension pulls at the point."""
        along = line(motion, self.point, self.anchor)
        return force_at(motion, self.point, -self.tension(motion, own) * along.direction)

    def stored(self, motion, own):
        """The energy of both springs, J. It is convex in D: proofs need this."""
        share = self.share(motion, own)
        spring = self.stiffness * self.scale**2 * (exp(share) - share - 1)
        return spring + 0.5 * self.slow_stiffness * own[0] ** 2

    def dissipated(self, motion, own):
        """c (dD/dt)², W."""
        (rate,) = self.rates(motion, own)
        return self.damping * rate**2
