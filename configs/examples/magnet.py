"""A magnet that pulls a point of the body into a well of the form of a bell, for `kind: python`."""

from rbstab.elements import ANCHOR, POINT, Element, Gain, exp, force_at, position


class Magnet(Element):
    """The energy -d exp(-e'e/w²), with e from the magnet to a point of the body."""

    gains = (
        POINT,
        ANCHOR,
        Gain("depth", "J", "d, the energy that it takes to pull the point away", shape="number"),
        Gain("width", "m", "w, the distance at which the pull fades", shape="number"),
    )

    def near(self, motion):
        """The displacement e, m, and exp(-e'e/w²)."""
        e = position(motion, self.point) - self.anchor
        return e, exp(-(e @ e) / (self.width * self.width))

    def wrench(self, motion, states):
        """A force at the point: minus the slope of the energy."""
        e, share = self.near(motion)
        return force_at(motion, self.point, -2 * self.depth / (self.width * self.width) * share * e)

    def stored(self, motion, states):
        """The energy, J: zero far away."""
        _, share = self.near(motion)
        return -self.depth * share
