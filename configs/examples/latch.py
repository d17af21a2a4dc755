"""A spring that holds a body upright, and lets go where it is stretched too far."""

import numpy as np

from rbstab.elements import Element, Gain, couple_on_body


class Latch(Element):
    """The energy ½ k x² up to |x| = a, and ½ k a² beyond. x is how far the body leans to e1.

    Its force jumps to zero where it lets go, so the energy has a ridge there. It acts again as soon
    as the body comes back.
    """

    gains = (
        Gain("k", "N m", "couple by the lean x", shape="number"),
        Gain("reach", "1", "a, the largest lean that it holds", shape="number"),
    )
    mode_count = 1
    kinked = True

    def guards(self, motion, own):
        """x² - a²: it has let go where this is positive."""
        return np.array([motion.A[0, 2] * motion.A[0, 2] - self.reach * self.reach])

    def wrench(self, motion, own):
        """The couple -k x ∂x along each turn of the body."""
        to_e1 = motion.A[0]
        pull = (1 - self.mode[0]) * self.k * to_e1[2]
        return couple_on_body(-pull * np.array([-to_e1[1], to_e1[0], 0.0]))

    def stored(self, motion, own):
        """The energy of the spring, J."""
        x = motion.A[0, 2]
        return 0.5 * self.k * (x * x - self.mode[0] * (x * x - self.reach * self.reach))
