"""Files with elements of users whose force pushes away from its switch."""

from support.user_code import element_text

OUTWARDS = element_text(
    """
    mode_count = 2
    kinked = True

    def guards(self, motion, own):
        pitch = motion.Theta[1]
        return np.array([pitch - self.soft, -pitch - self.soft])

    def wrench(self, motion, own):
        return couple_on_body(self.k * (self.mode[0] - self.mode[1]) * motion.B[1])

    def stored(self, motion, own):
        above, below = self.guards(motion, own)
        return -self.k * (self.mode[0] * above + self.mode[1] * below)
    """,
    'Gain("k", "N m", "couple", shape="number"), Gain("soft", "rad", "angle", shape="number")',
)
"""A couple away from θ2 = 0, beyond an angle: the opposite of a repelling guard."""

LETS_GO = element_text(
    """
    mode_count = 1
    kinked = True

    def guards(self, motion, own):
        return np.array([motion.A[0, 2] * motion.A[0, 2] - self.soft * self.soft])

    def wrench(self, motion, own):
        row = motion.A[0]
        pull = self.k * row[2] * (1 - self.mode[0])
        return couple_on_body(-pull * np.array([-row[1], row[0], 0.0]))

    def stored(self, motion, own):
        x = motion.A[0, 2]
        beyond = x * x - self.soft * self.soft
        return 0.5 * self.k * x * x - 0.5 * self.k * self.mode[0] * beyond
    """,
    'Gain("k", "N m", "stiffness", shape="number"), Gain("soft", "1", "limit", shape="number")',
)
"""A spring to an upright body that lets go where it is stretched too far."""
