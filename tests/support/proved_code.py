"""Files with elements of users that proofs read, or refuse: springs, guards, and what lets go."""

from support.user_code import CREEPING_TIE, element_text

_NUMBERS = (
    'Gain("k", "1", "strength", shape="number"), Gain("soft", "1", "where it begins", '
    'shape="number", positive=False)'
)

_GUARD = """
    mode_count = 2

    def guards(self, motion, states):
        pitch = motion.Theta[1]
        return np.array([pitch - self.soft, -pitch - self.soft])
"""

STIFF_GUARD = element_text(
    f"""{_GUARD}
    def wrench(self, motion, states):
        above, below = self.mode * self.guards(motion, states)
        return couple_on_body(-self.k * (above - below) * motion.B[1])

    def stored(self, motion, states):
        above, below = self.guards(motion, states)
        return 0.5 * self.k * (self.mode[0] * above * above + self.mode[1] * power(below, 2))
    """,
    _NUMBERS,
)
"""What `kind: guard` with `method: stiff` is."""

REPELLING_GUARD = element_text(
    f"""{_GUARD}
    def wrench(self, motion, states):
        return couple_on_body(-self.k * (self.mode[0] - self.mode[1]) * motion.B[1])

    def stored(self, motion, states):
        return self.k * (self.mode @ self.guards(motion, states))
    """,
    _NUMBERS,
)
"""What `kind: guard` with `method: repelling` is; its class does not say that its force jumps."""

OUTWARDS = REPELLING_GUARD.replace("mode_count", "kinked = True\n    mode_count").replace(
    "self.k", "(-self.k)"
)
"""A couple away from θ2 = 0, beyond an angle: the opposite of a repelling guard."""

LETS_GO = (CREEPING_TIE.parent / "latch.py").read_text(encoding="utf-8")
LETS_GO = LETS_GO.replace("class Latch", "class Mine")
"""A spring to an upright body that lets go where it is stretched too far."""

CUBIC_OF_CENTRE = element_text(
    """
    def wrench(self, motion, states):
        return force_at_centre(-self.k * power(motion.X, 3))

    def stored(self, motion, states):
        return 0.25 * (self.k @ power(motion.X, 4))
    """,
    'Gain("k", "N/m^3", "stiffness", shape="diagonal")',
)
"""A spring of the centre of gravity that stiffens."""

FLOOR = element_text("""
    mode_count = 1

    def guards(self, motion, states):
        return np.array([-motion.X[2] - 0.1])

    def wrench(self, motion, states):
        depth = -motion.X[2] - 0.1
        return force_at_centre(np.array([0.0, 0.0, self.mode[0] * self.k * depth]))

    def stored(self, motion, states):
        depth = -motion.X[2] - 0.1
        return 0.5 * self.k * self.mode[0] * depth * depth
    """)
"""A soft floor under the centre."""

WEIGHT = element_text(
    """
    mode_count = 1

    def guards(self, motion, states):
        return np.array([line(motion, self.point, self.anchor).length - self.length])

    def wrench(self, motion, states):
        along = line(motion, self.point, self.anchor)
        return force_at(motion, self.point, -self.mode[0] * self.k * along.direction)

    def stored(self, motion, states):
        along = line(motion, self.point, self.anchor)
        return self.mode[0] * self.k * (along.length - self.length)
    """,
    'POINT, ANCHOR, Gain("k", "N", "weight", shape="number"), '
    'Gain("length", "m", "length", shape="number")',
)
"""A weight on the ground that a rope lifts where it is longer than ℓ₀."""
